"""The guard of one stage: every bound exactly at and just beyond, every fault stays."""

import math

import pytest

from macromicro.control.stage_law import Sample, Target
from macromicro.kernel import compiled
from macromicro.machines import guarding
from macromicro.machines.guarding import (
    FAST,
    HIGH,
    ILLEGAL,
    LOST,
    LOW,
    OK,
    SILENT,
    STUCK,
    Limits,
    describe,
    fresh,
)

P = Limits(
    effort=10.0,
    low=-0.5,
    high=0.5,
    speed=2.0,
    window=0.01,
    error=0.25,
    silent=0.02,
    push=5.0,
    stuck=0.3,
)
DT = 1e-3
NAN = math.nan


def watched(samples, limits=P, start=0.0):
    """The guard after samples of (position, target, effort), and the last effort given."""
    watch, given = fresh(), 0.0
    for k, (place, target, effort) in enumerate(samples):
        sample = Sample(start + k * DT, place)
        watch, given = guarding.step(limits, watch, sample, Target(target, 0.0, 0.0), effort)
    return watch, given


def one(place=0.0, target=None, effort=1.0):
    return watched([(place, place if target is None else target, effort)])


@pytest.mark.parametrize("effort", [10.0, -10.0, 0.0])
def test_a_legal_effort_passes(effort):
    watch, given = one(effort=effort)
    assert watch.fault == OK and given == effort and describe(watch) is None
    assert watch[1:4] == (0.0, 0.0, 0.0) == fresh()[1:4]


@pytest.mark.parametrize("effort", [10.001, -10.001, NAN, math.inf])
def test_an_illegal_effort_is_switched_off(effort):
    watch, given = one(effort=effort)
    assert watch.fault == ILLEGAL and given == 0.0 and watch.limit == 10.0
    assert watch.value == effort or math.isnan(effort)


def test_soft_limits_exactly_and_just_beyond():
    for place in (-0.5, 0.5):
        assert one(place)[0].fault == OK
    low, given = one(-0.500001)
    assert (low.fault, low.value, low.limit, given) == (LOW, -0.500001, -0.5, 0.0)
    high, given = one(0.500001)
    assert (high.fault, high.value, high.limit, given) == (HIGH, 0.500001, 0.5, 0.0)


def test_the_following_error_either_way():
    for target in (0.25, -0.25):
        assert one(0.0, target)[0].fault == OK
        lost, given = one(0.0, target * 1.0001)
        assert lost.fault == LOST and lost.value == pytest.approx(0.250025) and given == 0.0
        assert lost.limit == 0.25


def going(speed, n, start=0.0):
    """At a constant speed, on target."""
    return [(x, x, 1.0) for x in (start + speed * k * DT for k in range(n))]


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_the_speed_over_its_window(way):
    assert watched(going(1.999 * way, 30))[0].fault == OK
    early = watched(going(2.01 * way, 10))[0]
    assert early.fault == OK  # the window is not over
    fast, given = watched(going(2.01 * way, 11))
    assert fast.fault == FAST and fast.value == pytest.approx(2.01) and given == 0.0
    assert fast.limit == 2.0
    for periods, fault in ((10, OK), (11, FAST)):  # whenever it begins
        assert watched(going(2.01 * way, periods), start=3.0)[0].fault == fault
    assert watched(going(0.0, 30), P._replace(speed=0.1))[0].fault == OK
    slow_then_fast = going(0.0, 11) + [(x, x, 1.0) for x in (0.003 * way * k for k in range(11))]
    assert watched(slow_then_fast)[0].fault == FAST


def test_a_silent_encoder_by_the_time_of_the_last_reading():
    gone = [(0.0, 0.0, 1.0)] + [(NAN, 0.0, 1.0)] * 20
    assert watched(gone)[0].fault == OK
    silent, given = watched([*gone, (NAN, 0.0, 1.0)])
    assert silent.fault == SILENT and given == 0.0
    assert silent.value == pytest.approx(0.021) and silent.limit == 0.02
    back = [*gone, (0.0, 0.0, 1.0), *[(NAN, 0.0, 1.0)] * 20]
    assert watched(back)[0].fault == OK
    assert watched([(NAN, 0.0, 1.0)] * 21)[0].fault == OK  # silent from the beginning
    later = watched([(NAN, 0.0, 1.0)] * 22, start=3.0)[0]
    assert later.fault == SILENT and later.value == pytest.approx(0.021)


@pytest.mark.parametrize("push", [5.001, -5.001])
def test_a_stage_that_is_pushed_and_stands_is_stuck(push):
    pushed = [(0.1, 0.1, 0.0)] + [(0.1, 0.1, push)] * 300
    assert watched(pushed)[0].fault == OK
    stuck, given = watched([*pushed, (0.1, 0.1, push)])
    assert (stuck.fault, stuck.value, stuck.limit, given) == (STUCK, push, 0.3, 0.0)
    for effort, place in ((5.0, 0.1), (-5.0, 0.1), (push, 0.1001)):  # eased, or it moved
        again = [*pushed, (place, place, effort), *[(place, place, push)] * 300]
        assert watched(again)[0].fault == OK
    from_the_first = [(0.1, 0.1, push)] * 302
    assert watched(from_the_first)[0].fault == STUCK
    assert watched(from_the_first[:301])[0].fault == OK


def test_pushing_without_a_reading_counts_on_and_easing_ends_it():
    limits = P._replace(silent=1.0)
    pushed = [(0.1, 0.1, 6.0)] + [(NAN, 0.1, 6.0)] * 301
    assert watched(pushed, limits)[0].fault == STUCK
    eased = (
        [(0.1, 0.1, 6.0)] + [(NAN, 0.1, 6.0)] * 200 + [(NAN, 0.1, 5.0)] + [(NAN, 0.1, 6.0)] * 299
    )
    assert watched(eased, limits)[0].fault == OK
    for push in (6.0, -6.0):
        never_read = [(NAN, 0.1, push)] * 302
        assert watched(never_read[:301], limits)[0].fault == OK
        assert watched(never_read, limits)[0].fault == STUCK


def test_a_fault_stays_and_nothing_passes():
    first, _ = one(0.6)
    watch, given = guarding.step(P, first, Sample(5.0, 0.0), Target(0.0, 0.0, 0.0), 1.0)
    assert watch == first and given == 0.0
    late = watched([(0.0, 0.0, 1.0)] * 5 + [(0.7, 0.7, 1.0)])[0]
    assert late.time == pytest.approx(0.005)
    third = watched([(0.7, 0.7, 1.0)], start=1.0 / 3.0)[0]
    assert describe(third).time_s == 0.333333333


@pytest.mark.parametrize(
    ("watch", "name", "words"),
    [
        (one(effort=11.0)[0], "illegal effort", "11 V where at most 10 V"),
        (one(-0.6)[0], "below the soft limit", "-600.0000 mm, allowed -500.0000 mm"),
        (one(0.6)[0], "above the soft limit", "600.0000 mm, allowed at most 500.0000 mm"),
        (one(0.0, 0.3)[0], "following error", "300 mm, allowed 250 mm"),
        (watched(going(2.5, 12))[0], "overspeed", "2500 mm/s, allowed 2000 mm/s"),
        (watched([(NAN, 0.0, 1.0)] * 22)[0], "encoder silent", "0.0210 s, allowed 0.0200 s"),
        (watched([(0.1, 0.1, 6.0)] * 302)[0], "stuck", "6 V without a new position"),
    ],
)
def test_each_fault_is_told_in_words(watch, name, words):
    fault = describe(watch)
    assert fault.name == name and words in fault.evidence and fault.code == watch.fault
    assert "guard." in fault.remedy and fault.time_s == pytest.approx(watch.time)


def test_compiled_it_does_the_same():
    watch = fresh()
    args = (P, watch, Sample(0.0, 0.6), Target(0.6, 0.0, 0.0), 1.0)
    assert compiled(guarding.step)(*args)[0].fault == HIGH
