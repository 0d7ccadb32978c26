"""docs/tuning.md: the example's table is what the search gives now."""

from __future__ import annotations

from pathlib import Path

import pytest

from macromicro import tuning
from macromicro.tuning._objectives import OBJECTIVES

PAGE = (Path(__file__).parents[2] / "docs" / "tuning.md").read_text(encoding="utf-8")
STRICT: dict[str, object] = {"penalties": (("saturated", 0.01),)}
OPTIONS: dict[str, dict[str, object]] = {
    "`--route thesis`": {"route": "thesis"},
    "default": {},
    "`--penalty saturated=0.01`": STRICT,
}


def row(name: str) -> list[str]:
    line = next(text for text in PAGE.splitlines() if text.startswith(f"| {name} |"))
    return [cell.strip() for cell in line.strip("|").split("|")][1:]


def check(cells: list[str], taps: object, metrics: dict[str, float], disk: float) -> None:
    names = ("settling_time", "overshoot", "saturated", "iae", "peak_effort")
    found = [*tuple(taps), *(metrics[n] for n in names), disk]  # type: ignore[arg-type]
    printed = [*(float(t) for t in cells[0].split(",")), *(float(c) for c in cells[1:])]
    places = (6, 6, 3, 0, 0, 1, 2, 2)
    for value, text, digits in zip(found, printed, places, strict=True):
        assert text == pytest.approx(value, abs=0.51 * 10.0**-digits)


@pytest.mark.parametrize("name", OPTIONS)
def test_the_table(name: str) -> None:
    done = tuning.macro(**OPTIONS[name])
    assert done.margins is not None
    after = (done.tuned.controller.pd_tuned, done.bench[1].metrics, done.margins[1].disk)
    check(row(name), *after)
    before = (done.plan.start.controller.pd_tuned, done.bench[0].metrics, done.margins[0].disk)
    check(row("the thesis' (4.10)"), *before)


def test_every_objective_is_explained() -> None:
    for known in OBJECTIVES.values():
        for objective in known:
            assert f"| `{objective.name}` |" in PAGE


ROBUST: list[tuple[str, dict[str, object], int]] = [
    ("`--robust`, strict", STRICT, 0),
    ("`--robust`, strict", STRICT, 1),
    ("`--robust`, strict", STRICT, 2),
    ("`--robust`", {}, 0),
    ("`--robust`", {}, 1),
    ("`--robust`", {}, 2),
]


def check_robust(name: str, options: dict[str, object], seed: int) -> None:
    found = tuning.macro(robust=True, seed=seed, **options)
    assert found.robust_costs is not None
    assert found.held_out is not None
    printed = [float(cell) for cell in row(f"{name} | {seed}")[1:]]
    assert printed[:4] == pytest.approx([*found.robust_costs, *found.held_out.costs], abs=0.0051)
    assert printed[4] == found.held_out.cheaper


@pytest.mark.parametrize(
    ("name", "options", "seed"),
    [pytest.param(*row, marks=pytest.mark.slow) for row in ROBUST],
)
def test_the_robust_table(name: str, options: dict[str, object], seed: int) -> None:
    check_robust(name, options, seed)
