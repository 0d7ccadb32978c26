"""A run of two axes in figures."""

import math

import pytest

from macromicro.machines import results, runs
from macromicro.machines.joint import planning
from macromicro.machines.joint.machine import XY_MACHINE
from macromicro.machines.joint.settings import DEFAULT
from macromicro.machines.runs import StageSetup
from tests.machines.joint.axes import straight

PLAN = planning.plan(straight((0.03, 0.02), (0.03, 0.02), (0.0, 0.03)), DEFAULT)


def test_its_figures_are_those_of_the_moves():
    found = StageSetup(XY_MACHINE, DEFAULT, PLAN).trial(3)
    r = runs.record(XY_MACHINE, DEFAULT, PLAN, seed=3).recording
    moves = results.of(XY_MACHINE, r, PLAN, DEFAULT)
    assert moves[1].contour is None and moves[1].way == 0.0  # it stays
    beside = [moves[0].contour, moves[2].contour]
    assert (found.fault, found.missed) == (0.0, 0.0)
    assert found.contour == pytest.approx(1e3 * max(b.peak for b in beside))
    assert found.true_contour == pytest.approx(1e3 * max(b.true_peak for b in beside))
    rms = math.sqrt(sum(b.rms**2 for b in beside) / 2.0)
    assert found.rms_contour == pytest.approx(1e3 * rms)
    late = [m.arrived_s - m.profile_s for m in moves]
    assert found.settling == pytest.approx(max(0.0, *late))
    assert found.peak_error_x == pytest.approx(1e3 * max(m.axes[0].peak_error for m in moves))
    assert found.peak_error_y == pytest.approx(1e3 * max(m.axes[1].peak_error for m in moves))
    assert found.true_error == pytest.approx(1e3 * max(m.true_error for m in moves))
    for name, rough in (("x", found.rough_x), ("y", found.rough_y)):
        steps = r[f"{name}_effort"][1:] - r[f"{name}_effort"][:-1]
        assert rough == pytest.approx(math.sqrt((steps**2).mean()))


def test_a_run_that_a_guard_stops_has_no_figures():
    strict = DEFAULT.with_("y.guard.error", "1 um")
    found = StageSetup(XY_MACHINE, strict, PLAN).trial(0)
    assert found.fault == 6.0 and found.missed == 3.0
    assert math.isnan(found.contour) and math.isnan(found.rms_contour)


def test_a_move_of_which_one_axis_never_arrives_takes_for_ever():
    never = DEFAULT.with_({"y.arrival.dwell": "1 s", "y.arrival.patience": "10 ms"})
    never = never.with_("x.arrival.patience", "10 ms")
    found = StageSetup(XY_MACHINE, never, planning.plan(straight((0.01, 0.01)), never)).trial(0)
    assert found.missed == 1.0 and found.settling == math.inf and found.contour > 0.0
