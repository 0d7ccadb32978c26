"""A mass on a spring behind a dead zone: exact cases, laws, interpreted against compiled."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from macromicro.arrays import Array
from macromicro.identify import sprung
from macromicro.identify.axis import Axis
from macromicro.identify.axis import simulate as slid
from macromicro.identify.sprung import Sprung, passed, simulate, slide, step
from macromicro.kernel import compiled

drives = st.builds(
    Sprung,
    mass=st.floats(0.5, 5.0),
    viscous=st.floats(4.0, 80.0),
    coulomb=st.floats(0.0, 5.0),
    offset=st.floats(-3.0, 3.0),
    asymmetry=st.floats(-4.0, 4.0),
    spring=st.just(0.0) | st.floats(0.1, 2000.0),
    dead_zone=st.floats(0.0, 5.0),
)
forces = st.lists(st.floats(-30.0, 30.0), min_size=3, max_size=40)


@pytest.mark.parametrize("spring", [0.0, 1e-3, 3.0, 12.5, 400.0])  # 12.5: critically damped
@pytest.mark.parametrize("viscous", [0.0, 10.0])
@pytest.mark.parametrize("h", [1e-6, 1e-3, 0.3])
def test_sliding_is_the_matrix_exponential(spring: float, viscous: float, h: float) -> None:
    """M x'' = pull - k x - c x', Meirovitch section 2.3, over any time and damping."""
    p = Sprung(mass=2.0, viscous=viscous, spring=spring)
    x, v, pull = 0.2, -0.7, 3.0
    flow = np.array([[0.0, 1.0, 0.0], [-spring / 2.0, -viscous / 2.0, pull / 2.0], [0.0] * 3])
    want = expm(flow * h) @ np.array([x, v, 1.0])
    np.testing.assert_allclose(slide(p, x, v, pull, h), want[:2], rtol=1e-9, atol=1e-12)


def test_a_dead_zone_swallows_small_forces_of_both_signs() -> None:
    p = Sprung(mass=1.0, viscous=1.0, dead_zone=2.0)
    assert [passed(p, f) for f in (-5.0, -2.0, -1.0, 1.5, 2.0, 5.0)] == [
        -3.0,
        0.0,
        0.0,
        0.0,
        0.0,
        3.0,
    ]


def test_every_half_swing_loses_two_coulomb_levels() -> None:
    """Meirovitch section 2.4: under dry friction alone the turning points fall by 2 Fc/k."""
    p = Sprung(mass=1.0, viscous=0.0, coulomb=0.5, spring=100.0)
    x, v = simulate(p, np.zeros(20000), 1e-3, x=0.1)
    turns = np.abs(x[np.flatnonzero(np.diff(np.sign(v)) != 0)])
    # It starts at 100 mm and turns at 90, 80, ... 10 mm; at 0 to 5 mm friction holds. Within
    # half a sample of a turn it is farther by 10 m/s^2 (0.5 ms)^2 / 2 at most.
    np.testing.assert_allclose(turns[1:9], np.arange(0.09, 0.015, -0.01), atol=5e-6)
    assert np.ptp(x[-1000:]) == 0.0 and abs(x[-1]) <= 0.005


def test_at_rest_friction_holds_up_to_its_level_beyond_the_spring() -> None:
    p = Sprung(mass=1.0, viscous=1.0, coulomb=2.0, offset=0.5, spring=10.0, dead_zone=1.0)
    at = 0.1  # pulls by 1 N; with the offset 1.5 N, and the drive's dead zone of 1 N
    assert step(p, at, 0.0, 4.49, 1e-3) == (at, 0.0)  # 4.49 - 1 - 1.5 = 1.99
    assert step(p, at, 0.0, 4.51, 1e-3)[1] > 0.0
    assert step(p, at, 0.0, -1.49, 1e-3) == (at, 0.0)  # -0.49 - 1.5 = -1.99
    assert step(p, at, 0.0, -1.51, 1e-3)[1] < 0.0


def test_asymmetry_brakes_forwards_more_than_backwards() -> None:
    p = Sprung(mass=1.0, viscous=5.0, asymmetry=2.0)
    assert step(p, 0.0, 1.0, 0.0, 0.1)[1] == pytest.approx(math.exp(-0.7))
    assert step(p, 0.0, -1.0, 0.0, 0.1)[1] == pytest.approx(-math.exp(-0.3))


@settings(max_examples=60, deadline=None)
@given(p=drives, force=forces, x=st.floats(-0.1, 0.1), v=st.floats(-1.0, 1.0))
def test_interpreted_is_compiled(p: Sprung, force: list[float], x: float, v: float) -> None:
    out = np.empty((2, len(force)))
    sprung.free_run(p, np.array(force), x, v, 0.01, out)
    again = np.empty_like(out)
    compiled(sprung.free_run)(p, np.array(force), x, v, 0.01, again)
    np.testing.assert_allclose(again, out, rtol=1e-9, atol=1e-12)


@settings(max_examples=60, deadline=None)
@given(p=drives, force=forces, v=st.floats(-1.0, 1.0))
def test_half_a_step_twice_is_one(p: Sprung, force: list[float], v: float) -> None:
    """A step is exact, so how time is cut does not matter, reversals or not."""
    whole = simulate(p, force, 0.02, v=v)
    halves = simulate(p, np.repeat(force, 2), 0.01, v=v)
    np.testing.assert_allclose(halves[0][::2], whole[0], rtol=1e-6, atol=1e-7)


def energy(p: Sprung, x: Array, v: Array) -> Array:
    return np.asarray(0.5 * p.mass * v**2 + 0.5 * p.spring * x**2 + p.offset * x)


@settings(max_examples=60, deadline=None)
@given(p=drives, x=st.floats(-0.1, 0.1), v=st.floats(-1.0, 1.0))
def test_a_free_motion_gains_no_energy(p: Sprung, x: float, v: float) -> None:
    e = energy(p, *simulate(p, np.zeros(400), 0.01, x, v))
    assert (np.diff(e) <= 1e-9 * (1.0 + np.abs(e).max())).all()


@settings(max_examples=30, deadline=None)
@given(p=drives, force=forces, v=st.floats(-1.0, 1.0))
def test_without_spring_and_dead_zone_it_is_the_axis(
    p: Sprung, force: list[float], v: float
) -> None:
    bare = p._replace(spring=0.0, dead_zone=0.0)
    axis = Axis(p.mass, p.viscous, p.coulomb, p.offset, p.asymmetry)
    finer = np.repeat(force, 10)  # `axis.step` takes the mean of two speeds for the distance
    np.testing.assert_allclose(
        simulate(bare, finer, 1e-3, v=v)[0], slid(axis, finer, 1e-3, v=v), rtol=1e-3, atol=3e-5
    )


def test_a_late_force_acts_later() -> None:
    p = Sprung(mass=1.0, viscous=1.0)
    force = np.array([0.0, 1.0, 1.0, 1.0, 1.0, 1.0])
    np.testing.assert_allclose(
        simulate(p, force, 0.1, lag=0.2)[0][2:], simulate(p, force, 0.1)[0][:-2], atol=1e-15
    )


def test_frequency_and_damping() -> None:
    p = Sprung(mass=2.0, viscous=4.0, spring=200.0)
    assert p.frequency == pytest.approx(10.0 / (2.0 * math.pi))
    assert p.damping == pytest.approx(0.1)
    assert math.isnan(Sprung(1.0, 1.0).damping) and Sprung(1.0, 1.0).frequency == 0.0
