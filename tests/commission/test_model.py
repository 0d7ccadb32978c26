"""Strokes, and the model that explains them, on an axis that is known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.commission.axes import PLAIN, Virtual, session

from macromicro.commission import exciting, model
from macromicro.commission.exciting import Stroke, excite
from macromicro.commission.probing import CommissionError, Direction, Ends
from macromicro.commission.stand import Caution, Record, Stand
from macromicro.identify.axis import Axis, simulate

FOUND = Direction(1.0, 1.2, 1.2, 0.01, 0.0)
ENDS = Ends(-0.029, 0.069, True)


def strokes(rig: Virtual, effort: float = 6.0, speed: float = 1.0) -> list[Record]:
    on = Stand(session(rig), rig.dt, rig.pitch)
    return excite(on, FOUND, ENDS, Caution(effort, speed), 0.02)


def test_strokes_stay_in_the_window_and_below_the_efforts() -> None:
    rig = Virtual()
    made = strokes(rig)
    assert len(made) == len(exciting.LEVELS) * exciting.STROKES
    assert ENDS.low < rig.reached[0] < rig.reached[1] < ENDS.high
    assert rig.reached[1] - rig.reached[0] > 0.03
    assert rig.most <= 1.2 + exciting.LEVELS[-1] * (6.0 - 1.2) + 1e-12
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


@pytest.mark.parametrize("late", [0, 3])
def test_the_model_finds_the_axis(late: int) -> None:
    truth = PLAIN._replace(offset=0.1, lag=late * 1e-3)
    rig = Virtual(truth, late=late, ripple=0.02)
    found = model.fitted(strokes(rig), 1e-3, 1.2)
    for name in found.names:
        error = getattr(found.axis, name) - getattr(truth, name)
        assert abs(error) <= 1.2 * found.half_width(name), name
    assert found.axis.mass == pytest.approx(0.1, rel=0.05)
    assert found.axis.viscous == pytest.approx(5.0, rel=0.05)
    assert found.axis.lag == pytest.approx(truth.lag, abs=1e-3)


def test_the_momentum_s_balance_is_exact_without_friction_at_rest() -> None:
    axis = Axis(0.2, 3.0, 0.5, 0.1)
    t = np.arange(400) * 1e-3
    made = []
    for way in (1.0, -1.0):
        u = way * (2.0 + np.sin(40.0 * t))
        made.append(Record(t, u, simulate(axis, u, 1e-3)))
    start = model.begun(made, 1e-3)
    for name in ("mass", "viscous", "coulomb", "offset"):
        assert getattr(start, name) == pytest.approx(getattr(axis, name), rel=0.02), name


def test_strokes_one_way_do_not_tell_friction_from_a_weight() -> None:
    t = np.arange(300) * 1e-3
    u = 2.0 + np.sin(40.0 * t)
    made = [Record(t, u, simulate(Axis(0.2, 3.0, 0.5), u, 1e-3))] * 4
    with pytest.raises(CommissionError, match="both directions"):
        model.begun(made, 1e-3)


def test_the_sandwich_is_the_covariance_of_independent_strokes() -> None:
    """Against the spread of least squares over simulated clusters with a common error each."""
    random = np.random.default_rng(3)
    design = [random.standard_normal((20, 2)) for _ in range(12)]
    table = np.concatenate(design)
    found, told = [], []
    for _ in range(2000):
        missed = [
            random.standard_normal(20) * 0.3 + d @ random.standard_normal(2) * 0.5 for d in design
        ]
        theta, *_ = np.linalg.lstsq(table, np.concatenate(missed), rcond=None)
        rest = [e - d @ theta for d, e in zip(design, missed, strict=True)]
        found.append(theta)
        told.append(model._sandwich(table, rest))
    spread, mean = np.cov(np.array(found).T), np.mean(told, axis=0)
    assert np.diag(mean) == pytest.approx(np.diag(spread), rel=0.15)


def test_a_half_width_is_the_quantile_of_student_s_t() -> None:
    found = model.Model(PLAIN, ("mass",), np.array([[4.0]]), 5, 0.0)
    assert found.half_width("mass") == pytest.approx(2.0 * 2.5706, rel=1e-4)
