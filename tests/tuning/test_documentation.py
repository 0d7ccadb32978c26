"""docs/validation/tuning.md: the example's table is what the search gives now."""

from __future__ import annotations

from pathlib import Path

import pytest

from macromicro.tuning.bench import MACRO_OBJECTIVES, MICRO_OBJECTIVES
from macromicro.tuning.request import Request, ready
from macromicro.tuning.search import Tuning, Version

PAGE = (Path(__file__).parents[2] / "docs" / "validation" / "tuning.md").read_text(encoding="utf-8")
STRICT = {"saturated": 0.01}
OPTIONS: dict[str, dict[str, float]] = {"default": {}, "`--penalty saturated=0.01`": STRICT}


def row(name: str) -> list[str]:
    line = next(text for text in PAGE.splitlines() if text.startswith(f"| {name} |"))
    return [cell.strip() for cell in line.strip("|").split("|")][1:]


def check(cells: list[str], found: Tuning, version: Version) -> None:
    names = ("settling_time", "overshoot", "saturated", "iae", "peak_effort")
    (disk,) = (m.value for m in found.subject.margins(version.settings) if m.name == "disk")
    taps = tuple(version.settings.controller.pd_tuned)
    values = [*taps, *(version.runs[0][n] for n in names), disk]
    printed = [*(float(t) for t in cells[0].split(",")), *(float(c) for c in cells[1:])]
    places = (6, 6, 3, 0, 0, 1, 2, 2)
    for value, text, digits in zip(values, printed, places, strict=True):
        assert text == pytest.approx(value, abs=0.51 * 10.0**-digits)


@pytest.mark.slow
@pytest.mark.parametrize("name", OPTIONS)
def test_the_table(name: str) -> None:
    found = ready(Request(stage="macro", penalties=OPTIONS[name])).search()
    check(row(name), found, found.best)
    check(row("the thesis' (4.10)"), found, found.first)


def test_every_objective_is_explained() -> None:
    for objective in (*MACRO_OBJECTIVES, *MICRO_OBJECTIVES):
        assert f"| `{objective.name}` |" in PAGE


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize(("name", "weights"), [("`--robust`, strict", STRICT), ("`--robust`", {})])
def test_the_robust_table(name: str, weights: dict[str, float], seed: int) -> None:
    found = ready(Request(stage="macro", robust=True, seed=seed, penalties=weights)).search()
    assert found.fresh is not None
    printed = [float(cell) for cell in row(f"{name} | {seed}")[1:]]
    costs = [found.first.cost, found.best.cost, *found.fresh.costs]
    assert printed[:4] == pytest.approx(costs, abs=0.0051)
    assert printed[4] == found.fresh.cheaper
