"""Several stages on one path: a stop along it, and straight lines within all limits."""

from __future__ import annotations

import math
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.control.live.led import ABSOLUTE

from macromicro.control.live.leading import REST, Aim
from macromicro.machines.sequence import MOVING, Plan, Progress
from macromicro.serve.stage._playing import Slowing, Together, slower

DT = 1e-3
LENGTH = 1.0  # s


def swing(amplitude: float, start: float = 0.02) -> Plan:
    """To and fro by cubic pieces of a quarter of a second: speeds up and slows down both ways."""
    a = 64.0 * amplitude  # so that a piece from rest covers the amplitude
    quarters = [(0.0, a), (a / 4.0, -a), (0.0, -a), (-a / 4.0, a)]
    rows, place = [], start
    for k, (v, acceleration) in enumerate(quarters):
        rows.append([0.25 * k, place, v, acceleration, 0.0])
        place += 0.25 * v + acceleration / 32.0
    nothing = np.array([math.inf])
    first = np.array([0, len(rows)], np.int64)
    target = np.array([place])
    return Plan(
        nothing, target, nothing, np.array([LENGTH]), first, np.array(rows), start, math.nan
    )


def at(plan: Plan, t: float) -> tuple[float, float, float]:
    """Place, speed and acceleration of the plan at a time, by its pieces."""
    begin, place, v, a, _ = plan.pieces[min(int(t / 0.25), 3)]
    h = t - begin
    return place + h * (v + 0.5 * h * a), v + h * a, a


def stop(plans: list[Plan], most: list[float], since: float) -> list[Slowing]:
    """The state after each period of a stop that begins at a time, the rest included."""
    progress = Progress(MOVING, 0, 0, 0.0, math.nan, 0)
    found = [Slowing(since, 1.0, math.nan, (REST,) * len(plans))]
    while found[-1].rate > 0.0 or len(found) == 1:
        found.append(slower(plans, progress, found[-1], most, DT))
        assert len(found) < 5000
    found.append(slower(plans, progress, found[-1], most, DT))
    return found


AMPLITUDES = (0.01, -0.006, 0.0)  # the last one stands
FREE = [2.0, 3.0, 1.0]  # m/s^2: more than the path needs
BARE = [0.64, 0.384, 1.0]  # what the path needs of the first two


@pytest.mark.parametrize("since", [0.1, 0.3, 0.6, 0.8])
@pytest.mark.parametrize("most", [FREE, BARE], ids=["free", "bare"])
def test_a_stop_stays_on_the_path_and_uses_what_the_stages_have(
    since: float, most: list[float]
) -> None:
    plans = [swing(amplitude) for amplitude in AMPLITUDES]
    states = stop(plans, most, since)
    assert len(states) > 20
    for before, after in pairwise(states[:-1]):
        t, r = before.time, before.rate
        fall = (r - after.rate) / DT
        assert 0.0 <= after.rate < r <= 1.0
        assert after.time - t == pytest.approx(0.5 * DT * (r + after.rate))
        shares, least = [], []
        for plan, aim, limit in zip(plans, after.aims, most, strict=True):
            place, v, a = at(plan, t)
            assert aim == pytest.approx(Aim(place, v * r, a * r * r - v * fall, 0.0), abs=1e-12)
            if v != 0.0:
                shares.append(abs(aim.acceleration) / limit)
                bent = math.copysign(a * r * r, v * a)
                least.append(abs(v) * fall / limit - 0.25 if limit + bent < 0.25 * limit else -1.0)
        if after.rate > 0.0:  # one stage slows down as it can, or by the quarter that is kept
            tight = [abs(share - 1.0) < 1e-9 for share in shares]
            assert any(tight) or any(abs(each) < 1e-9 for each in least)
            if most is FREE:
                assert max(shares) <= 1.0 + 1e-9
    assert states[-2].rate == states[-1].rate == 0.0
    for plan, aim in zip(plans, states[-1].aims, strict=True):
        assert aim == REST._replace(position=aim.position)
        assert aim.position == pytest.approx(at(plan, states[-1].time)[0], abs=1e-12)


def test_where_nothing_moves_it_has_stopped() -> None:
    plans = [swing(0.0), swing(0.0)]
    progress = Progress(MOVING, 0, 0, 0.0, math.nan, 0)
    after = slower(plans, progress, Slowing(0.1, 0.7, 0.05, (REST,) * 2), [1.0, 1.0], DT)
    assert after == Slowing(0.1, 0.0, 0.05, (REST._replace(position=0.02),) * 2)


def together(speed: float = math.inf, acceleration: float = math.inf) -> Together:
    tree: Any = SimpleNamespace(arrival=(1e-6, 0.0, 1.0), motion=SimpleNamespace(acceleration=2.0))
    return Together((tree, tree), speed, acceleration)


def test_a_stop_before_the_first_period_of_a_programme_is_no_error() -> None:
    both = together()
    both.start((swing(0.01), swing(0.02)), (0.0, 0.0))
    both.hold(DT)


places = st.floats(-0.1, 0.1).filter(lambda x: x == 0.0 or abs(x) > 1e-6)


@given(st.tuples(places, places), st.floats(0.01, 1.0), st.floats(0.1, 10.0), st.floats(0.01, 1.0))
def test_a_straight_line_is_as_quick_as_all_limits_allow(
    goal: tuple[float, float], speed: float, acceleration: float, own: float
) -> None:
    guides = [
        ABSOLUTE._replace(velocity=0.3, acceleration=2.0, jerk=100.0),
        ABSOLUTE._replace(velocity=0.5, acceleration=1.0, jerk=70.0),
    ]
    speeds = (own, 0.4)
    found = together(speed, acceleration).straight(guides, (0.0, 0.0), goal, speeds)
    length = math.hypot(*goal)
    if length == 0.0:
        assert found == guides
        return
    limits = [
        (min(0.3, own), 2.0, 100.0, goal[0]),
        (min(0.5, 0.4), 1.0, 70.0, goal[1]),
    ]
    paths = [speed, acceleration, math.inf]
    for k, name in enumerate(("velocity", "acceleration", "jerk")):
        along = min([paths[k], *(each[k] * length / abs(each[3]) for each in limits if each[3])])
        for guide, whole, each in zip(found, guides, limits, strict=True):
            expected = along * abs(each[3]) / length if each[3] else getattr(whole, name)
            assert getattr(guide, name) == pytest.approx(expected)
            assert guide._replace(velocity=0, acceleration=0, jerk=0) == whole._replace(
                velocity=0, acceleration=0, jerk=0
            )
