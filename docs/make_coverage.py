"""Writes the shares of validation/identification.md from coverage.json (`make bench-identify`)."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from measured_page import VALIDATION, put, table

RESULTS, PAGE = VALIDATION / "coverage.json", VALIDATION / "identification.md"
ONE, WIDE = (60.0, 76.0), (90.0, 99.0)  # %, of intervals of 68 and 95 %
FEW = 20  # records with errors: below, a share is not significant
MOST = 0.9  # of the records: above, the share that has errors is not shown
BIASED = 0.5  # of the scatter: above, an estimate counts as biased


def cell(rows: list[dict[str, Any]]) -> str:
    """Both shares of one method under one disturbance, over its parameters, marked."""
    told = [row.get("told_in", row["records"]) for row in rows]
    shown = [row for row, count in zip(rows, told, strict=True) if count >= FEW]
    if not shown:
        return "withheld"
    share = min(count / row["records"] for row, count in zip(rows, told, strict=True))
    some = "" if share >= MOST else f" in {100.0 * share:.0f} %"
    text = f"{span(row['one'] for row in shown)}/{span(row['wide'] for row in shown)}"
    outside = [
        row
        for row in shown
        if not (ONE[0] <= row["one"] <= ONE[1] and WIDE[0] <= row["wide"] <= WIDE[1])
    ]
    if not outside:
        return text + some
    off = any(abs(row["bias"]) > BIASED * row["scatter"] for row in outside)
    return f"**{text}**{' biased' if off else ''}{some}"


def span(shares: Iterable[float]) -> str:
    """The least and the greatest of them, or both in one."""
    ordered = sorted(shares)
    return "-".join(dict.fromkeys(f"{share:.0f}" for share in (ordered[0], ordered[-1])))


def shares(rows: list[dict[str, Any]]) -> str:
    """A row for each method, a column for each disturbance."""
    kinds = list(dict.fromkeys(row["disturbance"] for row in rows))
    lines = []
    for method in dict.fromkeys(row["method"] for row in rows):
        cells = [
            [row for row in rows if (row["method"], row["disturbance"]) == (method, kind)]
            for kind in kinds
        ]
        lines.append([method, *(cell(found) if found else "-" for found in cells)])
    return table(["", *kinds], lines)


def read(results: Path = RESULTS) -> list[dict[str, Any]]:
    """The rows of the benchmark's file, whose columns have their names once."""
    kept = json.loads(results.read_text(encoding="utf-8"))
    rows = (zip(kept["columns"], row, strict=True) for row in kept["rows"])
    return [{name: value for name, value in row if value is not None} for row in rows]


if __name__ == "__main__":
    put(PAGE, "coverage", shares(read()))
