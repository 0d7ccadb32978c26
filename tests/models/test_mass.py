"""A mass under a force: exact cases, laws, interpreted against compiled."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from macromicro.arrays import Array
from macromicro.kernel import compiled
from macromicro.models import mass as model
from macromicro.models.mass import Axis, glide, late, motion, simulate, slide, swing
from macromicro.models.mass import given as drive_force

forces = st.lists(st.floats(-60.0, 60.0), min_size=5, max_size=60)
axes = st.builds(
    Axis,
    mass=st.floats(0.5, 50.0),
    viscous=st.floats(5.0, 100.0),
    coulomb=st.floats(0.0, 20.0),
    offset=st.floats(-3.0, 3.0),
    asymmetry=st.floats(-4.0, 4.0),
    stribeck=st.floats(0.0, 10.0),
    stribeck_speed=st.floats(0.01, 1.0),
    lag=st.just(0.0),  # `simulate` shifts the force, `free_run` takes it as it comes
    limit=st.floats(5.0, 100.0) | st.just(math.inf),
    back=st.floats(0.0, 1.0),
    sine=st.just(0.0) | st.floats(-5.0, 5.0),
    cosine=st.just(0.0) | st.floats(-5.0, 5.0),
    spring=st.just(0.0) | st.floats(0.1, 2000.0),
    dead_zone=st.floats(0.0, 5.0),
)


@pytest.mark.parametrize("h", [2e-5, 1e-3, 0.3])
def test_sliding_under_a_held_force_is_exact(h: float) -> None:
    """v = (F - Fc - F0) / Fv (1 - exp(-Fv t / M)), the solution by hand, however long a step."""
    p = Axis(mass=2.0, viscous=5.0, coulomb=3.0, offset=1.0)
    t = np.arange(2000) * h
    x = simulate(p, np.full(2000, 10.0), h)
    top, tau = 6.0 / 5.0, 2.0 / 5.0
    wanted = top * (t - tau * (1.0 - np.exp(-t / tau)))
    np.testing.assert_allclose(x, wanted, rtol=1e-9, atol=1e-13)


@pytest.mark.parametrize("v", [1.0, -1.0])
def test_a_step_that_ends_the_motion_goes_as_far_as_friction_lets_it(v: float) -> None:
    """M v/Fv - M Fc/Fv^2 ln(1 + Fv v/Fc) from a speed v, in one step or many."""
    p = Axis(mass=2.0, viscous=5.0, coulomb=3.0)
    far = 2.0 / 5.0 - 2.0 * 3.0 / 25.0 * math.log(1.0 + 5.0 / 3.0)
    speed, moved = glide(p, v, 0.0, 1.0)
    assert speed == 0.0
    assert moved == pytest.approx(math.copysign(far, v), rel=1e-12)
    # With no viscous friction: M v^2 / 2 Fc.
    assert glide(p._replace(viscous=0.0), v, 0.0, 1.0)[1] == pytest.approx(v / 3.0, rel=1e-12)


def test_coasting_stops_in_finite_time_and_stays() -> None:
    """From v0: stop after M/Fv ln(1 + Fv v0 / Fc); friction then holds any force below it."""
    p = Axis(mass=2.0, viscous=5.0, coulomb=3.0)
    x = simulate(p, np.zeros(1000), 1e-3, v=1.0)
    stop = 2.0 / 5.0 * math.log(1.0 + 5.0 / 3.0)
    moving = np.flatnonzero(np.diff(x) > 0.0)
    assert moving[-1] * 1e-3 == pytest.approx(stop, abs=2e-3)
    assert np.ptp(x[moving[-1] + 1 :]) == 0.0
    assert np.ptp(simulate(p, np.full(500, 2.99), 1e-3)) == 0.0
    assert np.ptp(simulate(p, np.full(500, 3.01), 1e-3)) > 0.0


def test_breakaway_needs_the_stribeck_level() -> None:
    p = Axis(mass=2.0, viscous=5.0, coulomb=3.0, stribeck=1.0, stribeck_speed=0.05)
    assert np.ptp(simulate(p, np.full(500, 3.99), 1e-3)) == 0.0
    moving = simulate(p, np.concatenate([np.full(300, 6.0), np.full(2000, 3.9)]), 1e-3)
    assert moving[-1] - moving[-2] > 0.1e-3  # once it slides, less than the level keeps it going


@settings(max_examples=50, deadline=None)
@given(p=axes, force=forces, v=st.floats(-1.0, 1.0))
def test_interpreted_equals_compiled(p: Axis, force: list[float], v: float) -> None:
    pull = np.repeat(np.array(force), 20)
    plain = np.empty((2, len(pull)))
    model.free_run(p, pull, 0.1, v, 1e-3, plain)
    np.testing.assert_allclose(motion(p, pull, 1e-3, 0.1, v), plain, rtol=1e-9, atol=1e-12)


@settings(max_examples=50, deadline=None)
@given(p=axes, v=st.floats(-2.0, 2.0))
def test_without_force_speed_only_falls(p: Axis, v: float) -> None:
    """Friction takes energy, it never gives any, and never turns the motion round."""
    q = p._replace(offset=0.0)
    for _ in range(200):
        new, _ = glide(q, v, 0.0, 1e-3)
        assert abs(new) <= abs(v)
        assert new * v >= 0.0
        v = new


@settings(max_examples=50, deadline=None)
@given(p=axes, force=forces)
def test_mirror_image(p: Axis, force: list[float]) -> None:
    """Force, offset and asymmetry reversed, the load hung up in a mirror: the motion reversed."""
    pull = np.repeat(np.array(force), 20)
    q = p._replace(offset=-p.offset, asymmetry=-p.asymmetry, cosine=-p.cosine)
    np.testing.assert_allclose(simulate(p, pull, 1e-3), -simulate(q, -pull, 1e-3), atol=1e-12)


def test_an_eccentric_load_swings_as_a_pendulum_does() -> None:
    """About -atan2(B, A), with a period of 2 pi sqrt(J / m g r) (1 + a^2 / 16), and on and on."""
    p = Axis(mass=0.01, viscous=0.0, sine=0.2 * math.cos(0.5), cosine=-0.2 * math.sin(0.5))
    x = simulate(p, np.zeros(20_000), 1e-3, x=0.7) - 0.5
    up = np.flatnonzero((x[:-1] < 0.0) & (x[1:] >= 0.0))
    lasts = (up[-1] - up[0]) * 1e-3 / (len(up) - 1)
    assert lasts == pytest.approx(2.0 * math.pi * math.sqrt(0.05) * (1.0 + 0.2**2 / 16.0), rel=1e-3)
    assert np.abs(x[-2000:]).max() == pytest.approx(0.2, rel=1e-3)


def test_friction_holds_an_eccentric_load_wherever_it_is_pulled_less() -> None:
    p = Axis(mass=0.01, viscous=0.01, coulomb=0.1, sine=0.2)
    held = math.asin(0.5)
    for at in (held - 0.01, -held + 0.01):
        assert np.ptp(simulate(p, np.zeros(500), 1e-3, x=at)) == 0.0
    for at in (held + 0.01, -held - 0.01):
        assert np.ptp(np.abs(simulate(p, np.zeros(500), 1e-3, x=at))) > 1e-4


@settings(max_examples=30, deadline=None)
@given(force=forces)
def test_a_finer_step_changes_nothing(force: list[float]) -> None:
    """Not at all without a Stribeck level, which is taken at the start of each step."""
    p = Axis(mass=5.0, viscous=20.0, coulomb=8.0, offset=1.0)
    pull = np.array(force)
    coarse = simulate(p, pull, 0.1)
    fine = simulate(p, np.repeat(pull, 100), 1e-3)[::100]
    np.testing.assert_allclose(coarse, fine, atol=1e-9)


@pytest.mark.parametrize("v", [0.0, 0.3, -0.3])
def test_a_level_that_falls_within_a_step_is_followed(v: float) -> None:
    """In one step as in a thousand; taken at its start it would be off by 2 % of the change."""
    p = Axis(mass=2.0, viscous=5.0, coulomb=3.0, stribeck=4.0, stribeck_speed=0.2)
    for pull in (9.0, 4.0, -9.0):
        fine = v
        for _ in range(1000):
            fine, _ = glide(p, fine, pull, 1e-5)
        assert glide(p, v, pull, 1e-2)[0] - v == pytest.approx(fine - v, rel=2e-3)


@pytest.mark.parametrize("pull", [0.5, -0.5, 0.29, -0.29])
def test_from_rest_the_axis_moves_the_way_it_is_pulled_beyond_its_friction(pull: float) -> None:
    """However small the force is: here 0.3 N hold it, of 2 kg, for 1 ms."""
    p = Axis(2.0, 1e-9, coulomb=0.2, stribeck=0.1)
    v, moved = glide(p, 0.0, pull, 1e-3)
    wanted = 0.0 if abs(pull) < 0.3 else (pull - math.copysign(0.3, pull)) / 2.0 * 1e-3
    assert v == pytest.approx(wanted, rel=1e-6)
    assert moved == pytest.approx(0.5e-3 * wanted, rel=1e-6)


@pytest.mark.parametrize("viscous", [0.0, 1e-12, 3.0])
def test_in_one_direction_speed_decays_by_the_exponential_of_its_friction(viscous: float) -> None:
    """Without viscous friction it stays, and a force adds h F / M."""
    keep, push, carry = model.decay(Axis(2.0, viscous), 1.0, 0.25)
    assert keep == pytest.approx(math.exp(-viscous * 0.25 / 2.0), rel=1e-9)
    assert push == pytest.approx((1.0 - keep) / viscous if viscous > 1e-9 else 0.125, rel=1e-9)
    slow = (0.25 - 2.0 * push) / viscous if viscous > 1e-9 else 0.25**2 / 4.0
    assert carry == pytest.approx(slow, rel=1e-9)
    ahead, back = (model.decay(Axis(2.0, 3.0, asymmetry=1.0), s, 0.25)[0] for s in (1.0, -1.0))
    assert (ahead, back) == pytest.approx((math.exp(-0.5), math.exp(-0.25)))


def test_the_speed_decays_towards_what_the_force_keeps() -> None:
    """exp(-c h / M) and (1 - that) / c, c with the asymmetry of the direction; without viscous
    friction the speed stays and grows by h / M."""
    p = Axis(mass=2.0, viscous=5.0, asymmetry=1.0)
    for direction, c in ((1.0, 6.0), (-1.0, 4.0)):
        left = math.exp(-c * 0.1 / 2.0)
        assert model.decay(p, direction, 0.1)[:2] == pytest.approx((left, (1.0 - left) / c))
    assert model.decay(Axis(mass=2.0, viscous=0.0), 1.0, 0.5)[:2] == (1.0, 0.25)
    assert model.decay(Axis(mass=2.0, viscous=1.0, asymmetry=1.0), -1.0, 0.5)[:2] == (1.0, 0.25)


@pytest.mark.parametrize("part", [1e-7, 0.999e-4, 1.001e-4, 1e-2])
def test_a_short_step_goes_as_far_as_a_long_one_tells(part: float) -> None:
    """Below 1e-4 of a time constant by a series: M v - M v' = c x - F h holds on both sides."""
    p = Axis(mass=2.0, viscous=5.0)
    h = part * 2.0 / 5.0
    keep, push, carry = model.decay(p, 1.0, h)
    assert 2.0 * (1.0 - keep) == pytest.approx(5.0 * 2.0 * push, rel=1e-11)
    assert carry == pytest.approx(h * h / 2.0 * (0.5 - part / 6.0 + part**2 / 24.0), rel=2e-7)
    assert 2.0 * push == pytest.approx(h - 5.0 * carry, rel=1e-11)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(
    ("v", "pull", "h", "speed", "moved"),
    [
        (1.0, 5.0, 1.0, 3.0, 2.0),  # (5 - 1) / 2 faster in a second
        (0.0, 5.0, 1.0, 2.0, 1.0),
        (0.0, 1.0, 1.0, 0.0, 0.0),  # what friction balances
        # 3 m/s2 for a third of a second to a stand, then 2 m/s2 the other way.
        (1.0, -5.0, 1.0, -4.0 / 3.0, 1.0 / 6.0 - 4.0 / 9.0),
        (1.0, -0.5, 2.0, 0.0, 2.0 / 3.0),  # 0.75 m/s2 to a stand, where friction holds it
        (1.0, -5.0, 1.0 / 3.0, 0.0, 1.0 / 6.0),  # to a stand exactly at the end
    ],
)
def test_a_step_without_viscous_friction_is_a_parabola(
    side: float, v: float, pull: float, h: float, speed: float, moved: float
) -> None:
    """2 kg, 1 N of Coulomb friction."""
    p = Axis(mass=2.0, viscous=0.0, coulomb=1.0)
    found = glide(p, side * v, side * pull, h)
    assert found == pytest.approx((side * speed, side * moved), abs=1e-12)


def test_friction_falls_with_the_speed_from_its_stribeck_level() -> None:
    """Fc + Fs exp(-(v / vs)^2) while it slides, Fc + Fs at rest."""
    p = Axis(mass=2.0, viscous=0.0, coulomb=1.0, stribeck=4.0, stribeck_speed=0.5)
    level = 1.0 + 4.0 * math.exp(-((1.0 / 0.5) ** 2))
    assert glide(p, 1.0, 6.0, 1e-6)[0] == pytest.approx(1.0 + (6.0 - level) * 5e-7, rel=1e-9)
    assert glide(p, 0.0, 6.0, 1e-6)[0] == pytest.approx(5e-7)
    assert glide(p, 0.0, 5.0, 0.1) == (0.0, 0.0)


def test_a_free_run_begins_where_it_is_told_with_the_offset_taken_off() -> None:
    p = Axis(mass=2.0, viscous=0.0, offset=1.0)
    x = simulate(p, np.full(4, 5.0), 0.5, x=7.0, v=-1.0)
    t = 0.5 * np.arange(4)
    np.testing.assert_allclose(x, 7.0 - t + t**2)


def test_a_late_force_acts_parts_of_a_sample_later() -> None:
    force = np.array([1.0, 2.0, 4.0, 8.0])
    assert late(force, 0.0).tolist() == force.tolist()
    assert late(force, 1e12).tolist() == [1.0] * 4
    assert late(force, 1.25).tolist() == [1.0, 1.0, 1.75, 3.5]
    axis = Axis(2.0, 3.0, lag=2.5e-3)
    u = np.sin(np.arange(200) * 0.05)
    prompt = simulate(axis._replace(lag=0.0), late(u, 2.5), 1e-3)
    assert simulate(axis, u, 1e-3).tolist() == prompt.tolist()


def test_a_force_is_limited_less_the_back_emf() -> None:
    """At rest at most `limit`; at a speed v, Fv v more may be asked for."""
    axis = Axis(2.0, 3.0, limit=5.0)
    for back, most in ((1.0, 11.0), (0.5, 8.0), (0.0, 5.0)):
        part = axis._replace(back=back)
        assert drive_force(part, 99.0, 2.0) == most
        assert drive_force(part, -99.0, -2.0) == -most
    free = axis._replace(limit=np.inf)
    push = np.full(500, 9.0)
    x = simulate(axis, push, 1e-3)
    # Limited, the force less friction is 5 N: constant acceleration, until Fv v makes up the rest.
    t = np.arange(500) * 1e-3
    assert x == pytest.approx(0.5 * 2.5 * t**2, rel=0.01, abs=1e-5)
    assert simulate(axis, -push, 1e-3) == pytest.approx(-x)
    assert simulate(axis, 0.5 * push, 1e-3).tolist() == simulate(free, 0.5 * push, 1e-3).tolist()


PLAIN = ("stribeck", "stribeck_speed", "lag", "limit", "back", "sine", "cosine")
swinging = st.builds(
    Axis,
    mass=st.floats(0.5, 5.0),
    viscous=st.floats(4.0, 80.0),
    coulomb=st.floats(0.0, 5.0),
    offset=st.floats(-3.0, 3.0),
    asymmetry=st.floats(-4.0, 4.0),
    spring=st.just(0.0) | st.floats(0.1, 2000.0),
    dead_zone=st.floats(0.0, 5.0),
    **{name: st.just(value) for name, value in Axis._field_defaults.items() if name in PLAIN},
)


@pytest.mark.parametrize("spring", [0.0, 1e-3, 3.0, 12.5, 400.0])  # 12.5: critically damped
@pytest.mark.parametrize("viscous", [0.0, 10.0])
@pytest.mark.parametrize("h", [1e-6, 1e-3, 0.3])
def test_sliding_is_the_matrix_exponential(spring: float, viscous: float, h: float) -> None:
    """M x'' = pull - k x - c x', Meirovitch section 2.3, over any time and damping."""
    p = Axis(mass=2.0, viscous=viscous, spring=spring)
    x, v, pull = 0.2, -0.7, 3.0
    flow = np.array([[0.0, 1.0, 0.0], [-spring / 2.0, -viscous / 2.0, pull / 2.0], [0.0] * 3])
    want = expm(flow * h) @ np.array([x, v, 1.0])
    np.testing.assert_allclose(slide(p, x, v, 1.0, pull, h), want[:2], rtol=1e-9, atol=1e-12)


def test_a_dead_zone_swallows_small_forces_of_both_signs() -> None:
    p = Axis(mass=1.0, viscous=1.0, dead_zone=2.0)
    assert [drive_force(p, f, 0.0) for f in (-5.0, -2.0, -1.0, 1.5, 2.0, 5.0)] == [
        -3.0,
        0.0,
        0.0,
        0.0,
        0.0,
        3.0,
    ]


def test_every_half_swing_loses_two_coulomb_levels() -> None:
    """Meirovitch section 2.4: under dry friction alone the turning points fall by 2 Fc/k."""
    p = Axis(mass=1.0, viscous=0.0, coulomb=0.5, spring=100.0)
    x, v = motion(p, np.zeros(20000), 1e-3, x=0.1)
    turns = np.abs(x[np.flatnonzero(np.diff(np.sign(v)) != 0)])
    # It starts at 100 mm and turns at 90, 80, ... 10 mm; at 0 to 5 mm friction holds. Within
    # half a sample of a turn it is farther by 10 m/s^2 (0.5 ms)^2 / 2 at most.
    np.testing.assert_allclose(turns[1:9], np.arange(0.09, 0.015, -0.01), atol=5e-6)
    assert np.ptp(x[-1000:]) == 0.0 and abs(x[-1]) <= 0.005


def test_at_rest_friction_holds_up_to_its_level_beyond_the_spring() -> None:
    p = Axis(mass=1.0, viscous=1.0, coulomb=2.0, offset=0.5, spring=10.0, dead_zone=1.0)
    at = 0.1  # pulls by 1 N; with the offset 1.5 N, and the drive's dead zone of 1 N
    assert model.step(p, at, 0.0, 4.49, 1e-3) == (at, 0.0)  # 4.49 - 1 - 1.5 = 1.99
    assert model.step(p, at, 0.0, 4.51, 1e-3)[1] > 0.0
    assert model.step(p, at, 0.0, -1.49, 1e-3) == (at, 0.0)  # -0.49 - 1.5 = -1.99
    assert model.step(p, at, 0.0, -1.51, 1e-3)[1] < 0.0


def test_asymmetry_brakes_forwards_more_than_backwards() -> None:
    p = Axis(mass=1.0, viscous=5.0, asymmetry=2.0)
    assert model.step(p, 0.0, 1.0, 0.0, 0.1)[1] == pytest.approx(math.exp(-0.7))
    assert model.step(p, 0.0, -1.0, 0.0, 0.1)[1] == pytest.approx(-math.exp(-0.3))


@settings(max_examples=60, deadline=None)
@given(p=swinging, force=forces, v=st.floats(-1.0, 1.0))
def test_half_a_step_twice_is_one(p: Axis, force: list[float], v: float) -> None:
    """A step is exact, so how time is cut does not matter, reversals or not."""
    whole = motion(p, force, 0.02, v=v)
    halves = motion(p, np.repeat(force, 2), 0.01, v=v)
    np.testing.assert_allclose(halves[0][::2], whole[0], rtol=1e-6, atol=1e-7)


def energy(p: Axis, x: Array, v: Array) -> Array:
    return np.asarray(0.5 * p.mass * v**2 + 0.5 * p.spring * x**2 + p.offset * x)


@settings(max_examples=60, deadline=None)
@given(p=swinging, x=st.floats(-0.1, 0.1), v=st.floats(-1.0, 1.0))
def test_a_free_motion_gains_no_energy(p: Axis, x: float, v: float) -> None:
    e = energy(p, *motion(p, np.zeros(400), 0.01, x, v))
    assert (np.diff(e) <= 1e-9 * (1.0 + np.abs(e).max())).all()


def test_frequency_and_damping() -> None:
    p = Axis(mass=2.0, viscous=4.0, spring=200.0)
    assert p.frequency == pytest.approx(10.0 / (2.0 * math.pi))
    assert p.damping == pytest.approx(0.1)
    assert math.isnan(Axis(1.0, 1.0).damping) and Axis(1.0, 1.0).frequency == 0.0


@settings(max_examples=40, deadline=None)
@given(p=swinging, v=st.floats(-1.0, 1.0), pull=st.floats(-30.0, 30.0), h=st.floats(1e-4, 0.1))
def test_a_spring_of_next_to_nothing_is_none(p: Axis, v: float, pull: float, h: float) -> None:
    """Two solutions of a step, with a spring and without one."""
    hardly = p._replace(spring=1e-9)
    speed, moved = glide(p, v, pull, h)
    np.testing.assert_allclose(swing(hardly, 0.0, v, pull, h), (moved, speed), rtol=1e-5, atol=1e-7)


@settings(max_examples=40, deadline=None)
@given(p=axes, force=forces, cut=st.integers(1, 4))
def test_pieces_go_on_as_a_whole_run_does(p: Axis, force: list[float], cut: int) -> None:
    """Each from the state in which the whole run comes to it."""
    push = np.array(force)
    whole = motion(p, push, 1e-2, 0.1, 0.2)
    at = np.array([0, cut], np.int64)
    count, dt = np.array([cut, len(push) - cut], np.int64), np.full(2, 1e-2)
    out = np.empty_like(whole)
    compiled(model.restarted)(p, push, at, count, dt, *np.ascontiguousarray(whole[:, at]), out)
    np.testing.assert_allclose(out, whole, rtol=1e-12, atol=1e-12)


def test_stribeck_friction_on_a_spring_holds_until_it_is_overcome() -> None:
    p = Axis(mass=1.0, viscous=1.0, coulomb=2.0, stribeck=1.0, stribeck_speed=0.1, spring=10.0)
    assert model.step(p, 0.1, 0.0, 3.99, 1e-3) == (0.1, 0.0)  # 3.99 - 1.0 = 2.99
    x, v = model.step(p, 0.1, 0.0, 4.2, 1e-4)
    assert v == pytest.approx(0.2e-4, rel=1e-2) and x > 0.1
