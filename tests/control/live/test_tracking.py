"""A set point that follows a moving target never leaves its limits, whatever the target does."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.control.live import tracking
from macromicro.control.live.leading import REST, Aim, at
from macromicro.control.live.tracking import Limits, Track
from macromicro.motion import s_curve

DT = 1e-3
LIMITS = Limits(0.2, 2.0, 100.0, 0.0, 0.2)


def still(place: float) -> Aim:
    return REST._replace(position=place)


def inside(q: Limits, aim: Aim) -> None:
    slack = 1.0 + 1e-6
    assert q.low - 1e-9 <= aim.position <= q.high + 1e-9
    assert abs(aim.velocity) <= slack * q.velocity
    assert abs(aim.acceleration) <= slack * q.acceleration
    assert abs(aim.jerk) <= slack * q.jerk


def led(q: Limits, start: float, targets: Iterable[Aim]) -> list[Aim]:
    """The set points, each looked at within its period, and joined to the next."""
    track, found = tracking.start(q, still(start)), []
    for target in targets:
        before = track.aim
        track, aim, later = tracking.step(q, track, target, DT)
        assert abs(aim.position - before.position) <= 2e-6 * q.velocity * DT
        assert abs(aim.velocity - before.velocity) <= 2e-6 * q.velocity
        assert abs(aim.acceleration - before.acceleration) <= 2e-6 * q.acceleration
        pieces = [(0.0, aim), *later]
        for (begin, piece), end in zip(pieces, [*(b for b, _ in later), DT], strict=True):
            for share in (0.0, 0.5, 1.0):
                inside(q, at(piece, share * (end - begin)))
        found.append(aim)
    return found


anything = st.floats(allow_nan=False, allow_infinity=False, width=32)
targets = st.lists(
    st.tuples(st.integers(1, 80), anything | st.floats(-0.3, 0.3), anything | st.floats(-1.0, 1.0)),
    min_size=1,
    max_size=12,
)
limits = st.builds(
    lambda v, reach, rise: Limits(v, v / reach, v / reach / rise, -0.05, 0.1),
    st.floats(1e-4, 1.0),
    st.floats(5e-3, 0.3),
    st.floats(2e-3, 0.1),
)


@given(limits, st.floats(-0.05, 0.1), targets)
def test_no_target_leads_it_beyond_its_limits(
    q: Limits, start: float, asked: list[tuple[int, float, float]]
) -> None:
    led(q, start, (Aim(p, v, 0.0, 0.0) for count, p, v in asked for _ in range(count)))


@given(limits, st.floats(-0.05, 0.1), st.floats(-0.05, 0.1))
def test_it_comes_to_rest_on_a_target_without_overshoot(
    q: Limits, start: float, goal: float
) -> None:
    q = q._replace(jerk=max(q.jerk, q.acceleration**2 / q.velocity))  # as machines have it
    time = s_curve(goal - start, q.velocity, q.acceleration, q.jerk).duration
    found = led(q, start, [still(goal)] * min(round(1.5 * time / DT + 1000), 5000))
    way = math.copysign(1.0, goal - start)
    assert max(way * (aim.position - goal) for aim in found) <= 1e-9 + 1e-6 * abs(goal - start)
    if 1.5 * time / DT + 1000 < 5000:
        assert found[-1] == still(goal)


def sine(rate: float, size: float) -> Callable[[float], Aim]:
    w = 2.0 * math.pi * rate
    return lambda t: Aim(0.1 + size * math.sin(w * t), size * w * math.cos(w * t), 0.0, 0.0)


@pytest.mark.parametrize("rate", [0.2, 1.0])
def test_a_target_within_the_limits_is_followed_without_lag(rate: float) -> None:
    wave = sine(rate, 0.01)
    wanted = [wave(k * DT) for k in range(4000)]
    found = led(LIMITS, 0.1, wanted)
    behind = np.array([w.position - a.position for w, a in zip(wanted, found, strict=True)])[1000:]
    speeds = np.array([w.velocity for w in wanted])[1000:]
    assert abs(behind).max() < 0.003 * 0.01
    assert abs(behind @ speeds / (speeds @ speeds)) < 0.1 * DT


def test_a_stop_is_known_from_any_state() -> None:
    rng = np.random.default_rng(1)
    for p, v, a in zip(*rng.uniform(-1.0, 1.0, (3, 200)), strict=True):
        aim = Aim(float(p), 0.2 * float(v), 2.0 * float(a), 0.0)
        pieces = tracking.stop(LIMITS, aim)
        end = at(Aim(*pieces[-1][1:]), pieces[-1].duration)
        assert abs(end.velocity) < 1e-12 and abs(end.acceleration) < 1e-12
        assert Aim(*pieces[0][1:])[:3] == aim[:3]


def test_a_known_stop_is_gone_period_by_period() -> None:
    aim = Aim(0.0, 0.1, 1.0, 0.0)
    track = Track(aim, tracking.stop(LIMITS, aim))
    end = at(Aim(*track.stop[-1][1:]), track.stop[-1].duration).position
    for _ in range(300):
        track, aim, _ = tracking.stopping(track, DT)
    assert aim == still(pytest.approx(end, abs=1e-12))
