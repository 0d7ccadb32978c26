"""Margins and the least of them, whatever the plant."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro.commission import margins
from macromicro.machines import loops
from macromicro.machines.loops import Complex

F = loops.grid(1e-3, 1e-4)


def integrator(gain: float, late: float = 5e-3) -> Complex:
    """gain e^(-s late) / s: its phase margin is 90 deg less gain late, stable below pi / 2."""
    s = 2j * math.pi * F
    found: Complex = gain / s * np.exp(-s * late)
    return found


def test_the_least_is_of_those_that_were_drawn() -> None:
    found = margins.robust(F, integrator(50.0), map(integrator, (40.0, 80.0, 60.0)))
    assert (found.stable, found.drawn) == (3, 3)
    assert found.found.phase == pytest.approx(90.0 - math.degrees(0.25), abs=0.1)
    assert found.found.gain == pytest.approx(math.pi / 2.0 / 0.25, rel=1e-3)
    assert found.least.phase == pytest.approx(90.0 - math.degrees(0.4), abs=0.1)
    assert found.least.gain == pytest.approx(math.pi / 2.0 / 0.4, rel=1e-3)
    assert found.least.crossover == pytest.approx(40.0 / (2.0 * math.pi), rel=1e-3)


@pytest.mark.parametrize(("late", "stable"), [(1.50, 1), (1.64, 0)])
def test_of_one_pole_it_is_stable_up_to_a_quarter_of_a_turn(late: float, stable: int) -> None:
    found = margins.robust(F, integrator(50.0), [integrator(late / 5e-3)])
    assert found.stable == stable


def test_what_may_spoil_the_loop_is_said_with_its_remedy() -> None:
    def doubts(*gains: float) -> tuple[str, ...]:
        found = margins.robust(F, integrator(50.0), map(integrator, gains))
        return margins.as_robustness(found, "longer records").doubts

    assert doubts(40.0, 60.0) == ()
    assert doubts(40.0, 60.0, 220.0)[0].endswith("the loop may ring.")
    (said,) = doubts(40.0, 400.0, 500.0)
    assert said.startswith("The loop is unstable on 2 of 3 models")
    assert said.endswith("Reduce the gains, or use longer records.")


def test_a_line_each() -> None:
    rows = margins.as_robustness(margins.robust(F, integrator(50.0), [integrator(80.0)]), "").rows
    assert [row[3] for row in rows] == ["Hz", "deg", "", ""]
    assert rows[2][1:3] == ("6.28", ">= 3.93")
