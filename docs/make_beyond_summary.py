"""Writes the first table of validation/beyond.md from what make_beyond*.py measured."""

from __future__ import annotations

from typing import Any, NamedTuple

import make_beyond
import make_beyond_both
import make_beyond_micro
import measured_page
import numpy as np

GROUPS = make_beyond.GROUPS
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
    Row("macro, micro and swing below 2 um [s]", "both", "macro, micro and swing close [s]",
        2, "3.3", "-"),
    Row("laser error in cycle 10, no fan [um]", "both", "laser error in cycle 10 [um]",
        1, "bias", "0"),
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


def values(every: dict[str, list[dict[str, Any]]], row: Row, group: str, law: int) -> list[float]:
    """What one law gave on the benches of a group."""
    maker = MAKERS[row.maker]
    benches = [b for b in every[row.maker] if b["kind"] == group and "refused" not in b]
    benches = [b for b in benches if b["bench"] > 0]
    found = maker.rows(benches, maker.LAWS[law])
    if isinstance(found, dict):
        return [float(v) for v in found[row.name]]
    return list(found[[name for name, _ in maker.TABLE].index(row.name)])


def cell(found: list[float], row: Row) -> str:
    """Median and worst; of what is counted, how many."""
    if row.limit == "none":
        return f"{int(np.sum(found))} of {len(found)}"
    return f"{np.nanmedian(found):.{row.digits}f}, {np.nanmax(found):.{row.digits}f}"


def told(every: dict[str, list[dict[str, Any]]]) -> str:
    """The table."""
    lines = [
        "| median, worst | thesis | its laws here | ours, re-identified | ours, not re-identified "
        "| limit |",
        "|---" * 6 + "|",
    ]
    for row in ROWS:
        shipped, ours, not_ours = (
            cell(values(every, row, GROUPS[g], law), row) for g, law in ((0, 0), (0, 1), (1, 1))
        )
        lines.append(
            f"| {row.title} | {row.thesis} | {shipped} | {ours} | {not_ours} | {row.limit} |"
        )
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    found = {name: measured_page.read(maker.RESULTS) for name, maker in MAKERS.items()}
    measured_page.put(make_beyond.PAGE, "summary", told(found))
