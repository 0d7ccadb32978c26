"""What the makers of validation/beyond.md share: benches that differ, and their tables."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import measured_page
import numpy as np

from macromicro.settings import Settings
from macromicro.uncertainty import machines, table

PAGE = measured_page.VALIDATION / "beyond.md"
FIGURES = Path(__file__).parent / "figures"
GROUPS = ("re-identified", "not re-identified")
BENCHES = 20  # published ones
# Shares of the values below what a table shows.
WORST = {"median": 0.5, "worst": 1.0}
NINE_OF_TEN = {"median": 0.5, "90 %": 0.9, "worst": 1.0}

Values = Mapping[str, Sequence[float]]  # by quantity, one for each move or bench


class Quantity(NamedTuple):
    """A row of a table; `counted`: how many there are of it."""

    name: str
    unit: str
    digits: int
    counted: bool = False

    @property
    def title(self) -> str:
        return f"{self.name}{self.unit and f' [{self.unit}]'}"

    def cell(self, values: Sequence[float], shares: Mapping[str, float]) -> str:
        """Quantiles of the values."""
        if self.counted:
            return f"{sum(values):.0f} of {len(values)}"
        found = np.nanquantile(values, list(shares.values())) + 0.0  # no -0
        return ", ".join(f"{each:.{self.digits}f}" for each in found)


def compared(
    quantities: Sequence[Quantity],
    columns: Mapping[str, Values],
    shares: Mapping[str, float] = NINE_OF_TEN,
) -> tuple[list[str], list[list[str]]]:
    """Head and rows of a table: a column for each law and group."""
    head = ["", *(f"{name}: {', '.join(shares)}" for name in columns)]
    return head, [
        [each.title, *(each.cell(values[each.name], shares) for values in columns.values())]
        for each in quantities
    ]


def drawn(rows: Sequence[table.Uncertain], chosen: argparse.Namespace, seed: int) -> list[Settings]:
    """The shipped bench, and benches that differ from it in these quantities."""
    return [Settings(), *differing(rows, measured_page.count(chosen, BENCHES),
                                   measured_page.seed(chosen, seed))]  # fmt: skip


def differing(rows: Sequence[table.Uncertain], number: int, seed: int) -> list[Settings]:
    """So many benches that differ from the shipped one in these quantities."""
    sample = machines.draw(Settings(), rows, number, seed)
    return [machines.settings_at(Settings(), rows, amounts) for amounts in sample.amounts]


def under(settings: Settings, law: str) -> Settings:
    """The bench under a law, or a pair of them."""
    return settings._replace(controller=settings.controller.joined(law, "law"))


def folder(where: str, *names: object) -> Path:
    """One of its own for a bench."""
    made = Path(where, "-".join(map(str, names)).replace(" ", "-"))
    made.mkdir(parents=True, exist_ok=True)
    return made


def last(away: Any) -> int:
    """Samples until the last that is away."""
    at = np.flatnonzero(away)
    return int(at[-1]) + 1 if len(at) else 0


def ways(rows: Sequence[tuple[float, float]], head: str, path: Path) -> Path:
    """A file of targets over time, the last of which holds a period longer."""
    lines = [f"{t:.4f},{x:.6f}" for t, x in (*rows, (rows[-1][0] + 1e-3, rows[-1][1]))]
    path.write_text("\n".join([f"t_s,{head}", *lines]), encoding="utf-8")
    return path


def of_group(every: list[dict[str, Any]], group: str) -> list[dict[str, Any]]:
    """Drawn benches of a group, without those that were refused."""
    return [b for b in every if b["kind"] == group and b["bench"] > 0 and "refused" not in b]


def said(*words: object) -> None:
    """How far it is."""
    print(*words, file=sys.stderr, flush=True)
