"""A run into its folder, as the commands perform it."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any

import typer

from macromicro.commands.signals import Signals


def performed(
    execute: Callable[[Any, Callable[[float, int], None]], Any],
    job: Any,
    bar: AbstractContextManager[Callable[[float, int], None]],
    signals: Signals,
) -> Any:
    """The result of `execute`. A signal ends the run with a whole recording and no report."""
    from macromicro.runs.job import Stop

    reached = 0.0
    try:
        with bar as report:

            def step(t: float, move: int) -> None:
                nonlocal reached
                reached = t
                report(t, move)
                if signals.received:
                    signals.ignore()
                    raise Stop

            return execute(job, step)
    except Stop:
        said = f"interrupted at {reached:.3f} s; the recording is in {job.out}"
        print(f"macromicro: {said}", file=sys.stderr)
        raise typer.Exit(signals.status) from None
