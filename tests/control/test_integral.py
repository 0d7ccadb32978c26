"""Integral control through the inverse of a hysteresis."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.control import integral
from macromicro.control.integral import LAW, Integral
from macromicro.control.notch import Notch
from macromicro.control.stage_law import Sample, Target
from macromicro.hysteresis import prandtl
from macromicro.hysteresis.prandtl import operator

R, W = (0.0, 5.0, 20.0), (0.6e-6, 0.2e-6, 0.1e-6)
DT = 1e-4
PLAIN = Integral(integral=200.0, loop_thresholds=R, loop_weights=W, gain=10.0, low=-2.0, high=12.0)
REST = Target(0.0, 0.0, 0.0)


def run(p, targets, places, dt=DT):
    """Memories and efforts along targets and readings."""
    s, found = LAW.start(p, Sample(0.0, 0.0)), []
    for k, (target, place) in enumerate(zip(targets, places, strict=True)):
        s, effort = LAW.step(p, s, target, Sample(k * dt, place), dt)
        found.append((s, effort))
    return found


@given(st.lists(st.floats(0.0, 80e-6), min_size=1, max_size=20))
@settings(max_examples=50, deadline=None)
def test_a_stage_of_the_same_hysteresis_follows_exactly(ways):
    """Set point, inverse and operator after one another are the set point; no correction then."""
    p = operator(R, W)
    plays, place = prandtl.relaxed(p), 0.0
    s = LAW.start(PLAIN, Sample(0.0, 0.0))
    for way in ways:
        # The reading of this period answers the one before: give the law what it expects.
        s, effort = LAW.step(PLAIN, s, Target(way, 0.0, 0.0), Sample(0.0, way), DT)
        plays, place = prandtl.advance(p, plays, 10.0 * effort, 0.0)
        assert place == pytest.approx(way, abs=1e-15)
        assert LAW.tell(s).correction == 0.0


def test_the_correction_integrates_the_error():
    """I grows by ki e dt; a proportional part and a second integral add theirs."""
    found = run(PLAIN, [REST] * 3, [-1e-6] * 3)
    assert [s.correction for s, _ in found] == pytest.approx([2e-8, 4e-8, 6e-8])
    assert found[0][1] == pytest.approx(2e-8 / 0.6e-6 / 10.0)  # within the first threshold
    both = run(PLAIN._replace(proportional=0.1), [REST] * 2, [-1e-6] * 2)
    assert [s.correction for s, _ in both] == pytest.approx([1.2e-7, 1.4e-7])
    twice = run(PLAIN._replace(drift=50.0), [REST] * 3, [-1e-6] * 3)
    # slope: ki kd e dt each period, 1e-6 m/s; it adds slope dt.
    extra = [1e-10, 3e-10, 6e-10]
    wanted = [a + b for a, b in zip([2e-8, 4e-8, 6e-8], extra, strict=True)]
    assert [s.correction for s, _ in twice] == pytest.approx(wanted)


@pytest.mark.parametrize("place", [7e-6, -3e-6])
def test_it_starts_from_0_v_wherever_the_stage_rests(place):
    """What hysteresis has left is taken off what the inverse is given."""
    s = LAW.start(PLAIN, Sample(0.0, place))
    there = Target(place, 0.0, 0.0)
    s, effort = LAW.step(PLAIN, s, there, Sample(0.0, place), DT)
    assert effort == 0.0 and s.offset == place and LAW.tell(s).correction == 0.0
    _, effort = LAW.step(PLAIN, s, Target(place + 1.2e-6, 0.0, 0.0), Sample(DT, place + 1.2e-6), DT)
    assert effort == pytest.approx(1.2e-6 / 0.6e-6 / 10.0)
    assert LAW.start(PLAIN, Sample(0.0, math.nan)).offset == 0.0


def test_the_notch_filters_the_correction_alone():
    notched = PLAIN._replace(proportional=0.5, notch=Notch(2500.0, 0.1, 1.0))
    still = run(notched, [Target(5e-6, 0.0, 0.0)] * 4, [5e-6] * 4)
    assert still[-1][1] == pytest.approx(
        run(PLAIN, [Target(5e-6, 0.0, 0.0)] * 4, [5e-6] * 4)[-1][1]
    )
    kicked = run(notched, [REST] * 2, [-1e-6, -1e-6])
    plain = run(PLAIN._replace(proportional=0.5), [REST] * 2, [-1e-6, -1e-6])
    assert abs(kicked[0][0].correction) < 0.9 * plain[0][0].correction


def test_the_set_point_is_led_by_its_derivatives():
    """r + 2 ms v + 3e-6 s^2 a, through the inverse."""
    p = PLAIN._replace(integral=0.0, ahead_velocity=2e-3, ahead_acceleration=3e-6)
    ((_, effort),) = run(p, [Target(10e-6, 1e-3, 0.5)], [0.0])
    ((_, wanted),) = run(p, [Target(10e-6 + 2e-6 + 1.5e-6, 0.0, 0.0)], [0.0])
    assert effort == pytest.approx(wanted)


def test_beyond_the_range_the_integral_waits_and_comes_back_at_once():
    far = Target(200e-6, 0.0, 0.0)
    found = run(PLAIN._replace(drift=10.0), [far] * 50, [80e-6] * 50)
    assert all(effort == 12.0 for _, effort in found)
    assert found[-1][0].integral == 0.0
    assert found[-1][0].slope == 0.0
    down = run(PLAIN, [Target(-100e-6, 0.0, 0.0)] * 5, [-10e-6] * 5)
    assert all(effort == -2.0 for _, effort in down)
    assert down[-1][0].integral == 0.0
    # Beyond the range on the other side of the error it may change.
    held = LAW.start(PLAIN, Sample(0.0, 0.0))._replace(integral=5e-6)
    held, effort = LAW.step(PLAIN, held, far, Sample(0.0, 201e-6), DT)
    assert effort == 12.0
    assert held.integral == pytest.approx(5e-6 - 200.0 * 1e-6 * DT)
    back = run(PLAIN, [far] * 3, [201e-6] * 3)
    assert back[-1][0].integral == pytest.approx(-3 * 200.0 * 1e-6 * DT)


def test_without_a_reading_the_correction_stays():
    found = run(PLAIN, [REST] * 4, [-1e-6, math.nan, math.nan, -1e-6])
    assert [s.correction for s, _ in found] == pytest.approx([2e-8, 2e-8, 2e-8, 4e-8])


def test_two_runs_share_nothing():
    first, second = (LAW.start(PLAIN, Sample(0.0, 0.0)) for _ in range(2))
    LAW.step(PLAIN, first, Target(50e-6, 0.0, 0.0), Sample(0.0, 0.0), DT)
    assert second.plays.y.tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("changes", "path"),
    [
        ({"loop_thresholds": (), "loop_weights": ()}, "loop_thresholds"),
        ({"loop_thresholds": (1.0, 5.0, 20.0)}, "loop_thresholds"),
        ({"loop_thresholds": (0.0, 5.0, 5.0)}, "loop_thresholds"),
        ({"loop_weights": (1e-6, 1e-6)}, "loop_weights"),
        ({"loop_weights": (0.0, 1e-6, 1e-6)}, "loop_weights"),
    ],
)
def test_a_loop_that_cannot_be_inverted_is_refused(changes, path):
    assert PLAIN._replace(**changes).problems()[0][0] == path
    assert PLAIN.problems() == []
    assert integral.LAW.name == "integral"


def test_switched_off_the_inverse_leaves_a_proportion_that_is_the_same_both_ways():
    ways = (20e-6, 40e-6, 20e-6)
    targets = [Target(way, 0.0, 0.0) for way in ways]
    led = [effort for _, effort in run(PLAIN, targets, ways)]
    assert led[0] != pytest.approx(led[2], rel=0.05)
    plain = [effort for _, effort in run(PLAIN._replace(invert=0), targets, ways)]
    # 140 V of stroke: 0.6 um/V of all of them, 0.2 of those beyond 2 x 5 V, 0.1 beyond 2 x 20 V.
    mean = (0.6e-6 * 140.0 + 0.2e-6 * 130.0 + 0.1e-6 * 100.0) / 140.0
    assert plain == pytest.approx([way / mean / 10.0 for way in ways])
    # It can be switched while the law runs: the inverse has followed meanwhile.
    s, _ = run(PLAIN._replace(invert=0), targets[:1], ways[:1])[0]
    _, effort = LAW.step(PLAIN, s, targets[1], Sample(DT, ways[1]), DT)
    assert effort == pytest.approx(led[1])
