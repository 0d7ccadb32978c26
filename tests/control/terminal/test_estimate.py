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


NONE = (0.0,) * 6  # of the swing is known to go with place, speed and friction


def spread(*rigid, swing=NONE):
    return Spread(*rigid, *swing)


def moving(x=0.0, v=0.2, xx=1e-10, xv=0.0, vv=1e-6):
    return Belief(Motion(x, v, 0.0, 0.0), 0.0, spread(xx, xv, 0.0, vv, 0.0, 0.01))


def test_at_rest_the_place_is_the_middle_of_the_count_as_even_as_a_count_is():
    b = estimate.standing(P, 7.0 * P.pitch, 0.1)
    assert b.motion == Motion(7.5 * P.pitch, 0.0, 0.0, 0.0)
    assert b.excess == 0.1
    assert b.spread == spread(
        pytest.approx(P.pitch**2 / 12.0), 0.0, 0.0, 0.0, 0.0, pytest.approx(0.01)
    )


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
    c = spread(1e-9, 2e-8, -3e-6, 1e-6, -1e-4, 0.04)
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
    assert found.motion.q == found.motion.s == 0.0  # of which nothing goes with the place


def test_the_swing_follows_the_place_by_its_covariance():
    c = spread(1e-9, 2e-8, -3e-6, 1e-6, -1e-4, 0.04, swing=(3e-9, 4e-8, 5e-6, -6e-7, -7e-6, 8e-4))
    b = Belief(Motion(-0.2 * P.pitch, 0.2, 1e-5, 2e-3), 0.05, c)
    found = estimate.seen(P, b, 0.0)
    off, less, n = found.motion.x - b.motion.x, c.xx - found.spread.xx, found.spread
    assert found.motion.q - 1e-5 == pytest.approx(3.0 * off)
    assert found.motion.s - 2e-3 == pytest.approx(-600.0 * off)
    for had, gain, has in ((c[6:9], 3.0, n[6:9]), (c[9:], -600.0, n[9:])):
        told = (1.0, c.xv / c.xx, c.xf / c.xx)
        wanted = [h - gain * g * less for h, g in zip(had, told, strict=True)]
        assert has == pytest.approx(wanted)


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("v", [0.0, 0.3])
def test_a_count_that_the_belief_rules_out_corrects_the_place_and_loosens_the_rest(
    way: float, v: float
) -> None:
    """Just behind the nearer edge; a carriage that was taken to stand moves a little."""
    c = spread(1e-14, 1e-9, 1e-9, 1e-4, 1e-9, 1e-6, swing=(1e-9, 2e-7, 1e-6, 1e-8, -3e-7, 1e-5))
    b = Belief(Motion(0.5 * P.pitch, v, 1e-4, 0.02), 0.3, c)
    reading = 3.0 * way * P.pitch
    found = estimate.seen(P, b, reading)
    edge = reading + (0.05 if way > 0.0 else 0.95) * P.pitch
    assert found.motion.x == pytest.approx(edge)
    speed = v or way * 5e-3
    assert found.motion == Motion(found.motion.x, speed, 1e-4, pytest.approx(0.02 - (speed - v)))
    assert found.excess == 0.3
    more = 0.05**2  # the unknown speed has shaken the swing
    assert found.spread == pytest.approx(
        spread(
            *(0.01 * P.pitch**2, 0.0, 0.0, 1e-4 + more, 0.0, 0.01),
            swing=(0.0, 2e-7, 0.0, 0.0, -3e-7 - more, 0.0),
        )
    )
    known = estimate.seen(P, b._replace(spread=c._replace(ff=0.2)), reading)
    assert known.spread.ff == 0.2


def test_a_speed_is_not_turned_round_by_a_count_but_one_at_rest_may_begin() -> None:
    c = spread(1e-9, 1e-6, 0.0, 2e-3, 0.0, 0.01)
    back = Belief(Motion(0.9 * P.pitch, 0.001, 0.0, 0.01), 0.0, c)
    found = estimate.seen(P, back, -0.5 * P.pitch)
    assert found.motion.x < back.motion.x
    assert found.motion.v == 0.0
    assert found.motion.s == 0.01
    rest = Belief(Motion(0.9 * P.pitch, 0.0, 0.0, 0.0), 0.0, c)
    begun = estimate.seen(P, rest, -0.5 * P.pitch)
    assert begun.motion.v == pytest.approx(1e3 * (begun.motion.x - rest.motion.x))
    assert begun.motion.v < 0.0


def test_friction_is_never_believed_beyond_half_of_what_is_known():
    c = spread(1e-9, 0.0, -1e-3, 1e-6, 0.0, 1e4)
    for reading in (-P.pitch, 0.0):
        found = estimate.seen(P, Belief(Motion(0.0, 0.2, 0.0, 0.0), 0.0, c), reading)
        assert abs(found.excess) == pytest.approx(0.5 * P.coulomb)


ROOT = st.lists(st.floats(-1.0, 1.0), min_size=15, max_size=15)
NAMES = ("x", "v", "f", "q", "s")
SCALES = np.diag([1e-5, 1e-2, 1e-1, 1e-5, 1e-3])


@given(ROOT, st.sampled_from([1.0, -1.0]), st.booleans())
def test_the_covariance_goes_through_the_models_transition(parts, way, swings):
    """F P F' with F from all five to those of a period later, and the noise of speed and friction.

    What the swing does to the carriage is left out, as its share of the mass is small.
    """
    p = P if swings else P._replace(frequency=0.0)
    root = np.eye(5)
    root[np.tril_indices(5)] += parts
    root = SCALES @ root
    whole = root @ root.T

    def told(i):
        return NAMES.index(i[0]), NAMES.index(i[1])

    c = Spread(*(float(whole[told(name)]) for name in Spread._fields))
    found = estimate.later(p, Belief(Motion(0.0, 0.2 * way, 0.0, 0.0), 0.05, c), 4.0 * way, DT)
    fall = math.exp(-p.drag * DT)
    gain = -way * p.push * (1.0 - fall) / p.drag
    step = np.eye(5)
    step[0, 1:3] = DT, 0.5 * DT * gain
    step[1, 1:3] = fall, gain
    noise = np.array([0.0, 1.0, 0.0, 0.0, 0.0])
    for column in range(5):  # of the model: what one more of each leaves of the swing
        unit = np.eye(5)[column]
        kick = (fall - 1.0) * unit[1] + gain * unit[2]
        step[3:, column] = model.swung(p, unit[3], unit[4], kick, DT)
    noise[3:] = model.swung(p, 0.0, 0.0, 1.0, DT)
    wanted = step @ whole @ step.T + np.outer(noise, noise) * (gain * p.unknown * p.wary) ** 2
    wanted[2, 2] += p.wander**2 * DT / 0.01
    for name, value in found.spread._asdict().items():
        i, j = told(name)
        expected = float(wanted[i, j]) if swings or i < 3 else 0.0
        assert value == pytest.approx(expected, rel=1e-9, abs=1e-10 * SCALES[i, i] * SCALES[j, j])


def test_the_transition_is_that_of_the_model():
    """Against differences of the model: what a little more speed or friction does in a period."""
    p = P._replace(share=0.0, frequency=0.0, breakaway=0.0)
    fall = math.exp(-p.drag * DT)
    gain = -p.push * (1.0 - fall) / p.drag

    def end(dv, df):
        return model.moved(p, Motion(0.0, 0.2 + dv, 0.0, 0.0), 0.05 + df, 4.0, DT)

    h, here = 1e-6, end(0.0, 0.0)
    assert (end(h, 0.0).v - here.v) / h == pytest.approx(fall, rel=1e-4)
    assert (end(0.0, h).v - here.v) / h == pytest.approx(gain, rel=1e-4)
    assert (end(h, 0.0).x - here.x) / h == pytest.approx(DT, rel=0.05)
    assert (end(0.0, h).x - here.x) / h == pytest.approx(0.5 * DT * gain, rel=1e-4)


def test_at_rest_speed_is_known_and_place_and_friction_stay_as_they_are():
    b = Belief(Motion(0.0, 0.0, 0.0, 0.0), 0.1, spread(1e-10, 1e-9, 1e-8, 1e-6, 1e-7, 0.01))
    found = estimate.later(P, b, 0.0, DT)
    assert found.spread == spread(1e-10, 0.0, 1e-8, 0.0, 0.0, 0.01)
    assert found.motion.x == 0.0


def test_at_rest_the_swing_goes_on_and_what_goes_with_it_turns():
    has = (1e-9, 2e-7, 3e-6, 4e-8, 5e-6, 6e-4)
    b = Belief(
        Motion(0.0, 0.0, 0.0, 0.0), 0.1, spread(1e-10, 1e-9, 1e-8, 1e-6, 1e-7, 0.01, swing=has)
    )
    found = estimate.later(P, b, 0.0, DT).spread
    for k, told in ((0, (found.qx, found.sx)), (2, (found.qf, found.sf))):
        assert told == pytest.approx(model.swung(P, has[k], has[3 + k], 0.0, DT))
    assert found.qv == found.sv == 0.0


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
    # What the friction did to the swing is found with it; without covariances 41 um are left.
    w = 2.0 * math.pi * P.frequency
    assert math.hypot(b.motion.q - m.q, (b.motion.s - m.s) / w) < 20e-6
