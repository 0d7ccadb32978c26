"""A bar on stderr while a long file is read."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

LONG = 50_000_000  # bytes


@contextmanager
def bar(name: str, total: int) -> Iterator[Callable[[int], None]]:
    """Show how far a file has been read, where it is long and stderr is a terminal.

    Parameters
    ----------
    name : str
        Of the file.
    total : int
        Its bytes.

    Yields
    ------
    Callable[[int], None]
        Takes how many bytes have been read.
    """
    if total < LONG or not sys.stderr.isatty():
        yield lambda _: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    parts = (TextColumn("reading {task.description}"), BarColumn(), TimeRemainingColumn())
    with Progress(*parts, console=Console(stderr=True), transient=True) as shown:
        task = shown.add_task(name, total=total)
        yield lambda done: shown.update(task, completed=done)
