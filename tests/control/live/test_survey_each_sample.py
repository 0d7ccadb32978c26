"""The survey sample by sample: what one more reading of the three sensors makes of it."""

from __future__ import annotations

import math

import pytest

from macromicro.control.live import edges, survey
from macromicro.control.live.edges import Phase
from macromicro.control.live.parameters import Edges
from macromicro.control.live.survey import NOTHING, Moving
from macromicro.types import Sample

from .bench import DT, PITCH
from .surveys import (
    BASE,
    COUNT,
    FINE,
    KNOWN,
    NAN,
    OFFSET,
    PLACE,
    UNKNOWN,
    WHOLE,
    Q,
    anew,
    blurred,
    error,
    resting,
    same,
    shown,
)

DRIFTED = blurred(KNOWN, Q.drift**2 * DT)
HALF = Q.laser + Q.hall + Q.factor * error(DRIFTED, OFFSET)


@pytest.mark.parametrize("step", [1e-8, -1e-5, 0.4 * PITCH])
def test_a_sample_moves_path_pace_and_gap(step: float) -> None:
    """The path is the mean over the period, so half of the laser's step."""
    after = shown(resting(), laser=WHOLE - BASE + step)
    assert same(
        after,
        resting(
            phase=DRIFTED, laser=WHOLE - BASE + step, held=COUNT, whole=WHOLE + step, hall=0.7,
            path=PLACE + 0.5 * step, pace=0.5 * step, gap=0.5 * step / PITCH, slow=3.0 + DT,
            half=HALF,
        ),
    )  # fmt: skip


@pytest.mark.parametrize("lag", [3e-3, 1.5, 0.0])
@pytest.mark.parametrize("drawn", [0.4e-3, 0.47e-3, -0.1e-3])
def test_the_path_has_no_part_of_a_contraction_that_lags(lag: float, drawn: float) -> None:
    """The Hall sensor follows the contraction `drawn` [m] of the period with its lag."""
    keep = math.exp(-DT / lag) if lag else 0.0
    laser = WHOLE - BASE + 2.0 * (drawn - FINE) + 1e-8  # in the mean over the period
    after = shown(resting(), Q._replace(lag=lag), laser=laser, fine=drawn + (FINE - drawn) * keep)
    assert after.path == pytest.approx(PLACE + 0.5e-8, abs=1e-12)
    assert after.pace == pytest.approx(0.5e-8, abs=1e-12)


@pytest.mark.parametrize(("speed", "slow"), [(0.0, 3.001), (400.0, 3.001), (-400.0, 3.001),
                                             (401.0, 0.0), (-401.0, 0.0)])  # fmt: skip
def test_how_long_the_carriage_has_been_slow(speed: float, slow: float) -> None:
    assert shown(resting(), speed=speed).slow == pytest.approx(slow)


@pytest.mark.parametrize(
    ("q", "laser"),
    [(Q._replace(use=0), 0.01), (Q, NAN), (Q, 1e3), (Q, -1e3), (Q, 5e5), (Q, -math.inf)],
)
def test_without_a_laser_nothing_is_known(q: Edges, laser: float) -> None:
    assert same(shown(resting(), q, laser=laser), UNKNOWN)
    assert same(shown(resting(), q, laser=laser), anew(NAN, 0, NAN))
    sample = Sample(0.0, COUNT, 0.7, laser, 1.0, 0.0)
    assert survey.look(q, PITCH, NOTHING, sample, Moving(0.0, 0.0, 0.0, 0.0), DT) == NOTHING
    assert (NOTHING.base, NOTHING.awaited, NOTHING.same, NOTHING.hall_same) == (0.0, 0, 0, 0)
    assert (NOTHING.slow, NOTHING.gap, NOTHING.apart, NOTHING.half) == (0.0, 0.0, 0.0, math.inf)


def test_a_place_of_almost_a_kilometre_is_a_reading() -> None:
    assert shown(UNKNOWN, laser=999.0).laser == 999.0


@pytest.mark.parametrize(
    ("periods", "held", "known", "stands"),
    [(2, 98.0, True, True), (2, COUNT, True, False), (1, 98.0, True, False),
     (2, COUNT, False, True), (1, 98.0, False, False)],
)  # fmt: skip
def test_a_laser_that_repeats_itself_while_counts_pass_is_none(
    periods: int, held: float, known: bool, stands: bool
) -> None:
    """Three times the same. While nothing is known yet, a count need not pass."""
    laser = WHOLE - BASE
    v = resting(same=periods, held=held) if known else anew(laser, periods, held)
    after = shown(v, laser=laser)
    assert (after.same, after.held) == (periods + 1, held)
    assert same(after, anew(laser, periods + 1, held)) == stands


def test_another_reading_of_the_laser_ends_its_repeating() -> None:
    after = shown(resting(same=2, held=98.0))
    assert (after.same, after.held) == (0, COUNT)


@pytest.mark.parametrize(("hall", "before", "repeats"), [(0.61, 4, 5), (0.62, 4, 0), (0.61, 0, 1)])
def test_how_long_the_hall_sensor_has_repeated_itself(
    hall: float, before: int, repeats: int
) -> None:
    after = shown(resting(hall_same=before), hall=hall)
    assert (after.hall_same, after.hall) == (repeats, hall)


@pytest.mark.parametrize("missing", [{"count": NAN}, {"hall": NAN}, {"hall": 0.61}])
def test_without_a_count_or_a_living_hall_sensor_it_is_not_judged(
    missing: dict[str, float],
) -> None:
    """The base, the phase and what was told of it stay; nothing is apart meanwhile."""
    v = resting(hall_same=19, gap=0.3, apart=0.04, pace=1e-7)
    after = shown(v, **missing)
    repeats = 20 if missing.get("hall") == 0.61 else 0
    assert same(
        after,
        v._replace(
            laser=WHOLE - BASE + 1e-8, held=missing.get("count", COUNT), counts=NAN, path=NAN,
            hall=missing.get("hall", 0.7), hall_same=repeats, apart=0.0,
        ),
    )  # fmt: skip
    assert shown(resting(hall_same=18), hall=0.61).counts == COUNT  # 19 in a row may be


@pytest.mark.parametrize("speed", [100.0, 500.0])
def test_the_first_two_complete_samples_in_a_row_begin_a_phase(speed: float) -> None:
    """If the carriage is slow; half a pitch either way is as likely."""
    first = shown(UNKNOWN, count=99.0, laser=0.2, fine=FINE, speed=100.0)
    assert same(
        first,
        UNKNOWN._replace(laser=0.2, held=99.0, counts=99.0, whole=0.2, fine=FINE, hall=0.7,
                         slow=DT),
    )  # fmt: skip
    second = shown(first, count=100.0, laser=0.2 + PITCH, fine=FINE, speed=speed)
    path = 0.2 + 0.5 * PITCH - FINE
    begun = edges.unknown()
    if speed <= Q.fastest:
        begun = Phase(
            100.0, path - 99.5 * PITCH, 0.0, PITCH**2 / 12.0, 0.0, (Q.scale * PITCH) ** 2, 0, 0
        )
    assert same(
        second,
        first._replace(phase=begun, laser=0.2 + PITCH, held=100.0, counts=100.0, hall_same=1,
                       whole=0.2 + PITCH, slow=2.0 * DT if speed <= Q.fastest else 0.0),
    )  # fmt: skip
    assert math.isnan(second.path)


def test_the_sample_after_a_missing_one_only_begins_anew_to_compare() -> None:
    v = resting(counts=NAN, path=NAN)
    after = shown(v)
    assert same(after, v._replace(laser=WHOLE - BASE + 1e-8, held=COUNT, counts=COUNT,
                                  whole=WHOLE + 1e-8, hall=0.7, slow=3.001))  # fmt: skip


@pytest.mark.parametrize(
    ("before", "now", "came"),
    [(0.03, 0.001, True), (0.03, -0.001, True), (-0.03, 0.001, True), (-0.03, -0.001, True),
     (0.03, 0.029, False), (-0.03, -0.031, False), (0.03, 0.031, False), (-0.03, -0.029, False)],
)  # fmt: skip
@pytest.mark.parametrize("awaited", [0, 1, 2, 200])
def test_a_reset_that_is_awaited_has_come_where_the_reading_is_nearer_to_zero(
    before: float, now: float, came: bool, awaited: int
) -> None:
    """Nearer than to the reading before. The base takes up what the laser has lost by it."""
    v = resting(laser=before, awaited=awaited)
    after = survey._beam(Q, v, Sample(0.0, COUNT, 0.7, now, 1.0, 0.0))
    if awaited and came:
        phase, base, left = blurred(KNOWN, Q.reset**2), BASE + before, 0
    else:
        phase, base, left = KNOWN, BASE, max(awaited - 1, 0)
    assert same(after, v._replace(phase=phase, laser=now, base=base, awaited=left, held=COUNT,
                                  hall=0.7))  # fmt: skip


@pytest.mark.parametrize("awaited", [1, 2, 3])
def test_a_reset_that_never_came_makes_the_survey_begin_anew(awaited: int) -> None:
    after = shown(resting(awaited=awaited))
    assert same(after, anew(WHOLE - BASE + 1e-8, 0, COUNT)) == (awaited == 1)
    assert awaited == 1 or after.awaited == awaited - 1


def test_a_reset_may_come_in_the_last_period_awaited() -> None:
    after = shown(resting(awaited=1), laser=1e-7)
    assert after.base == BASE + (WHOLE - BASE) and after.awaited == 0
    assert after.path == pytest.approx(PLACE + 0.5e-7, abs=1e-12)
