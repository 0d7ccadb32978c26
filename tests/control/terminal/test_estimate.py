"""The estimator: counts narrow it as a cut-off Gaussian, and a wrong model is noticed."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.control.terminal import estimate, model
from macromicro.control.terminal.estimate import Belief, Spread
from macromicro.control.terminal.model import Motion, Terminal

P = Terminal()
DT = 1e-3


def moving(x=0.0, v=0.2, xx=1e-10, xv=0.0, vv=1e-6):
    return Belief(Motion(x, v, 0.0, 0.0), 0.0, Spread(xx, xv, 0.0, vv, 0.0, 0.01))


def test_at_rest_the_place_is_the_middle_of_the_count_as_even_as_a_count_is():
    b = estimate.standing(P, 7.0 * P.pitch, 0.1)
    assert b.motion == Motion(7.5 * P.pitch, 0.0, 0.0, 0.0)
    assert b.excess == 0.1
    assert b.spread.xx == pytest.approx(P.pitch**2 / 12.0)
    assert b.spread.vv == 0.0


@given(st.floats(-3.0, 3.0), st.floats(0.05, 3.0))
def test_a_count_cuts_the_gaussian_at_its_edges(mean, deviation):
    """Against 200,000 points of the Gaussian between the edges."""
    width = P.pitch
    b = moving(x=mean * width, xx=(deviation * width) ** 2)
    x = np.linspace(0.0, width, 20_001)
    p = np.exp(-0.5 * ((x / width - mean) / deviation) ** 2)
    inside = p.mean() / deviation / math.sqrt(2.0 * math.pi)
    if inside < 1e-4:
        return
    m = float((p * x).sum() / p.sum())
    var = float((p * (x - m) ** 2).sum() / p.sum())
    found = estimate.seen(P, b, 0.0)
    assert found.motion.x == pytest.approx(m, abs=2e-3 * width)
    assert found.spread.xx == pytest.approx(var, abs=2e-3 * width**2)


def test_speed_and_friction_follow_the_place_by_their_covariance():
    c = Spread(1e-9, 2e-8, -3e-6, 1e-6, -1e-4, 0.04)
    b = Belief(Motion(-0.2 * P.pitch, 0.2, 0.0, 0.0), 0.05, c)
    found = estimate.seen(P, b, 0.0)
    off = found.motion.x - b.motion.x
    assert off > 0.0
    assert found.motion.v - 0.2 == pytest.approx(c.xv / c.xx * off)
    assert found.excess - 0.05 == pytest.approx(c.xf / c.xx * off)
    less = c.xx - found.spread.xx
    assert found.spread.vv == pytest.approx(c.vv - (c.xv / c.xx) ** 2 * less)
    assert found.spread.ff == pytest.approx(c.ff - (c.xf / c.xx) ** 2 * less)
    assert found.spread.xv == pytest.approx(c.xv - c.xv / c.xx * less)
    assert found.spread.xf == pytest.approx(c.xf - c.xf / c.xx * less)
    assert found.spread.vf == pytest.approx(c.vf - c.xv * c.xf / c.xx**2 * less)
    assert found.motion.s == pytest.approx(-(found.motion.v - 0.2))


def test_a_carriage_that_moves_where_it_was_taken_to_stand_is_believed():
    b = estimate.standing(P, 0.0, 0.3)._replace(spread=Spread(1e-14, 0.0, 0.0, 0.0, 0.0, 1e-6))
    found = estimate.seen(P, b, 3.0 * P.pitch)
    assert 3.0 * P.pitch < found.motion.x < 4.0 * P.pitch
    assert found.motion.v > 0.0
    assert found.spread.vv > 0.0
    assert found.spread.ff >= estimate.FIRST**2
    back = estimate.seen(P, b, -3.0 * P.pitch)
    assert back.motion.v == -found.motion.v
    assert -3.0 * P.pitch < back.motion.x < -2.0 * P.pitch


def test_friction_is_never_believed_beyond_half_of_what_is_known():
    c = Spread(1e-9, 0.0, -1e-3, 1e-6, 0.0, 1e4)
    for reading in (-P.pitch, 0.0):
        found = estimate.seen(P, Belief(Motion(0.0, 0.2, 0.0, 0.0), 0.0, c), reading)
        assert abs(found.excess) == pytest.approx(0.5 * P.coulomb)


def test_the_covariance_goes_with_the_models_own_derivatives():
    """Against differences of the model: what a little more speed or friction does in a period."""
    c = Spread(1e-10, 1e-9, 1e-7, 1e-6, 1e-5, 0.02)
    b = Belief(Motion(0.0, 0.2, 0.0, 0.0), 0.05, c)
    p = P._replace(share=0.0, frequency=0.0, breakaway=0.0)
    found = estimate.later(p, b, 4.0, DT)

    def end(dx, dv, df):
        m = model.moved(p, Motion(dx, 0.2 + dv, 0.0, 0.0), 0.05 + df, 4.0, DT)
        return np.array([m.x, m.v, 0.05 + df])

    h = 1e-6
    f = np.stack([(end(*(h * np.eye(3)[k])) - end(0, 0, 0)) / h for k in range(3)]).T
    whole = np.array([[c.xx, c.xv, c.xf], [c.xv, c.vv, c.vf], [c.xf, c.vf, c.ff]])
    wanted = f @ whole @ f.T
    loose = (p.push * (1.0 - math.exp(-p.drag * DT)) / p.drag * p.unknown) ** 2
    assert found.spread.vv == pytest.approx(wanted[1, 1] + loose, rel=1e-3)
    assert found.spread.ff == pytest.approx(wanted[2, 2] + p.wander**2 * DT / 0.01, rel=1e-6)
    assert found.spread.xf == pytest.approx(wanted[0, 2], rel=2e-2)
    assert found.spread.vf == pytest.approx(wanted[1, 2], rel=1e-3)
    assert found.spread.xv == pytest.approx(wanted[0, 1], rel=5e-2)
    assert found.spread.xx == pytest.approx(wanted[0, 0], rel=5e-2)


def test_at_rest_speed_is_known_and_place_and_friction_stay_as_they_are():
    b = Belief(Motion(0.0, 0.0, 0.0, 0.0), 0.1, Spread(1e-10, 1e-9, 1e-8, 1e-6, 1e-7, 0.01))
    found = estimate.later(P, b, 0.0, DT)
    assert found.spread == Spread(1e-10, 0.0, 1e-8, 0.0, 0.0, 0.01)
    assert found.motion.x == 0.0


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_from_counts_alone_speed_and_friction_of_a_stroke_are_found(way):
    """The model with 0.2 V more friction is driven; the estimator sees its counts."""
    m, b, excess = Motion(0.5 * P.pitch, 0.0, 0.0, 0.0), estimate.standing(P, 0.0, 0.0), 0.2
    for _ in range(150):
        m = model.moved(P, m, excess, way * 5.0, DT)
        b = estimate.later(P, b, way * 5.0, DT)
        b = estimate.seen(P, b, math.floor(m.x / P.pitch) * P.pitch)
    assert b.motion.v == pytest.approx(m.v, rel=0.01)
    assert b.motion.x == pytest.approx(m.x, abs=0.5 * P.pitch)
    assert b.excess == pytest.approx(excess, abs=0.05)
    assert b.spread.ff < estimate.FIRST**2
