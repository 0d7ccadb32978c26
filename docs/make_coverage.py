"""Writes the shares of validation/identification.md from coverage.json (`make bench-identify`)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent / "validation"
RESULTS, PAGE = HERE / "coverage.json", HERE / "identification.md"
ONE, WIDE = (60.0, 76.0), (90.0, 99.0)  # %, of intervals of 68 and 95 %
FEW = 20  # records with errors: below, a share is not significant
BIASED = 0.5  # of the scatter: above, an estimate counts as biased


def cell(row: dict[str, Any]) -> str:
    """Both shares, marked."""
    told, count = row.get("told_in", row["records"]), row["records"]
    if told < FEW:
        return f"withheld in {count - told} of {count}" if told else "withheld"
    some = "" if told == count else f" in {100.0 * told / count:.0f} %"
    good = ONE[0] <= row["one"] <= ONE[1] and WIDE[0] <= row["wide"] <= WIDE[1]
    text = f"{row['one']:.0f}/{row['wide']:.0f}"
    if good:
        return text + some
    off = " biased" if abs(row["bias"]) > BIASED * row["scatter"] else ""
    return f"**{text}**{off}{some}"


def table(rows: list[dict[str, Any]], kinds: list[str]) -> tuple[str, ...]:
    """A method's parameters under all disturbances."""
    lines = [f"| | {' | '.join(kinds)} |", "|---" * (len(kinds) + 1) + "|"]
    cells: dict[tuple[str, ...], list[str]] = {}  # parameters by their cells
    for name in dict.fromkeys(r["parameter"] for r in rows):
        found = {r["disturbance"]: cell(r) for r in rows if r["parameter"] == name}
        cells.setdefault(tuple(found.get(k, "-") for k in kinds), []).append(name)
    lines += [f"| {', '.join(names)} | {' | '.join(row)} |" for row, names in cells.items()]
    return tuple(lines)


def tables(rows: list[dict[str, Any]]) -> str:
    """A section for each method; methods with the same shares have one."""
    kinds = list(dict.fromkeys(r["disturbance"] for r in rows))
    alike: dict[tuple[str, ...], list[str]] = {}  # methods by their tables
    for method in dict.fromkeys(r["method"] for r in rows):
        alike.setdefault(table([r for r in rows if r["method"] == method], kinds), []).append(
            method
        )
    lines = []
    for body, methods in alike.items():
        counted = sorted({r["records"] for r in rows if r["method"] in methods})
        count = " to ".join(str(n) for n in dict.fromkeys((counted[0], counted[-1])))
        title = " and ".join(methods)
        lines += [f"### {title[0].upper()}{title[1:]}: {count} records", "", *body, ""]
    return "\n".join(lines[:-1]) + "\n"


def read(results: Path = RESULTS) -> list[dict[str, Any]]:
    """The rows of the benchmark's file, whose columns have their names once."""
    table = json.loads(results.read_text(encoding="utf-8"))
    rows = (zip(table["columns"], row, strict=True) for row in table["rows"])
    return [{name: value for name, value in row if value is not None} for row in rows]


if __name__ == "__main__":
    from measured_page import put

    put(PAGE, "coverage", tables(read()))
