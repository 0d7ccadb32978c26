"""Output in the terminal: a progress bar during a run, then a table."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from macromicro.drawing.console import add_row, progress_bar, table, terminal
from macromicro.report import _comparison_words
from macromicro.report.comparison import Comparison
from macromicro.report.run import RunReport
from macromicro.runs import folder

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

Report = Callable[[float, int], None]


def progress(job: Any) -> AbstractContextManager[Report]:
    """The bar of a run."""
    return bar(job.setup.title, job.setup.expected, job.setup.describe)


@contextmanager
def bar(title: str, expected: float, words: Callable[[int], str]) -> Iterator[Report]:
    """A bar on stderr, in simulated seconds; one plain line where that is no terminal."""
    if not sys.stderr.isatty():
        print(f"running {title}: about {expected:.0f} s of machine time", file=sys.stderr)
        yield lambda t, move: None
        return
    with progress_bar("{task.completed:6.0f} of {task.total:.0f} s") as shown:
        task = shown.add_task("", total=expected)

        def report(t: float, move: int) -> None:
            longest = max(t, expected)
            shown.update(task, completed=t, total=longest, description=words(move))

        yield report


def show(report: RunReport, out: Path) -> None:
    """The table of a run, its verdict and remarks."""
    from rich.text import Text

    console = terminal()
    shown = _moves(report, report.headings)
    unbounded = console.options.update_width(sys.maxsize)
    if console.measure(shown, options=unbounded).maximum > console.width:
        shown = _moves(report, [_break_up(each) for each in report.headings])
    if report.table:
        console.print(shown)
        console.print()
    console.print(Text(f"{report.verdict}; open {out / folder.PAGE}"), soft_wrap=True)
    for name, text in report.remarks:
        console.print(Text(f"{name}: {text}"), soft_wrap=True)


def _moves(report: RunReport, headings: Sequence[str]) -> Table:
    shown = table(headings)
    for line in report.table:
        add_row(shown, line.cells, "" if line.arrived else "bold red")
    return shown


def _break_up(heading: str) -> str:
    """A heading in two lines."""
    return heading.replace("overshoot", "over-\nshoot").replace(" ", "\n", 1)


def show_comparison(found: Comparison) -> None:
    from rich.text import Text

    console = terminal()
    first = found.sides[0].name
    several = ("compared",) if len(found.sides) > 2 else ()
    moves, columns = _comparison_words.table(found), _comparison_words.columns(found)
    if moves:
        console.print(Text(f"{first}, and by how much the others differ"))
        _table(console, (*several, *_comparison_words.HEADINGS), moves)
    if columns:
        console.print(Text(f"Columns that differ from {first}"))
        _table(console, (*several, *_comparison_words.COLUMNS), columns)
    for name, text in _comparison_words.remarks(found):
        console.print(Text(f"{name}: {text}"), soft_wrap=True)


def _table(console: Console, headings: Sequence[str], lines: Sequence[Sequence[str]]) -> None:
    shown = table(headings)
    for cells in lines:
        add_row(shown, cells)
    console.print(shown)
    console.print()
