"""The terminal that tables and bars are printed to."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress

WIDE = 120  # characters, where no terminal says how wide it is
LEAST = 80  # for a table; in a narrower terminal lines wrap


def terminal() -> Console:
    """Standard output in the terminal's width."""
    from rich.console import Console

    found = Console(highlight=False)
    if not found.is_terminal:
        return Console(highlight=False, width=WIDE)
    return Console(highlight=False, width=LEAST) if found.width < LEAST else found


def progress_bar(amount: str = "{task.percentage:3.0f} %") -> Progress:
    """A bar on stderr that disappears at the end, with the amount and a description."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    return Progress(
        TextColumn(amount),
        BarColumn(bar_width=24),
        TextColumn("{task.description}", markup=False),
        console=Console(stderr=True),
        transient=True,
    )
