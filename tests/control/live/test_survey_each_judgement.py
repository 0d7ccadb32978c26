"""What the survey makes of laser and encoder that disagree, and how sure it is."""

from __future__ import annotations

import math

import pytest

from macromicro.control.live import edges, survey
from macromicro.control.live.survey import NOTHING

from .bench import DT, PITCH
from .surveys import (
    BASE,
    COUNT,
    KNOWN,
    NAN,
    OFFSET,
    PLACE,
    WHOLE,
    Q,
    anew,
    blurred,
    error,
    resting,
    same,
    shown,
)


@pytest.mark.parametrize(
    ("standing", "counts", "believed"),
    [(0.0, 4.9, True), (0.0, 5.1, False), (0.099, 4.9, True), (0.1, 1.4, True),
     (0.1, 1.6, False)],
)  # fmt: skip
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_leap_of_the_path_that_no_carriage_makes(
    standing: float, counts: float, believed: bool, sign: float
) -> None:
    """Of the gap to the encoder, and of the pace: 5 counts in a period, at rest 1.5."""
    way = sign * counts * PITCH
    v = resting(gap=0.3, pace=0.0)
    laser = WHOLE - BASE + 2.0 * (way + sign * 0.3 * PITCH)
    after = shown(v, laser=laser + 0.6 * PITCH * (sign < 0.0), standing=standing)
    assert same(after, anew(after.laser, 0, COUNT)) != believed
    # With the same step of gap or of pace in the period before it is no leap.
    assert shown(v._replace(pace=sign * 6.0 * PITCH), laser=laser).phase is not None
    assert edges.known(shown(v._replace(pace=way), laser=laser).phase or edges.unknown())
    assert edges.known(shown(v._replace(gap=sign * counts), laser=laser).phase or edges.unknown())


def test_edges_that_contradict_the_count_set_an_anchor() -> None:
    """The fifth in a row that is refused; until then none, and later ones change nothing."""
    v = resting(phase=KNOWN._replace(refused=4), counts=99.0, edge=98.0, gap=1.0)
    laser = WHOLE - BASE + PITCH
    after = shown(v, laser=laser, speed=100.0)
    assert after.phase is not None and after.phase.refused == 5
    assert after.anchor == edges.at(KNOWN, COUNT) and after.half == math.inf
    assert math.isnan(shown(v._replace(phase=KNOWN), laser=laser, speed=100.0).anchor)
    held = resting(anchor=PITCH, gap=-0.8)
    later = shown(held)
    place = 0.2 * PITCH + 1e-8 * (COUNT - 3.0) + 0.5e-8
    assert later.anchor == PITCH and later.gap == pytest.approx((place - PITCH) / PITCH, abs=1e-9)
    assert later.half == math.inf


@pytest.mark.parametrize(
    ("speed", "gap", "far"),
    [(0.0, 1.9, False), (0.0, 2.1, True), (0.0, -1.9, False), (0.0, -2.1, True),
     (1000.0, 2.9, False), (1000.0, 3.1, True), (-1000.0, 2.9, False), (-1000.0, -3.1, True)],
)  # fmt: skip
@pytest.mark.parametrize("awaited", [0, 9])
def test_how_long_the_two_have_been_apart(
    speed: float, gap: float, far: bool, awaited: int
) -> None:
    """By more than two counts, one more for each 1000 count/s; not while a reset is awaited."""
    at = WHOLE + gap * PITCH
    v = resting(laser=at - BASE, whole=at, path=PLACE + gap * PITCH, gap=gap, apart=0.03)
    after = shown(v._replace(awaited=awaited), laser=at - BASE + 1e-8, speed=speed)
    assert after.gap == pytest.approx(gap, abs=1e-3)
    assert after.apart == pytest.approx(0.03 + DT if far and not awaited else 0.0)


@pytest.mark.parametrize(("number", "anchor"), [(11, NAN), (12, NAN), (12, 0.0), (40, NAN)])
def test_the_half_width_is_that_of_laser_hall_sensor_and_phase(number: int, anchor: float) -> None:
    e = KNOWN._replace(number=number)
    half = Q.laser + Q.hall + Q.factor * error(e, 55.0)
    if number < Q.needed or not math.isnan(anchor):
        half = math.inf
    assert survey.rebase(Q, resting(phase=e, anchor=anchor), 55.0).half == pytest.approx(half)
    assert survey.rebase(Q, NOTHING, 55.0) == NOTHING


def test_the_position_by_laser() -> None:
    v = resting()
    place = WHOLE - (0.2 * PITCH + 1e-8 * (OFFSET - 3.0)) - OFFSET * PITCH
    assert survey.whole(v, PITCH, OFFSET) == pytest.approx(place, abs=1e-15)
    assert math.isnan(survey.whole(NOTHING, PITCH, OFFSET))


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("sigma", "off", "told"),
    [(0.1, 0.75, False), (0.1, 0.85, True), (10.0, 0.95, False), (10.0, 1.05, True)],
)
def test_the_laser_contradicts_beyond_half_a_count_and_three_standard_errors(
    sign: float, sigma: float, off: float, told: bool
) -> None:
    """And of the phase no more than half a count."""
    v = resting(phase=KNOWN._replace(aa=(sigma * PITCH) ** 2, ab=0.0, bb=0.0))
    place = survey.whole(v, PITCH, OFFSET)
    wide = survey.contradiction(v, place + sign * off * PITCH, PITCH, OFFSET)
    assert wide == pytest.approx((off + 1.0) * PITCH if told else 0.0)


def test_homing_again_allows_for_counts_lost() -> None:
    v = resting()
    assert survey.again(v, PITCH) == v._replace(phase=blurred(KNOWN, PITCH**2))
    assert survey.again(v._replace(apart=0.5), PITCH) == NOTHING
    assert survey.again(v._replace(anchor=0.0), PITCH) == NOTHING
    assert survey.again(NOTHING, PITCH) == NOTHING
