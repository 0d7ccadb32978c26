"""Measures of moves, from recordings made by hand."""

import numpy as np
import pytest

from macromicro.columns import Column
from macromicro.machines import results
from macromicro.machines.sequence import Arrival, Plan
from macromicro.recording import Recording

DT = 1e-3
RULE = Arrival(tolerance=1e-4, dwell=0.01)
NAN = float("nan")


def recording(**columns):
    names = [Column(name, "1", "", "f8") for name in columns]
    return Recording.from_arrays(names, np.array(list(columns.values())), DT, {})


def plan(*targets, length=0.1):
    n = len(targets)
    return Plan(
        np.full(n, NAN),
        np.array(targets),
        np.full(n, 0.2),
        np.full(n, length),
        np.zeros(n + 1, np.int64),
        np.empty((0, 5)),
        0.0,
        NAN,
    )


def one(way=1.0):
    """100 ms of profile to 10 mm, 2 um overshoot, arrival at 150 ms, 0.4 um short at rest."""
    t = np.arange(400) * DT
    target = np.where(t < 0.1 - 1e-9, 100.0 * t, 10.0)
    error = np.where(t < 0.1 - 1e-9, 0.03, 0.0004)
    error[50], error[120] = -0.07, -0.002
    return recording(
        t=t,
        move=np.zeros(400),
        target=way * target,
        position=way * (target - error),
        true_position=way * (target - error + 0.0001),
        arrived=(t > 0.1595).astype(float),
        phase=np.where(t > 0.1595, 2.0, 1.0),
    )


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_move_in_figures(way):
    (m,) = results.moves(one(way), plan(0.01 * way), RULE)
    assert m.target == pytest.approx(10.0 * way) and m.start_s == 0.0 and m.profile_s == 0.1
    assert m.arrived_s == pytest.approx(0.15)
    assert m.peak_error == pytest.approx(0.07)
    assert m.rms_error == pytest.approx(np.sqrt((99 * 0.03**2 + 0.07**2) / 100.0))
    assert m.overshoot == pytest.approx(0.002)
    assert m.rest_error == pytest.approx(0.0004 * way)
    assert m.true_error == pytest.approx(0.0003 * way)
    assert m.complete


def test_a_move_cut_short_says_what_it_knows():
    short = one()
    rows = np.array([short[c.name][:80] for c in short.columns])
    (m,) = results.moves(Recording.from_arrays(short.columns, rows, DT, {}), plan(0.01, 0.02), RULE)
    assert m.arrived_s is None and m.overshoot is None and m.rest_error is None
    assert m.true_error is None and not m.complete and m.peak_error == pytest.approx(0.07)


def test_settling_counts_from_the_end_of_the_profile():
    (m,) = results.moves(one(), plan(0.01), RULE)
    early, never = m._replace(arrived_s=0.08), m._replace(arrived_s=None)
    assert results.settling([m, early, never]) == pytest.approx([0.05, -0.02, np.inf])
    assert results.count_arrived([m, early, never]) == 2
