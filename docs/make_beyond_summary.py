"""Writes the first table of validation/beyond.md from what make_beyond*.py measured."""

from __future__ import annotations

from typing import Any, NamedTuple

import beyond
import make_beyond
import make_beyond_both
import make_beyond_micro
import measured_page
from beyond import GROUPS, Quantity

MAKERS: dict[str, Any] = {
    "macro": make_beyond,
    "micro": make_beyond_micro,
    "both": make_beyond_both,
}


class Row(NamedTuple):
    """One quantity: where it is measured, digits, what the thesis prints, and the limit."""

    title: str
    maker: str
    name: str
    digits: int
    thesis: str
    limit: str


ROWS = (
    Row("micro RMS in a hold [um]", "micro", "RMS in a hold", 2, "5", "0.1"),
    Row("contraction to 10 um / limit", "micro", "contraction to 10 um by the limit",
        2, "0.5 s", "1"),
    Row("extension to 10 um / limit", "micro", "extension to 10 um by the limit", 3, "1 s", "1"),
    Row("steps of at most 0.1 mm, limit + [ms]", "micro",
        "steps of at most 0.1 mm beyond the limit", 0, "-", "0"),
    Row("200 mm to 1 count / limit", "macro", "the same by the limit", 3, "0.75 s", "1"),
    Row("moves outside the count at the end", "macro",
        "outside the count at the end", 0, "-", "none"),
    Row("counts beyond the target", "macro", "counts beyond the target", 0, "0", "0"),
    Row("swing, moves above 40 mm [um]", "macro", "swing 0.1 s after, above 40 mm", 1, "20", "0"),
    Row("swing, moves of 1 to 40 mm [um]", "macro", "swing 0.1 s after, 1 to 40 mm", 1, "20", "0"),
    Row("macro, micro and swing below 2 um [s]", "both", "macro, micro and swing close",
        2, "3.3", "-"),
    Row("laser error in cycle 10, no fan [um]", "both", "laser error in cycle 10", 1, "bias", "0"),
    Row("extension in cycle 10 / limit", "both", "extension to 10 um in cycle 10 by the limit",
        3, "-", "1"),
    Row("sine of 0.5 mm at 0.2 Hz, RMS [um]", "micro", "sine of 0.5 mm at 0.2 Hz, RMS",
        1, "-", "-"),
    Row("sine of 0.5 mm at 0.5 Hz, RMS [um]", "micro", "sine of 0.5 mm at 0.5 Hz, RMS",
        1, "-", "-"),
    Row("0.2 Hz, learned [um]", "micro", "the same at 0.2 Hz, learned in 10 runs", 2, "-", "-"),
    Row("0.5 Hz, learned [um]", "micro", "the same at 0.5 Hz, learned in 10 runs", 2, "-", "-"),
    Row("macro tracking, RMS [counts]", "macro", "tracking, true position", 2, "-", "0.29"),
)  # fmt: skip


def summary_table(every: dict[str, list[dict[str, Any]]]) -> str:
    """The table: the thesis' law, ours re-identified, and ours as it was."""
    shown = ((GROUPS[0], 0), (GROUPS[0], 1), (GROUPS[1], 1))
    values = {
        (name, *column): maker.rows(beyond.of_group(every[name], column[0]), maker.LAWS[column[1]])
        for name, maker in MAKERS.items()
        for column in shown
    }
    head = ["median, worst", "thesis", "its laws here", "ours, re-identified",
            "ours, not re-identified", "limit"]  # fmt: skip
    lines = []
    for row in ROWS:
        quantity = Quantity(row.name, "", row.digits, counted=row.limit == "none")
        cells = [
            quantity.cell(values[row.maker, *column][row.name], beyond.WORST) for column in shown
        ]
        lines.append([row.title, row.thesis, *cells, row.limit])
    return measured_page.table(head, lines)


if __name__ == "__main__":
    found = {name: measured_page.read(maker.STUDY.results) for name, maker in MAKERS.items()}
    measured_page.put(beyond.PAGE, "summary", summary_table(found))
