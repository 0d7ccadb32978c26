"""The cascaded law: what each gain does, limit, anti-windup, observer."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.control import cascade
from macromicro.control.cascade import Cascade, Memory
from macromicro.control.stage_law import Sample, Target
from macromicro.kernel import compiled

DT = 1e-3
P = Cascade(
    position=10.0,
    velocity=2.0,
    integral=5.0,
    observer=500.0,
    ahead_velocity=3.0,
    ahead_acceleration=0.5,
    ahead_friction=0.7,
    ahead_gravity=0.2,
    rest=1e-4,
    limit=10.0,
)
AT_REST = Memory(0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def step(p=P, s=AT_REST, target=(0.0, 0.0, 0.0), place=0.0, dt=DT):
    return cascade.step(p, s, Target(*target), Sample(0.0, place), dt)


def test_at_rest_on_its_target_it_holds_the_weight():
    assert step()[1] == 0.2


def test_each_gain_has_its_share():
    # Error 0.1 m, at rest: 10 1/s gives 1 m/s, 2 V s/m gives 2 V, the integral 2 * 5 * 1 * 1 ms.
    memory, effort = step(target=(0.1, 0.0, 0.0))
    assert effort == pytest.approx(0.2 + 2.0 + 0.01)
    assert memory.integral == pytest.approx(0.01)
    assert step(target=(-0.1, 0.0, 0.0))[1] == pytest.approx(0.2 - 2.0 - 0.01)
    # A target that moves: 3 V s/m and the friction of its direction; accelerates: 0.5 V s^2/m.
    effort = step(s=AT_REST._replace(velocity=0.4), target=(0.0, 0.4, 0.0))[1]
    assert effort == pytest.approx(0.2 + 1.2 + 0.7)
    effort = step(s=AT_REST._replace(velocity=-0.4), target=(0.0, -0.4, 0.0))[1]
    assert effort == pytest.approx(0.2 - 1.2 - 0.7)
    assert step(target=(0.0, 0.0, 2.0))[1] == pytest.approx(0.2 + 1.0)
    # Faster than asked for.
    assert step(s=AT_REST._replace(velocity=0.5))[1] == pytest.approx(0.2 - 1.0)


def test_an_eccentric_load_is_held_where_it_is_to_be():
    turned = P._replace(ahead_unbalance=1.5, hangs=-math.pi / 2.0)
    assert step(p=turned)[1] == pytest.approx(0.2 + 1.5)  # a quarter turn from where it hangs
    at = 0.25 * math.pi
    effort = step(p=turned, s=AT_REST._replace(place=at), target=(at, 0.0, 0.0), place=at)[1]
    assert effort == pytest.approx(0.2 + 1.5 * math.sin(0.75 * math.pi))


def test_a_resting_target_leaves_small_errors_alone():
    held = AT_REST._replace(integral=0.3)
    memory, effort = step(s=held, target=(1e-4, 0.0, 0.0))
    assert effort == pytest.approx(0.5) and memory.integral == 0.3
    memory, effort = step(s=held, target=(1.1e-4, 0.0, 0.0))
    assert effort > 0.502 and memory.integral > 0.3
    assert step(s=held, target=(5e-5, 1e-9, 0.0))[1] > 0.5 + 0.7  # a moving one does not


def test_at_rest_friction_is_met_on_the_way_back_to_the_target():
    loose = P._replace(loosen=0.6)
    for sign in (1.0, -1.0):
        with_, without = (step(p, target=(0.1 * sign, 0.0, 0.0))[1] for p in (loose, P))
        assert with_ - without == pytest.approx(0.6 * sign)
    assert step(loose, target=(1e-4, 0.0, 0.0))[1] == 0.2  # within what is left alone
    moving = step(loose, target=(0.1, 1e-9, 0.0))[1], step(target=(0.1, 1e-9, 0.0))[1]
    assert moving[0] == moving[1]


def test_the_effort_is_limited_and_the_integral_only_comes_back():
    full = AT_REST._replace(integral=1.0)
    for sign in (1.0, -1.0):
        s = full._replace(integral=sign)
        memory, effort = step(s=s, target=(sign * 5.0, 0.0, 0.0))
        assert effort == sign * 10.0 and memory.integral == sign
    # Limited by the feed-forward one way, while the error asks for the other.
    memory, effort = step(s=full._replace(velocity=9.1), target=(0.0, 9.0, 0.0))
    assert effort == 10.0 and memory.integral < 1.0


def test_an_integral_that_pushed_the_other_way_begins_anew_with_a_move():
    held = AT_REST._replace(integral=0.3)
    assert step(s=held, target=(0.0, -0.1, 0.0))[0].integral < 0.0
    assert step(s=held, target=(0.0, 0.1, 0.0))[0].integral > 0.3
    moving = held._replace(rested=0.0)
    assert step(s=moving, target=(0.0, -0.1, 0.0))[0].integral > 0.29
    assert step(s=held)[0].rested == 1.0 and step(target=(0.0, 0.1, 0.0))[0].rested == 0.0
    assert step(target=(0.0, 0.0, 0.1))[0].rested == 0.0


@given(st.floats(-2.0, 2.0), st.floats(100.0, 5000.0), st.sampled_from([1e-4, 1e-3, 5e-3]))
def test_the_observer_finds_a_constant_speed_at_any_period(speed, bandwidth, dt):
    place, velocity = 0.0, 0.0
    for k in range(1, 2000):
        place, velocity = cascade.observed(
            bandwidth, place + dt * velocity, velocity, Sample(0.0, speed * k * dt), dt
        )
    assert velocity == pytest.approx(speed, abs=1e-6 + 1e-3 * abs(speed))
    assert place == pytest.approx(speed * 1999 * dt, abs=1e-6 + 1e-3 * abs(speed))


def test_the_observer_s_poles_are_where_its_bandwidth_says():
    # The error of a double pole z after n periods of free run: both corrections at once.
    dt, bandwidth = 1e-3, 700.0
    z = math.exp(-bandwidth * dt)
    place, velocity = cascade.observed(bandwidth, 0.0, 0.0, Sample(0.0, 1.0), dt)
    assert place == pytest.approx(1.0 - z * z)
    assert velocity == pytest.approx((1.0 - z) ** 2 / dt)
    assert cascade.observed(bandwidth, 0.5, 0.1, Sample(0.0, math.nan), dt) == (0.5, 0.1)


def test_the_prediction_carries_the_set_point_s_acceleration():
    memory, _ = step(s=AT_REST._replace(velocity=0.4), target=(0.0, 0.4, 2.0))
    assert memory.place == pytest.approx(DT * (0.4 + 0.5 * DT * 2.0))
    assert memory.velocity == pytest.approx(0.4 + DT * 2.0)


def test_a_missing_reading_is_bridged_by_the_prediction():
    effort = step(s=AT_REST._replace(place=0.1), place=math.nan, target=(0.2, 0.0, 0.0))[1]
    assert effort == pytest.approx(0.2 + 2.0 + 0.01)


def test_it_starts_where_the_stage_is():
    assert cascade.start(P, Sample(0.0, 0.3)) == Memory(0.3, 0.0, 0.0, 0.0, 0.0, 1.0)
    assert cascade.start(P, Sample(0.0, math.nan)).place == 0.0


def test_compiled_it_does_the_same():
    s = AT_REST._replace(velocity=0.1, integral=0.2)
    args = (P, s, Target(0.1, 0.2, 0.3), Sample(0.0, 0.05), DT)
    assert compiled(cascade.step)(*args) == cascade.step(*args)
