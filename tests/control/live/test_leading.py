"""The set point: quickest profiles within the limits, ramps, rest."""

from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from macromicro.control.live.leading import (
    NEVER,
    REST,
    Aim,
    Course,
    Guide,
    Guided,
    Ready,
    Touch,
    ahead,
    at,
    decelerate,
    lead,
    ramp,
)

Q = Guide(0.2, 2.0, 100.0, Ready(1e-5, 0.01, 1.0), -0.1, 0.1)
DT = 1e-3


@given(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1))
@example(0.0, 5e-324)
@example(0.0, -3e-308)
def test_a_profile_runs_within_the_limits_and_ends_at_its_goal(start: float, goal: float) -> None:
    g, late, now = Guided(aim=REST._replace(position=start)), -math.inf, 0.0
    before, fastest = (0.0, g.aim), 0.0
    while late < 0.0:
        g, late = lead(Q, g, 1, goal, now, DT)
        # The last piece of the period before leads to where it is now.
        begin, last = before
        assert at(last, DT - begin).position == pytest.approx(g.aim.position, abs=1e-12)
        assert abs(g.aim.velocity) <= Q.velocity * 1.000001
        assert abs(g.aim.acceleration) <= Q.acceleration * 1.000001
        fastest = max(fastest, abs(g.aim.velocity))
        before, now = ((0.0, g.aim), *g.later)[-1], now + DT
        assert now < 5.0
    assert g.aim == REST._replace(position=goal)
    assert fastest > 0.0 or abs(goal - start) < 1e-7


def test_another_motion_begins_where_the_set_point_has_come_to_rest() -> None:
    g, now = Guided(), 0.0
    for _ in range(150):
        g, _late = lead(Q, g, 1, 0.1, now, DT)
        now += DT
    assert g.aim.velocity > 0.1
    turned = []
    for _ in range(1000):
        g, late = lead(Q, g, 2, 0.0, now, DT)
        turned.append(g.aim.velocity)
        now += DT
        if late >= 0.0:
            break
    steps = [b - a for a, b in itertools.pairwise(turned)]
    assert max(map(abs, steps)) <= Q.acceleration * DT * 1.000001
    assert min(turned) < -0.1 and g.aim.position == 0.0


@given(st.floats(-0.2, 0.2))
def test_braking_takes_the_way_that_the_deceleration_needs(speed: float) -> None:
    g = Guided(aim=Aim(0.0, speed, 0.7, 3.0), motion=4)
    for _ in range(102):
        g = decelerate(Q, g, DT)
    assert g.aim.velocity == 0.0 and g.aim.acceleration == 0.0
    way = math.copysign(speed * speed / (2.0 * Q.acceleration), speed)
    assert g.aim.position == pytest.approx(way, abs=abs(speed) * 2.0 * DT + 2e-6)


def test_a_ramp_ends_at_the_speed_that_is_asked_for() -> None:
    aim = REST
    for _ in range(50):
        aim = at(ramp(Q, aim, -0.05, DT), DT)
    assert aim.velocity == pytest.approx(-0.05) and aim.position < 0.0


def test_a_set_point_is_held_back_on_either_side() -> None:
    touch = Touch(0.1, 0.01, 1.0, 2e-3, 0.3, 1e-5, 1e-3, 0.0, 10.0)
    for off in (-1.0, 1.0):
        g, held = ahead(touch, Guided(aim=REST._replace(position=5e-3 * off)), 1e-3 * off)
        assert held and g.aim.position == pytest.approx(3e-3 * off)
    g, held = ahead(touch, Guided(aim=REST._replace(position=1.9e-3)), 0.0)
    assert not held and g.aim.position == 1.9e-3


@pytest.mark.parametrize("give", [2e-4, 9e-4])
@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_a_stage_leans_before_its_set_point_is_held_back(give: float, way: float) -> None:
    """Once it lags by nearly all that the set point may lead, but by half of that at least."""
    lead, share = 1e-3, max(1e-3 - give, 0.5e-3)
    touch = Touch(0.1, 0.01, 1.0, lead, 0.3, give, 1e-3, 0.0, 10.0)
    for off, leans in ((0.98 * share, False), (1.02 * share, True)):
        g, leant = ahead(touch, Guided(aim=REST._replace(position=way * off)), 0.0)
        assert leant == leans and g.aim.position == way * off


def test_what_is_not_led_is_off_and_nothing_limits_it() -> None:
    assert Course() == Course(False, REST, -math.inf, math.inf, math.inf, 0)
    # NaN equals NaN as text.
    fresh = Guided(REST, False, 0, NEVER, (), 0.0, math.nan, math.nan, 0.0)
    assert repr(Guided()) == repr(fresh)


def test_what_holds_a_set_point_back_is_the_way_to_the_stage_wherever_that_is() -> None:
    touch = Touch(0.1, 0.01, 1.0, 2e-3, 0.3, 1e-5, 1e-3, 0.0, 10.0)
    g = Guided(aim=Aim(1.001, 0.1, 0.2, 0.3))
    assert ahead(touch, g, 1.0) == (g, False)
    g, held = ahead(touch, Guided(aim=Aim(0.99, 0.1, 0.2, 0.3)), 1.0)
    assert held and g.aim == Aim(0.998, 0.1, 0.2, 0.3)
