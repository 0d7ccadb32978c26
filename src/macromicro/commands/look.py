"""``macromicro look FILE``: what a data file holds, and which command to use next."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from macromicro.commands.streams import printing_warnings

if TYPE_CHECKING:
    from macromicro.identify.look import Look


def look(file: Path, as_json: bool = False) -> None:
    """Print what a data file holds: columns, units, rate, gaps.

    The last line is the command to use next (docs/identify.md).
    """
    from macromicro.identify.look import look as looked
    from macromicro.report.run import as_json as to_json

    with printing_warnings():
        found = looked(file)
    if as_json:
        print(to_json(found.content()), end="")
        return
    _show(found)


def _show(found: Look) -> None:
    from rich.table import Table
    from rich.text import Text

    from macromicro.drawing.console import terminal
    from macromicro.identify.look import words

    console = terminal()
    table = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False)
    for name, side in (
        *(("column", "left"), ("unit", "left"), ("from", "left"), ("low", "right")),
        *(("high", "right"), ("least step", "right"), ("", "left")),
    ):
        table.add_column(name, justify="right" if side == "right" else "left")
    for column in found.columns:
        remarks = list(column.remarks)
        if column.missing:
            remarks.insert(0, f"{column.missing} rows without a number")
        numbers = (column.low, column.high, column.step)
        said = ["" if v != v else f"{v:.6g}" for v in numbers]  # noqa: PLR0124 - NaN
        row = (column.name, column.unit or "-", column.reason or "-", *said, "; ".join(remarks))
        table.add_row(*map(Text, row))
    if found.columns:
        console.print(table)
    for name, value in found.constants.items():
        console.print(Text(f"{name} = {value:g}"))
    if found.timing is not None:
        console.print(Text(f"time, {found.time}: " + "; ".join(words(found.timing))))
    elif found.columns:
        console.print(Text("time: no time column found"))
    for reason in found.onward.reasons:
        console.print(Text(reason))
    if found.onward.template:
        print(f"to complete: {found.onward.template}")
    elif found.onward.command:
        print(found.onward.command)
