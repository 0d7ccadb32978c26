"""The guard of one stage: every bound exactly at and just beyond, every fault stays."""

import math

import pytest

from macromicro.control.stage_law import Sample, Target
from macromicro.kernel import compiled
from macromicro.machines import guarding
from macromicro.machines.guard_words import AGAINST, CLOCK, DRIVE, FROZEN, HOT, JUMP, LIMIT_LOW
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


def test_it_begins_with_nothing_seen():
    assert all(value == 0.0 or math.isnan(value) for value in fresh())


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
    assert watch[:4] == first[:4] and watch.fault == HIGH and given == 0.0
    late = watched([(0.0, 0.0, 1.0)] * 5 + [(0.7, 0.7, 1.0)])[0]
    assert late.time == pytest.approx(0.005)
    third = watched([(0.7, 0.7, 1.0)], start=1.0 / 3.0)[0]
    assert describe(third).time_s == 0.333333333


@pytest.mark.parametrize(
    ("watch", "name", "words"),
    [
        (one(effort=11.0)[0], "illegal effort", "11 V, allowed 10 V"),
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


LEAN = P._replace(lean=2.0, leant=0.1, still=0.01)


@pytest.mark.parametrize("effort", [2.0, -2.0, 4.9])
def test_a_free_stage_moves_under_less_than_a_hard_push(effort):
    stands = [(0.1, 0.1, 0.0)] + [(0.1, 0.1, effort)] * 100
    assert watched(stands, LEAN)[0].fault == OK
    stuck, given = watched([*stands, (0.1, 0.1, effort)], LEAN)
    assert (stuck.fault, stuck.value, stuck.limit, given) == (STUCK, effort, 0.1, 0.0)
    assert guarding.leaning(stuck) == pytest.approx(0.101)
    assert guarding.leaning(watched(stands[:11], LEAN)[0]) == pytest.approx(0.01)
    eased = [*stands, (0.1, 0.1, 1.999), *[(0.1, 0.1, effort)] * 100]
    assert watched(eased, LEAN)[0].fault == OK
    assert guarding.leaning(watched(eased[:102], LEAN)[0]) == 0.0
    assert guarding.leaning(fresh()) == 0.0
    for limits in (LEAN._replace(lean=0.0), LEAN._replace(lean=5.1)):  # not watched, or less
        assert watched([(0.1, 0.1, effort)] * 1000, limits)[0].fault == OK


def test_a_stage_that_moves_freely_under_very_little_is_watched_likewise():
    gentle = LEAN._replace(lean=0.5)
    assert watched([(0.1, 0.1, 0.5)] * 101, gentle)[0].fault == OK
    assert watched([(0.1, 0.1, 0.5)] * 102, gentle)[0].fault == STUCK
    assert watched([(0.1, 0.1, 0.499)] * 1000, gentle)[0].fault == OK


def test_a_push_counts_from_the_first_period_though_none_has_a_reading():
    never_read, patient = [(NAN, 0.1, 3.0)] * 102, LEAN._replace(silent=1.0)
    assert watched(never_read[:101], patient)[0].fault == OK
    assert watched(never_read, patient)[0].fault == STUCK


def test_a_reading_that_dithers_is_no_motion():
    dither = [(0.1 + 0.0099 * (k % 2), 0.1, 3.0) for k in range(102)]
    assert watched(dither, LEAN)[0].fault == STUCK
    hard = [(0.1 + 0.0099 * (k % 2), 0.1, 6.0) for k in range(302)]
    assert watched(hard, LEAN._replace(lean=0.0))[0].fault == STUCK
    moves = [(0.1 + 0.0101 * (k % 2), 0.1, 3.0) for k in range(302)]
    assert watched(moves, LEAN)[0].fault == OK


BACK = LEAN._replace(against=0.05, leant=9.0, stuck=9.0, window=9.0)


def pulled(way, n, effort, start=0.0):
    return [(x, x, effort) for x in (start + way * k * 1e-3 for k in range(n))]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_motion_against_the_motor(sign):
    assert watched(pulled(-sign, 51, 3.0 * sign), BACK)[0].fault == OK
    against, given = watched(pulled(-sign, 52, 3.0 * sign), BACK)
    assert (against.fault, against.limit, given) == (AGAINST, 0.05, 0.0)
    assert against.value == pytest.approx(0.051)
    for effort in (1.99 * sign, -3.0 * sign):  # too little to tell, or with it
        assert watched(pulled(-sign, 200, effort), BACK)[0].fault == OK
    assert watched(pulled(-sign, 200, 3.0 * sign), BACK._replace(against=0.0))[0].fault == OK
    assert watched(pulled(-sign, 200, 3.0 * sign), BACK._replace(lean=0.0))[0].fault == OK
    # What goes along once, or is not pushed, begins anew.
    for effort, way in ((3.0 * sign, sign), (0.0, -sign)):
        half = pulled(-sign, 40, 3.0 * sign)
        turned = pulled(way, 2, effort, half[-1][0])[1:]
        rest = pulled(-sign, 41, 3.0 * sign, turned[-1][0])[1:]
        assert watched([*half, *turned, *rest], BACK)[0].fault == OK
    assert watched([*half, *[(half[-1][0],) * 2 + (3.0 * sign,)] * 20], BACK)[0].fault == OK


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("effort", [0.5, 3.0])
def test_the_way_against_begins_anew_when_the_motor_turns(sign, effort):
    limits = BACK._replace(lean=0.5)
    half = pulled(-sign, 40, effort * sign)
    turned = pulled(sign, 53, -effort * sign, half[-1][0])[1:]
    assert watched([*half, *turned[:50]], limits)[0].fault == OK
    against = watched([*half, *turned], limits)[0]
    assert against.fault == AGAINST and against.value == pytest.approx(0.051)


LEAP = P._replace(leap=2.0, still=0.01, speed=1e9)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("driven", [True, False])
def test_a_reading_that_jumps(sign, driven):
    def after(places, limits=LEAP):
        watch = fresh()
        for k, place in enumerate(places):
            if driven:
                aim = Target(0.0 if math.isnan(place) else place, 0.0, 0.0)
                watch, _ = guarding.step(limits, watch, Sample(k * DT, place), aim, 1.0)
            else:
                watch = guarding.off(limits, watch, Sample(k * DT, place))
        return watch

    assert after([0.1, 0.1 + sign * 0.0119]).fault == OK  # 2 mm in 1 ms, and 10 mm
    jump = after([0.1, 0.1 + sign * 0.0121])
    assert (jump.fault, jump.limit, jump.time) == (JUMP, 2.0, DT)
    assert jump.value == pytest.approx(0.0121) and guarding.blind(jump)
    assert after([0.1, NAN, NAN, 0.1 + sign * 0.0159]).fault == OK  # three periods
    assert after([0.1, NAN, NAN, 0.1 + sign * 0.0161]).fault == JUMP
    assert after([0.1, 0.1 + sign * 0.3], LEAP._replace(leap=0.0)).fault == OK
    assert after([NAN, NAN, 0.3]).fault == OK  # the first
    assert after([0.1, *[NAN] * 21]).fault == SILENT


def test_a_sensor_that_repeats_itself():
    limits = P._replace(repeats=0.05)
    same = [(0.1, 0.1, 1.0)] * 51
    assert watched(same, limits)[0].fault == OK
    frozen, given = watched([*same, same[0]], limits)
    assert (frozen.fault, frozen.limit, given) == (FROZEN, 0.05, 0.0)
    assert frozen.value == pytest.approx(0.051)
    later = watched([*same, same[0]], limits, start=3.0)[0]
    assert later.fault == FROZEN and later.value == pytest.approx(0.051)
    assert watched([*same, (0.1001, 0.1, 1.0), *same[:50]], limits)[0].fault == OK
    assert watched(same * 4, limits._replace(repeats=0.0))[0].fault == OK
    silent = limits._replace(silent=1.0)  # no reading is no new one, either
    assert watched([*same[:10], *[(NAN, 0.1, 1.0)] * 42], silent)[0].fault == FROZEN


def test_what_is_heated_by_its_mean_effort():
    limits = P._replace(heat=4.0, heating=0.1, push=20.0)
    full = [(0.1, 0.1, 10.0)] * 400
    hot, given = watched(full[:53], limits)
    assert (hot.fault, hot.limit, given) == (HOT, 4.0, 0.0)
    assert hot.time == pytest.approx(-0.1 * math.log(0.6), abs=0.002)  # 10 V (1 - exp(-t/tau))
    assert not guarding.blind(hot)
    for effort in (3.99, -3.99):
        assert watched([(0.1, 0.1, effort)] * 3000, limits)[0].fault == OK
    assert watched([(0.1, 0.1, -10.0)] * 400, limits)[0].fault == HOT
    assert watched(full, limits._replace(heat=0.0))[0].fault == OK
    assert watched([(0.1, 0.1, 0.6)] * 400, limits._replace(heat=0.5))[0].fault == HOT
    # Clearing the fault cools nothing; time does.
    cleared = guarding.cleared(hot)
    again, _ = guarding.step(limits, cleared, Sample(hot.then + DT, 0.1), Target(0.1, 0, 0), 10.0)
    assert again.fault == HOT
    for k in range(1, 101):
        cleared = guarding.off(limits, cleared, Sample(hot.then + k * DT, 0.1))
    assert cleared.mean == pytest.approx(hot.mean * math.exp(-1.0), rel=0.01)


def test_a_mean_effort_is_never_above_what_was_given():
    """However long a period is beside the time constant."""
    limits = P._replace(heat=4.0, heating=0.1, silent=1.0)
    for effort, fault in ((3.99, OK), (4.01, HOT)):
        watch = fresh()
        for t in (0.0, 0.4):
            sample, aim = Sample(t, 0.1), Target(0.1, 0.0, 0.0)
            watch, _ = guarding.step(limits, watch, sample, aim, effort)
        assert watch.fault == fault and watch.mean == effort


def test_what_the_sensor_does_while_a_fault_is_latched():
    fault, _ = one(effort=11.0)
    assert not guarding.blind(fault)
    limits = P._replace(leap=1.0, still=0.001)
    fine = guarding.off(limits, fault, Sample(DT, 0.001))
    assert fine.missed == 0.0 and fine[:4] == fault[:4]
    jumped, given = guarding.step(limits, fine, Sample(2 * DT, 0.1), Target(0.1, 0, 0), 1.0)
    assert jumped.missed == 1.0 and jumped[:4] == fault[:4] and given == 0.0
    assert guarding.off(limits, jumped, Sample(3 * DT, 0.1)).missed == 1.0
    assert guarding.off(limits, fine, Sample(1.0, NAN)).missed == 1.0
    assert guarding.cleared(jumped).missed == 0.0


def test_after_which_faults_the_position_is_in_doubt():
    for code in (ILLEGAL, DRIVE, HOT):
        assert not guarding.blind(fresh()._replace(fault=code))
    for code in (SILENT, LOW, HIGH, FAST, LOST, STUCK, JUMP, FROZEN, AGAINST, LIMIT_LOW):
        assert guarding.blind(fresh()._replace(fault=code))


@pytest.mark.parametrize(
    ("code", "value", "limit", "words"),
    [
        (JUMP, 0.0121, 2.0, "by 12.1 mm between two readings; it is never faster than 2000 mm/s"),
        (FROZEN, 0.051, 0.05, "the same value for 0.0510 s, allowed 0.0500 s"),
        (AGAINST, 0.051, 0.05, "51 mm against the effort, allowed 50 mm"),
        (HOT, 4.01, 4.0, "4.01 V on average, allowed 4 V"),
    ],
)
def test_the_words_of_each(code, value, limit, words):
    found = describe(fresh()._replace(fault=code, value=value, limit=limit))
    assert words in found.evidence and "guard." in found.remedy


def timed(times, limits=P):
    """The guard after samples at these times, driven and off."""
    for driven in (True, False):
        watch = fresh()
        for t in times:
            sample = Sample(t, 0.1)
            if driven:
                watch, _ = guarding.step(limits, watch, sample, Target(0.1, 0.0, 0.0), 1.0)
            else:
                watch = guarding.off(limits, watch, sample)
        yield watch


def test_a_clock_that_jumps_or_stands():
    for after in (0.5, 1e-6):
        assert [w.fault for w in timed([1.0, 1.0 + after])] == [OK, OK]
    for after in (0.501, -1e-6):
        for watch in timed([1.0, 1.0 + after]):
            assert (watch.fault, watch.limit) == (CLOCK, 0.5) and guarding.blind(watch)
            assert watch.value == pytest.approx(after)
    assert [w.fault for w in timed([1.0] * 20)] == [OK, OK]
    assert [(w.fault, w.value) for w in timed([1.0] * 21)] == [(CLOCK, 0.0)] * 2
    assert [w.fault for w in timed([*[1.0] * 20, 1.001, *[1.001] * 19])] == [OK, OK]
    assert [w.fault for w in timed([1.0, *[NAN] * 19, 1.02])] == [OK, OK]
    assert [w.fault for w in timed([1.0, *[NAN] * 20])] == [CLOCK, CLOCK]
    assert [w.fault for w in timed([NAN] * 19)] == [OK, OK]
    assert [w.fault for w in timed([NAN] * 20)] == [CLOCK, CLOCK]


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("start", [0.0, 3.0])
def test_a_reading_that_leaps_from_rest_where_it_may_in_motion(sign, start):
    def fault(samples, limits):
        return watched(samples, limits, start)[0].fault

    limits = LEAP._replace(surge=1000.0)  # 1 mm in 1 ms
    for periods in (1, 3):
        rest = [(0.1, 0.1, 1.0)] * periods
        assert fault([*rest, (0.1 + sign * 0.0109,) * 2 + (1.0,)], limits) == OK
        leapt = watched([*rest, (0.1 + sign * 0.0111,) * 2 + (1.0,)], limits, start)[0]
        assert leapt.fault == JUMP and leapt.value == pytest.approx(0.0111)
    # From 0.4 m/s on it may be twice as fast, and gain as much again.
    moving = [(x, x, 1.0) for x in (0.0, sign * 0.0004)]
    for way, found in ((0.0117, OK), (0.0119, JUMP)):
        place = sign * (0.0004 + way)
        assert fault([*moving, (place, place, 1.0)], limits) == found
    fast = limits._replace(surge=1e9)  # the speed bounds it
    assert fault([*rest, (0.1 + sign * 0.0121,) * 2 + (1.0,)], fast) == JUMP
    lazy = limits._replace(surge=0.5)  # it hardly moves within a period
    assert fault([*rest, (0.1 + sign * 0.0101,) * 2 + (1.0,)], lazy) == JUMP


def test_slower_changes_the_speed_alone():
    limits = Limits(*(0.5 + k for k in range(len(Limits._fields))))
    assert guarding.slower(limits, 1.0) == limits._replace(speed=1.0)
    assert guarding.slower(limits, math.inf) == limits


def test_limits_of_readings_that_are_off_move_with_them():
    limits = Limits(*(0.5 + k for k in range(len(Limits._fields))))
    expected = limits._replace(low=limits.low + 0.25, high=limits.high + 0.25)
    assert guarding.shifted(limits, 0.25) == expected


@pytest.mark.parametrize("function", [guarding.off, guarding.step])
def test_both_ways_of_running_give_the_same_bits(function):
    limits = LEAP._replace(lean=2.0, heat=4.0, repeats=0.5, against=1.0)
    watch = both = fresh()
    for k, place in enumerate([0.0, 0.001, NAN, 0.002, 0.3, 0.3]):
        sample, aim = Sample(k * DT, place), Target(0.001, 0.0, 0.0)
        more = (aim, 3.0) if function is guarding.step else ()
        watch, both = (
            function(limits, watch, sample, *more),
            compiled(function)(limits, both, sample, *more),
        )
        assert repr(watch) == repr(both)
        if more:
            watch, both = watch[0], both[0]
    assert watch.fault == JUMP
