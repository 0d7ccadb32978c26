"""A set point that follows a moving target never leaves its limits, whatever the target does."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from macromicro.control.live import tracking
from macromicro.control.live.leading import REST, Aim, at
from macromicro.control.live.tracking import Limits, Track
from macromicro.motion import Segment, s_curve

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


def exceeds(q: Limits, piece: Segment) -> float:
    """By what share of a limit a piece leaves it at most, by the roots of its derivatives."""
    duration, p, v, a, j = piece
    place = np.polynomial.Polynomial([p, v, 0.5 * a, j / 6.0])
    speed, change = place.deriv(), place.deriv(2)
    times = np.array([*speed.roots(), *change.roots(), duration])
    times = np.real(times[np.isreal(times)])
    times = times[(times > 0.0) & (times <= duration)]
    span = q.high - q.low
    beyond = np.maximum(place(times) - q.high, q.low - place(times)) / span
    fast, hard = abs(speed(times)) / q.velocity - 1.0, abs(change(times)) / q.acceleration - 1.0
    return float(np.max([beyond, fast, hard]))


shares = st.integers(-120, 120).map(lambda n: n / 100.0)


@settings(max_examples=400)
@given(st.floats(1e-3, 1.0), shares, shares, shares, shares, st.sampled_from([0.0, 0.02, -0.03]))
def test_a_piece_keeps_its_limits_wherever_it_is_fastest_or_turns(
    duration: float, p: float, v: float, a: float, j: float, low: float
) -> None:
    q = Limits(0.2, 2.0, 10.0, low, low + 0.05)
    middle = low + 0.025
    piece = Segment(duration, middle + 0.025 * p, 0.2 * v**3, 2.0 * a**3, 10.0 * j**3)
    most = exceeds(q, piece)
    assume(abs(most) > 1e-6)
    assert tracking.within_limits(q, (piece,)) == (most < 0.0)
    calm = Segment(1.0, middle, 0.0, 0.0, 0.0)
    assert tracking.within_limits(q, (calm, piece, calm)) == (most < 0.0)


@settings(max_examples=300)
@given(
    st.sampled_from([-1.0, 1.0]),
    st.floats(0.02, 0.1),
    st.floats(0.02, 0.1),
    st.floats(0.2, 1.5),
    st.integers(-100, 100).map(lambda n: n / 10.0),
    st.sampled_from([-1e-4, 1e-4]),
)
def test_a_piece_keeps_its_limits_where_it_turns(
    way: float, before: float, after: float, change: float, j: float, beyond: float
) -> None:
    """`before` its turn and `after` it, at which the acceleration is `change` back."""
    q = Limits(1.0, 20.0, 100.0, -0.05, 0.05)
    a = -change - j * before
    v = -before * (a + 0.5 * j * before)
    p = 0.05 + beyond - before * (v + before * (0.5 * a + before * j / 6.0))
    piece = Segment(before + after, *(way * each for each in (p, v, a, j)))
    most = exceeds(q, piece)
    assume(abs(most) > 1e-9)
    assert tracking.within_limits(q, (piece,)) == (most < 0.0)


@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_a_piece_may_leave_its_limits_between_its_ends(way: float) -> None:
    """Where it turns, and where it is fastest, the first or the second time."""
    q = Limits(0.2, 2.0, 100.0, -0.05, 0.05)

    def within(duration: float, *begin: float) -> bool:
        return tracking.within_limits(q, (Segment(duration, *(way * each for each in begin)),))

    assert within(0.2, 0.044, 0.1, -1.0, 0.0) and not within(0.2, 0.046, 0.1, -1.0, 0.0)
    assert within(0.1, 0.0474, 0.1, -2.0, 0.0) and not within(0.1, 0.0476, 0.1, -2.0, 0.0)
    assert within(0.2, 0.0, 0.14, 1.0, -10.0) and not within(0.2, 0.0, 0.16, 1.0, -10.0)
    assert within(0.16, 0.044, 0.1, -1.0, 0.0) and not within(0.16, 0.046, 0.1, -1.0, 0.0)
    for jerk in (-10.0, 10.0):
        turns = (0.0, 0.02, 0.5 * math.copysign(1.0, -jerk), jerk)
        assert within(0.1, *turns) == (exceeds(q, Segment(0.1, *turns)) < 0.0)


@pytest.mark.parametrize(("name", "least"), [("high", 2.0), ("low", -3.0)])
def test_rounding_alone_is_within_the_limits(name: str, least: float) -> None:
    q = Limits(0.2, 2.0, 10.0, -3.0, 2.0)
    out = math.copysign(1.0, least)
    for beyond, fine in ((1e-10, True), (4e-10, False)):
        assert (
            tracking.within_limits(q, (Segment(1.0, least + out * beyond, 0.0, 0.0, 0.0),)) == fine
        )
    for beyond, fine in ((1e-10, True), (1e-8, False)):
        fast = Segment(1.0, 0.0, out * 0.2 * (1.0 + beyond), 0.0, 0.0)
        hard = Segment(1e-3, 0.0, 0.0, out * 2.0 * (1.0 + beyond), 0.0)
        assert tracking.within_limits(q, (fast,)) == tracking.within_limits(q, (hard,)) == fine


def wander(seed: int, size: float, held: int, speed: float) -> list[Aim]:
    """Targets that jump about, each held for some periods."""
    rng = np.random.default_rng(seed)
    found: list[Aim] = []
    for place, velocity in zip(
        rng.uniform(-size, size, 12), rng.uniform(-1.0, 1.0, 12), strict=True
    ):
        rate = float(speed * velocity)
        found += [Aim(float(place) + rate * k * DT, rate, 0.0, 0.0) for k in range(held)]
    return found


WAYS = {
    "far": (Limits(0.2, 2.0, 100.0, -1.0, 1.0), [still(0.4)] * 3000),
    "farther": (Limits(0.5, 0.5, 2.0, -9.0, 9.0), [still(-5.0)] * 14000),
    "near": (Limits(0.2, 2.0, 20.0, -1.0, 1.0), [still(3e-3)] * 500),
    "jumps": (Limits(0.2, 2.0, 50.0, -0.05, 0.06), wander(1, 0.1, 150, 0.0)),
    "quick jumps": (Limits(0.3, 3.0, 40.0, -0.02, 0.03), wander(2, 0.05, 37, 0.0)),
    "moving": (Limits(0.1, 2.0, 80.0, -0.05, 0.05), wander(3, 0.06, 200, 0.15)),
}
# Root mean squares of position, speed and acceleration at the ends of the periods, to which a way
# that was judged good came.
CAME = {
    "far": (0.292566146, 0.161414005, 0.444430085),
    "farther": (3.45001423, 0.412418474, 0.159713378),
    "near": (0.00252680832, 0.00988034447, 0.161815424),
    "jumps": (0.0201612039, 0.103060103, 1.47718097),
    "quick jumps": (0.0149835745, 0.0763408501, 1.07074199),
    "moving": (0.0134853337, 0.0708514087, 0.858651197),
}


@pytest.mark.parametrize("name", WAYS)
def test_the_way_to_a_target_stays_what_it_is(name: str) -> None:
    q, asked = WAYS[name]
    track, rows = tracking.start(q, still(0.0)._replace(jerk=3.0)), []
    assert track.aim == still(0.0)
    for target in asked:
        track, _, _ = tracking.step(q, track, target, DT)
        rows.append(track.aim[:3])
        assert track.aim.jerk == 0.0
    came = np.sqrt((np.array(rows) ** 2).mean(axis=0))
    assert came == pytest.approx(CAME[name], rel=1e-7)
