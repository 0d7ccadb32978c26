"""A run in figures."""

import math

import pytest

from macromicro.machines import machine, planning, results, runs
from macromicro.machines.runs import StageSetup

AXIS = machine.MACHINES[0]
USUAL = planning.usual(AXIS.settings)
PLAN = planning.plan(
    USUAL._replace(
        start=USUAL.start[:2],
        stage=USUAL.stage[:2],
        target=USUAL.target[:2] / 5.0,
        hold=USUAL.hold[:2] / 3.0,
    ),
    AXIS.settings,
)


def test_its_figures_are_those_of_the_moves():
    found = StageSetup(AXIS, AXIS.settings, PLAN).trial(3)
    recording = runs.record(AXIS, AXIS.settings, PLAN, seed=3).recording
    moves = results.moves(recording, PLAN, AXIS.settings.arrival)
    late = [m.arrived_s - m.profile_s for m in moves]
    assert found.fault == 0.0 and found.missed == 0.0
    assert found.settling == pytest.approx(max(0.0, *late))
    assert found.mean_settling == pytest.approx(max(0.0, sum(late) / 2.0))
    assert found.peak_error == pytest.approx(1e3 * max(m.peak_error for m in moves))
    assert found.rms_error == pytest.approx(
        1e3 * math.sqrt(sum(m.rms_error**2 for m in moves) / 2.0)
    )
    assert found.rest_error == pytest.approx(1e3 * max(abs(m.rest_error) for m in moves))
    assert found.true_error == pytest.approx(1e3 * max(abs(m.true_error) for m in moves))
    assert found.effort == pytest.approx(abs(recording["effort"]).max())


def test_a_run_that_the_guard_stops_has_no_figures():
    strict = AXIS.settings.with_("guard.error", "1 um")
    found = StageSetup(AXIS, strict, PLAN).trial(0)
    assert found.fault > 0.0 and found.missed == 2.0 and math.isnan(found.peak_error)


def test_a_move_that_never_arrives_takes_for_ever():
    never = AXIS.settings.with_({"arrival.dwell": "1 s", "arrival.patience": "10 ms"})
    found = StageSetup(AXIS, never, planning.plan(USUAL, never)).trial(0)
    assert found.missed == 4.0 and found.settling == math.inf and found.peak_error > 0.0
