"""Where the search for an axis begins, on strokes of an axis that is known."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.commission import _momentum
from macromicro.commission.stand import CommissionError, Record
from macromicro.identify.axis import Axis, simulate


def test_the_momentum_s_balance_is_exact_without_friction_at_rest() -> None:
    axis = Axis(0.2, 3.0, 0.5, 0.1)
    t = np.arange(400) * 1e-3
    made = []
    for way in (1.0, -1.0):
        u = way * (2.0 + np.sin(40.0 * t))
        made.append(Record(t, u, simulate(axis, u, 1e-3)))
    start = _momentum.begun(made, 1e-3)
    for name in ("mass", "viscous", "coulomb", "offset"):
        assert getattr(start, name) == pytest.approx(getattr(axis, name), rel=0.02), name


def test_strokes_one_way_do_not_tell_friction_from_a_weight() -> None:
    t = np.arange(300) * 1e-3
    u = 2.0 + np.sin(40.0 * t)
    made = [Record(t, u, simulate(Axis(0.2, 3.0, 0.5), u, 1e-3))] * 4
    with pytest.raises(CommissionError, match="both directions"):
        _momentum.begun(made, 1e-3)


def test_a_mass_that_is_not_seen_beside_the_damping_begins_at_a_period() -> None:
    axis, dt = Axis(0.005, 5.0, 0.5), 1e-3  # a time constant of one period
    t = np.arange(300) * dt
    made = []
    for way in (1.0, -1.0):
        u = way * (2.0 + np.sin(40.0 * t))
        x = simulate(axis, u, dt)
        # Two periods early: the balance asks for less mass than none.
        made.append(Record(t, u, np.concatenate([x[2:], x[-1:], x[-1:]])))
    start = _momentum.begun(made, dt)
    assert start.mass == pytest.approx(start.viscous * dt)
    assert start.viscous == pytest.approx(axis.viscous, rel=0.05)
