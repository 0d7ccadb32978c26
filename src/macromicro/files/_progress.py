"""A progress bar on stderr for long files."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from macromicro.drawing.console import progress_bar

LONG = 50_000_000  # bytes


@contextmanager
def bar(name: str, total: int) -> Iterator[Callable[[int], None]]:
    """Show progress for a long file, if stderr is a terminal."""
    if total < LONG or not sys.stderr.isatty():
        yield lambda _: None
        return
    with progress_bar() as shown:
        task = shown.add_task(f"reading {name}", total=total)
        yield lambda done: shown.update(task, completed=done)
