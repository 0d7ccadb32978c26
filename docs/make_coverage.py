"""Writes validation/coverage.md from its coverage.json, which `make bench-identify` measures."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent / "validation"
RESULTS, PAGE = HERE / "coverage.json", HERE / "coverage.md"
ONE, WIDE = (60.0, 76.0), (90.0, 99.0)  # %, of intervals of 68 and 95 %
FEW = 20  # records with errors: below, a share is not significant
BIASED = 0.5  # of the scatter: above, an estimate counts as biased
HEAD = """\
# Do the printed errors hold?

`make bench-identify` fits synthetic records of a known machine with `identify` and counts how
often the intervals of 68 and 95 % contain the true value. The intervals are 1 and 1.96 standard
errors to each side, or other factors where these are reported.

A cell gives both shares; **bold** is outside 60 to 76 or 90 to 99 %.

- `biased`: the average is off by more than half of the scatter of single records, so that no
  interval about it can contain the true value.
- `withheld` or `in 40 %`: errors are reported without a doubt for none of the records, or only for
  this fraction, to which the shares then refer. Below 20 such records there is no share. A linear
  result prints its errors in any case, and names the doubt: `errors uncertain: gls is biased ...`.

The headings give the number of records. The uncertainty of a share of 68 %, in %, is {doubt}
records. `docs/validation/coverage.json` contains bias, scatter and reported error of each.

| disturbance | a drive of 4 kg; on a spring, 2 kg | an eccentric load of 0.01 kg m^2 | a decay at 18 Hz, per mass | a linear machine | heating by 60 K, of machines up to 30 % off |
|---|---|---|---|---|---|
| white force | 6 N at 1 kHz | 0.1 N m | 0.05 m/s^2, equal to its friction | 0.3 of an input of +-2 | 5 % of the heat |
| coloured force | twice that at low frequencies, correlated over 20 ms | likewise | likewise | likewise | 0.2 K, over 2 s |
| cogging | 1.5 N, every 50 to 80 mm | 0.025 N m, every 3 to 5 deg | a quarter, every 0.5 to 0.8 mm | 0.1, every 50 to 80 of its travel | - |
| slow force | 1.2 N, a correlation of 1 s | 0.02 N m | 0.01 m/s^2 | 0.06 | 0.2 K, over 60 s |
| sensor | 10 um | 0.1 mrad | 1 um | 50 of an output of +-8000 | 0.125 K |
| quantised | 20 um | 0.2 mrad | 2 um | 100 | 0.25 K |

"""  # noqa: E501 - rows of a table


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


def page(rows: list[dict[str, Any]]) -> str:
    """The text of the page."""
    kinds = list(dict.fromkeys(r["disturbance"] for r in rows))
    many = sorted({r["records"] for r in rows if r["one"] >= 0.0})
    doubt = ", ".join(f"+-{100.0 * math.sqrt(0.68 * 0.32 / n):.0f} of {n}" for n in many)
    lines = [HEAD.format(doubt=doubt)]
    alike: dict[tuple[str, ...], list[str]] = {}  # methods by their tables
    for method in dict.fromkeys(r["method"] for r in rows):
        alike.setdefault(table([r for r in rows if r["method"] == method], kinds), []).append(
            method
        )
    for body, methods in alike.items():
        counted = sorted({r["records"] for r in rows if r["method"] in methods})
        count = " to ".join(str(n) for n in dict.fromkeys((counted[0], counted[-1])))
        title = " and ".join(methods)
        lines += [f"## {title[0].upper()}{title[1:]}: {count} records", "", *body, ""]
    lines += ["## Why some intervals miss", "", (HERE / "coverage.template.md").read_text("utf-8")]
    return "\n".join(lines)


def read(results: Path = RESULTS) -> list[dict[str, Any]]:
    """The rows of the benchmark's file, whose columns have their names once."""
    table = json.loads(results.read_text(encoding="utf-8"))
    rows = (zip(table["columns"], row, strict=True) for row in table["rows"])
    return [{name: value for name, value in row if value is not None} for row in rows]


if __name__ == "__main__":
    PAGE.write_text(page(read()), encoding="utf-8")
