"""The terminal that tables and bars are printed to."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress
    from rich.table import Table

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


def table(headings: Iterable[str], left: int = 0) -> Table:
    """A table without lines, whose first `left` columns begin at the left."""
    from rich.table import Table
    from rich.text import Text

    found = Table(box=None, padding=(0, 1, 0, 0), pad_edge=False)
    for k, heading in enumerate(headings):
        found.add_column(
            Text(heading),
            justify="left" if k < left else "right",
            overflow="fold",
            vertical="bottom",
        )
    return found


def add_row(to: Table, cells: Sequence[str], style: str = "") -> None:
    from rich.text import Text

    to.add_row(*map(Text, cells), style=style)
