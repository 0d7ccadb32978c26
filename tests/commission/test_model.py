"""Strokes, and the model that explains them, on an axis that is known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.commission.axes import PLAIN, Virtual, session

from macromicro.commission import _exciting, _model, _uneven
from macromicro.commission._exciting import Stroke, excite
from macromicro.commission._probing import Direction, Ends
from macromicro.commission.stand import Caution, CommissionError, Record, Stand
from macromicro.identify.axis import Axis, simulate

FOUND = Direction(1.0, 1.2, 1.2, 0.01, 0.0)
ENDS = Ends(-0.029, 0.069, True)


def strokes(rig: Virtual, effort: float = 6.0, speed: float = 1.0) -> list[Record]:
    on = Stand(session(rig), rig.dt, rig.pitch)
    return excite(on, FOUND, ENDS, Caution(effort, speed), 0.02)


def test_strokes_stay_in_the_window_and_below_the_efforts() -> None:
    rig = Virtual()
    made = strokes(rig)
    assert len(made) == len(_exciting.LEVELS) * _exciting.STROKES
    assert ENDS.low < rig.reached[0] < rig.reached[1] < ENDS.high
    assert rig.reached[1] - rig.reached[0] > 0.03
    assert rig.most <= 1.2 + _exciting.LEVELS[-1] * (6.0 - 1.2) + 1e-12
    for one in made:
        assert one.x[0] == one.x[1] or abs(one.x[1] - one.x[0]) < 1e-4
        assert one.u[-1] == 0.0
    assert {math.copysign(1.0, one.x[-1] - one.x[0]) for one in made} == {1.0, -1.0}


def test_a_stroke_is_braked_with_the_level_until_it_turns() -> None:
    law = Stroke(3.0, 1.0, 0.02, 0.5, np.random.default_rng(0))
    assert law(0.0, 0.0, 0.0) == 0.0
    first = law(0.001, 0.0, 0.0)
    assert first is not None
    assert 1.15 <= first <= 3.0
    assert law(0.01, 0.02, 0.4) == -3.0
    assert law(0.02, 0.021, 0.1) == -3.0
    assert law(0.03, 0.021, 0.0) is None
    fast = Stroke(3.0, 1.0, -0.02, 0.5, np.random.default_rng(0))
    assert fast(0.0, 0.0, 0.0) == 0.0
    assert -3.0 <= fast(0.001, 0.0, 0.0) <= -1.15
    assert fast(0.01, -0.001, -0.51) == 3.0


def test_too_little_effort_is_said() -> None:
    with pytest.raises(CommissionError, match="nothing is left"):
        strokes(Virtual(), effort=1.25)


def test_strokes_that_are_all_too_fast_are_said() -> None:
    with pytest.raises(CommissionError, match="hardly a stroke"):
        strokes(Virtual(Axis(0.001, 0.1, 1.0)), speed=0.02)


def test_the_model_finds_the_axis(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_exciting, "STROKES", 4)
    late = 3
    truth = PLAIN._replace(offset=0.1, lag=late * 1e-3)
    rig = Virtual(truth, late=late, ripple=0.05)
    found = _model.fitted(strokes(rig), 1e-3, 1.2, 0.04)
    for name in ("mass", "viscous", "coulomb", "offset"):
        error = getattr(found.axis, name) - getattr(truth, name)
        assert abs(error) <= 1.2 * found.half_width(name), name
    # A fourth of lag Fv is added for an inductance that nobody knows; here there is none.
    added = 0.25 * found.axis.lag * found.axis.viscous
    assert found.axis.mass - added == pytest.approx(0.1, rel=0.06)
    assert found.half_width("mass") > 2.0 * added
    # Nothing tells a constant force from the rounding of the D/A.
    assert found.half_width("offset") > 0.0014 * found.axis.coulomb
    assert found.axis.lag == pytest.approx(truth.lag, abs=2e-4)
    assert math.isinf(found.axis.limit)
    # The friction along the way, as far as hats of a twentieth of the travel can follow it.
    places = found.level.places[2:-2]
    level = found.level.levels[2:-2] + found.axis.coulomb
    felt = 1.0 + 0.05 * np.sin(places / 0.004)
    assert np.corrcoef(level, felt)[0, 1] > 0.9


@pytest.mark.slow
def test_a_drop_of_friction_is_found_though_none_is_the_nearer_beginning() -> None:
    # Sliding slowly and sliding at speed take nearly the same effort beside so much back-EMF.
    truth = Axis(0.487, 15.0, 0.767, stribeck=0.097, stribeck_speed=0.0274, lag=1e-3)
    on = Stand(session(rig := Virtual(truth, late=1)), 1e-3, 1e-5)
    ways = Direction(1.0, 0.864, 0.864, 0.01, 0.0)
    found = _model.fitted(excite(on, ways, ENDS, Caution(8.0, 0.5), 0.02), rig.dt, 0.864, 0.0086)
    assert found.axis.coulomb == pytest.approx(truth.coulomb, rel=0.018)
    assert found.axis.lag == pytest.approx(truth.lag, abs=2e-4)  # without the drop: none
    assert found.rms < 2e-5


def test_a_limit_of_the_force_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """And how much of the slope is friction, at any speed, and not back-EMF."""
    monkeypatch.setattr(_exciting, "STROKES", 4)
    back = 0.2
    rig = Virtual(PLAIN._replace(limit=2.5, back=back))
    found = _model.fitted(strokes(rig), 1e-3, 1.2, 0.012)
    assert found.axis.limit == pytest.approx(2.5, rel=0.03)
    assert found.axis.mass == pytest.approx(0.1, rel=0.03)
    assert found.axis.back == pytest.approx(back, abs=0.1)
    assert abs(found.axis.viscous - PLAIN.viscous) < found.half_width("viscous")
    assert found.axis.lag == pytest.approx(0.0, abs=2e-4)


def test_strokes_that_are_longer_pile_up_no_more_samples() -> None:
    long = Record(np.arange(1000.0), np.zeros(1000), np.zeros(1000))
    rows = _uneven.taken(long)
    assert rows[0] == 0
    assert rows[-1] == 999
    assert len(rows) == 150
    assert _uneven.taken(Record(long.t[:9], long.u[:9], long.x[:9])).tolist() == list(range(9))


def test_another_beginning_costs_nothing() -> None:
    """The basis spans a shift and the way of another speed at the start."""
    axis = Axis(0.1, 5.0)
    t = np.arange(200) * 1e-3
    q = _uneven._beginning(t, axis)
    for gone in (np.ones(200), -np.expm1(-50.0 * t) / 50.0):
        assert gone - q @ (q.T @ gone) == pytest.approx(np.zeros(200), abs=1e-12)
    other = t**2
    assert np.linalg.norm(other - q @ (q.T @ other)) > 0.05 * np.linalg.norm(other)
    free = _uneven._beginning(t, Axis(0.1, 0.0))
    assert t - free @ (free.T @ t) == pytest.approx(np.zeros(200), abs=1e-12)


def test_friction_along_the_travel_is_felt_where_it_is() -> None:
    """Without levels the free run is that of `identify.axis`; with one, slower there alone."""
    t = np.arange(300) * 1e-3
    u = np.full(300, 2.0)
    one = Record(t, u, simulate(PLAIN, u, 1e-3))
    flat = _uneven.Level(np.linspace(0.0, 0.06, 20), np.zeros(20))
    assert _uneven.missed([one], PLAIN, flat, 1e-3)[0] == pytest.approx(np.zeros(300), abs=1e-12)
    late = flat._replace(levels=np.where(flat.places > 0.03, 0.2, 0.0))
    gone = _uneven.missed([one], PLAIN, late, 1e-3)[0]
    assert gone[one.x < 0.026] == pytest.approx(0.0, abs=1e-12)
    assert gone[-1] > 1e-4


def test_a_few_strokes_that_nothing_explains_do_not_hide_what_the_others_show() -> None:
    t = np.sin(np.arange(100.0))
    plain = [1e-3 * t, *(1e-5 * t for _ in range(9))]
    better = [1e-3 * t, *(1e-7 * t for _ in range(9))]
    assert _model._left(plain, plain) == pytest.approx(1.0)
    assert _model._left(better, plain) == pytest.approx(100.0**-0.9)
    # All together count as well: here one stroke has all the errors.
    assert _model._left([1e-4 * t, *plain[1:]], plain) == pytest.approx(0.1, rel=0.06)
    assert _model._left([np.zeros(9)], [np.zeros(9)]) == 1.0


def test_an_axis_is_held_by_what_was_measured() -> None:
    # A constant force is not part of what both directions take in the mean.
    for offset in (0.0, -0.1, 0.3):
        found = _uneven.held(PLAIN._replace(offset=offset), 1.5)
        assert found.stribeck == pytest.approx(0.5)
    assert _uneven.held(PLAIN, 0.5).stribeck == 0.0


def test_a_half_width_is_the_quantile_of_student_s_t() -> None:
    flat = _uneven.Level(np.array([0.0, 1.0]), np.zeros(2))
    found = _model.Model(PLAIN, flat, ("mass",), np.array([[4.0]]), 5, 0.0)
    assert found.half_width("mass") == pytest.approx(2.0 * 2.5706, rel=1e-4)
