"""What the guard makes of each reading, number by number."""

from __future__ import annotations

import math

import pytest

from macromicro.rig import codes, sensing
from macromicro.rig.limits import Limits
from macromicro.rig.sensing import UNSEEN, Seen
from macromicro.types import Sample

P = Limits()
DT = 0.001
NAN = math.nan
SEEN = UNSEEN._replace(
    encoder=100.0,
    encoder_age=0.004,
    hall=2.0,
    hall_age=0.003,
    same=0.2,
    railed=0.05,
    pushed=0.03,
    leant=0.4,
    against=7.0,
    before=1.0,
    noise=0.0001,
    time=5.0,
)


def look(s: Seen = SEEN, effort: float = 0.0, t: float = 5.001, **shown: float) -> Seen:
    sample = Sample(t, 100.0, 2.0, NAN, NAN, NAN)._replace(**shown)
    return sensing.look(P, s, sample, effort, DT)


def test_nothing_is_amiss_before_the_first_reading() -> None:
    for name, value in UNSEEN._asdict().items():
        expected = NAN if name in ("encoder", "hall", "before", "time") else 0.0
        assert repr(value) == repr(expected), name


def test_the_first_reading() -> None:
    s = sensing.look(P, UNSEEN, Sample(9.0, 5.0, 2.5, NAN, NAN, NAN), 4.0, DT)
    assert (s.encoder, s.hall, s.time) == (5.0, 2.5, 9.0)
    assert math.isnan(s.before)
    ages = (s.encoder_age, s.hall_age, s.same, s.railed, s.pushed, s.leant, s.stood, s.noise)
    assert ages == (0.0,) * 8
    assert (s.jump, s.against, s.passed) == (0.0, 0.0, DT)
    assert sensing.fault(P, s, 4.0)[0] == codes.OK


def test_a_missing_count_ages_and_the_last_one_stays() -> None:
    s = look(encoder=NAN)
    assert (s.encoder, s.encoder_age, s.jump) == (100.0, pytest.approx(0.005), 0.0)
    s = look(encoder=103.0)
    assert (s.encoder, s.encoder_age, s.jump) == (103.0, 0.0, 3.0)
    assert s.possible == pytest.approx(P.fastest * (0.004 + 0.001))
    assert look(encoder=97.0).jump == 3.0
    # A loop that was held up for longer lets more pass, never less than a period's.
    assert look(t=5.05).possible == pytest.approx(P.fastest * (0.004 + 0.05))
    assert look(t=4.9).possible == pytest.approx(P.fastest * (0.004 + 0.001))


def test_a_missing_voltage_ages_and_leaves_the_rest() -> None:
    s = look(hall=NAN)
    assert (s.hall, s.hall_age, s.same, s.before) == (2.0, pytest.approx(0.004), 0.2, 1.0)
    assert (s.noise, s.railed) == (0.0001, 0.0)
    s = look(hall=2.1)
    assert (s.hall, s.hall_age, s.same, s.before) == (2.1, 0.0, 0.0, 2.0)
    assert look(hall=2.0).same == pytest.approx(0.201)


@pytest.mark.parametrize(
    ("volts", "off"), [(0.0099, True), (0.0101, False), (4.9901, True), (4.9899, False)]
)
def test_the_ends_of_the_scale(volts: float, off: bool) -> None:
    assert look(hall=volts).railed == (pytest.approx(0.051) if off else 0.0)
    last = SEEN._replace(hall=volts)  # a missing reading is as the last one
    assert look(last, hall=NAN).railed == (pytest.approx(0.051) if off else 0.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_pushes_without_a_count(sign: float) -> None:
    assert look(effort=sign * 3.6).pushed == pytest.approx(0.031)
    assert look(effort=sign * 3.59).pushed == 0.0
    assert look(effort=sign * 2.9).leant == pytest.approx(0.401)
    assert look(effort=sign * 2.89).leant == 0.0
    moved = look(effort=sign * 4.0, encoder=101.0)
    assert (moved.pushed, moved.leant) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("effort", "moved", "before", "after"),
    [
        (2.9, -3.0, 7.0, 10.0),  # against a push upward: they add up
        (2.9, -3.0, -7.0, 3.0),  # those against the other push are forgotten
        (2.9, 3.0, 7.0, 0.0),  # it goes along
        (2.9, 1.0, 7.0, 0.0),
        (-2.9, -1.0, -7.0, 0.0),
        (2.9, 0.0, 7.0, 7.0),
        (-2.9, 3.0, -7.0, -10.0),
        (-2.9, 3.0, 7.0, -3.0),
        (-2.9, -3.0, -7.0, 0.0),
        (-2.9, 0.0, -7.0, -7.0),
        (2.89, -3.0, 7.0, 7.0),  # no push
        (-2.89, 3.0, -7.0, -7.0),
    ],
)
def test_counts_against_the_push(effort: float, moved: float, before: float, after: float) -> None:
    s = look(SEEN._replace(against=before), effort, encoder=100.0 + moved)
    assert s.against == pytest.approx(after)


def test_noise_is_the_mean_square_of_second_differences() -> None:
    # second difference of (1, 2, 3.03) is 0.03; its square over 6, a hundredth of it taken in
    s = look(hall=3.03)
    square = 0.03 * 0.03 / 6.0
    assert s.noise == pytest.approx(0.0001 + (square - 0.0001) * 0.01)
    spike = look(hall=4.9)  # counts for no more than (4 guard.noise)^2
    assert spike.noise == pytest.approx(0.0001 + (0.1 * 0.1 - 0.0001) * 0.01)
    just = look(hall=3.0 + sensing.spike(P))
    assert just.noise == pytest.approx(spike.noise, rel=1e-12)
    below = look(hall=3.0 + 0.99 * sensing.spike(P))
    assert below.noise < just.noise
    assert look(SEEN._replace(before=NAN), hall=3.03).noise == 0.0001
    slow = sensing.look(P, SEEN, Sample(5.001, 100.0, 3.03, NAN, NAN, NAN), 0.0, 1.0)
    assert slow.noise == pytest.approx(square)  # never more than all of it


def test_time() -> None:
    s = look(SEEN._replace(stood=0.02), t=5.004)
    assert (s.time, s.passed, s.stood) == (5.004, pytest.approx(0.004), 0.0)
    s = look(SEEN._replace(stood=0.02), t=5.0)
    assert (s.time, s.passed, s.stood) == (5.0, 0.0, pytest.approx(0.021))
    s = look(SEEN._replace(stood=0.02), t=NAN)
    assert (s.time, s.passed, s.stood) == (pytest.approx(5.001), DT, pytest.approx(0.021))


CLEAN = look(UNSEEN)
JUST, OVER = 1.0 - 1e-9, 1.0 + 1e-9
CASES = {
    "encoder_age": (codes.ENCODER_SILENT, 0.005, 0.005),
    "hall_age": (codes.HALL_SILENT, 0.005, 0.005),
    "same": (codes.HALL_FROZEN, 0.5, 0.5),
    "jump": (codes.ENCODER_JUMP, 50.0, 50.0),
    "against": (codes.ENCODER_AGAINST, 250.0, 250.0),
    "passed": (codes.CLOCK, 0.1, 0.1),
    "stood": (codes.CLOCK_STANDS, 0.1, 0.1),
}


@pytest.mark.parametrize("name", CASES)
def test_each_limit_is_a_fault_from_there_on(name: str) -> None:
    code, at, limit = CASES[name]
    s = CLEAN._replace(possible=50.0)
    assert sensing.fault(P, s._replace(**{name: at}), 0.0) == (codes.OK, 0.0, 0.0)
    over = at * OVER
    assert sensing.fault(P, s._replace(**{name: over}), 0.0) == (code, over, limit)


def test_the_faults_with_more_to_them() -> None:
    s = CLEAN
    assert sensing.fault(P, s._replace(railed=0.1), 0.0)[0] == codes.OK
    assert sensing.fault(P, s._replace(railed=0.101), 0.0) == (codes.HALL_RANGE, 2.0, P.rail)
    assert sensing.fault(P, s._replace(pushed=0.25, leant=20.0), 3.7)[0] == codes.OK
    pushed = sensing.fault(P, s._replace(pushed=0.251, leant=0.3), 3.7)
    assert pushed == (codes.STUCK, 3.7, 0.3)
    assert sensing.fault(P, s._replace(leant=20.1, pushed=0.1), 3.0) == (codes.STUCK, 3.0, 20.1)
    assert sensing.fault(P, s._replace(passed=-1e-6), 0.0) == (codes.CLOCK, -1e-6, P.clock)
    back = sensing.fault(P, s._replace(against=-251.0), 0.0)
    assert back == (codes.ENCODER_AGAINST, 251.0, 250.0)
    assert sensing.fault(P, s._replace(noise=P.noise**2), 0.0)[0] == codes.OK
    loud = sensing.fault(P, s._replace(noise=0.03**2), 0.0)
    assert loud == (codes.HALL_NOISY, pytest.approx(30.0), 25.0)


@pytest.mark.parametrize(
    ("field", "fine", "doubtful", "word"),
    [
        ("hall_age", 0.005, 0.0051, "silent"),
        ("railed", 0.005, 0.0051, "out of range"),
        ("same", 0.019, 0.020, "repeats"),
        ("noise", 0.025**2, 0.0251**2, "noisy"),
    ],
)
def test_a_doubtful_hall_sensor(field: str, fine: float, doubtful: float, word: str) -> None:
    assert sensing.doubt(P, CLEAN._replace(**{field: fine}), DT) == 0
    assert word in sensing.DOUBTS[sensing.doubt(P, CLEAN._replace(**{field: doubtful}), DT)]


@pytest.mark.parametrize("encoder", [True, False])
@pytest.mark.parametrize("hall", [True, False])
def test_a_sensor_that_is_not_there_has_no_age(encoder: bool, hall: bool) -> None:
    every = Seen(*(float(k) for k in range(1, len(Seen._fields) + 1)))
    told = sensing.expecting(every, encoder, hall)
    assert told.encoder_age == (every.encoder_age if encoder else 0.0)
    assert told.hall_age == (every.hall_age if hall else 0.0)
    assert told._replace(encoder_age=2.0, hall_age=4.0) == every
