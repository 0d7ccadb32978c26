"""Corrections of readings, set points and efforts along the travel."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.control import correction
from macromicro.control.correction import Correction, Flank, Load, Tables, Turn
from macromicro.control.stage_law import Target
from macromicro.errors import InputError
from macromicro.schema import config

LOAD = Load(0.5, 5.0, 2.0, 0.0, math.inf, 1e-6, 0.3)
WAVY = Correction(
    low=0.0,
    high=0.1,
    up=(-30e-6, 10e-6, -20e-6, 0.0),
    down=(25e-6, 60e-6, 20e-6, 40e-6),
    period=5e-3,
    waves=(30e-6, -10e-6, 5e-6, 2e-6),
    expansion=12e-6,
    stop=2e-6,
)
UP, DOWN = Flank(1.0, 1.0, 1.0), Flank(-1.0, 0.0, 0.0)
places = st.floats(-0.02, 0.12)


def tables(of: Correction = WAVY, load: Load = LOAD) -> Tables:
    return correction.tables(of, load)


def still(x: float) -> Target:
    return Target(x, 0.0, 0.0, math.inf)


def aimed(p: Tables, s: Flank, target: Target, t: float = 0.0, degrees: float = math.nan) -> Target:
    return correction.aimed(p, s, target, (target.position,), (target.velocity,), degrees, t)[1]


@given(places, st.sampled_from([UP, DOWN]), st.sampled_from([math.nan, 20.0, 35.0]))
def test_the_reading_of_a_set_point_is_at_that_position(
    x: float, flank: Flank, degrees: float
) -> None:
    p = tables(WAVY._replace(stop=0.0))
    reading = aimed(p, flank, still(x), degrees=degrees).position
    back = correction.position(p, flank, reading, (reading,), degrees, 0.0)
    assert back == pytest.approx(x, abs=1e-10)


@given(places)
def test_between_the_values_it_is_smooth_and_its_derivatives_are_true(x: float) -> None:
    p, h = tables(), 1e-6
    low, high = (correction.deviation(p, x + k * h, 1.0, 1e-5) for k in (-1, 1))
    here = correction.deviation(p, x, 1.0, 1e-5)
    edge = any(abs(x - k * p.step) <= 2.0 * h for k in range(4))  # the curvature jumps there
    assert here[1] == pytest.approx((high[0] - low[0]) / (2.0 * h), abs=1e-2 if edge else 1e-5)
    if not edge:
        assert here[2] == pytest.approx((high[1] - low[1]) / (2.0 * h), rel=1e-3, abs=1e-2)


@given(st.floats(0.005, 0.095), st.floats(-0.3, 0.3), st.floats(-4.0, 4.0))
def test_speeds_and_accelerations_of_readings_fit_their_positions(
    x: float, v: float, a: float
) -> None:
    p, h = tables(), 1e-5
    flank = Flank(math.copysign(1.0, v), 0.3, 0.3) if v else UP

    def at(t: float) -> Target:
        target = Target(x + v * t + 0.5 * a * t * t, 0.0, 0.0, math.inf)
        # Velocity 1e-9: too slow to have a direction, so the flank stays.
        slow = target._replace(velocity=1e-9)
        return aimed(p, flank, slow)

    moved = correction.aimed(
        p._replace(slow=10.0), flank, Target(x, v, a, math.inf), (x,), (v,), math.nan, 0.0
    )[1]
    before, now, after = (at(k * h).position for k in (-1, 0, 1))
    assert moved.velocity == pytest.approx((after - before) / (2.0 * h), abs=2e-4)
    assert moved.acceleration == pytest.approx((after - 2.0 * now + before) / h**2, abs=2.0)


def test_at_a_reversal_the_drive_crosses_its_backlash_within_its_acceleration() -> None:
    p = tables(Correction(up=(-25e-6,) * 2, down=(25e-6,) * 2))
    s, rows = UP, []
    for k in range(400):
        t = k * 1e-4
        target = Target(0.05 - 0.01 * t, -0.01, 0.0, math.inf)
        s, aim = correction.aimed(p, s, target, (target.position,), (-0.01,), math.nan, t)
        rows.append((aim.position - target.position, aim.velocity + 0.01, aim.acceleration))
    off, speed, push = np.array(rows).T
    assert off[0] == pytest.approx(25e-6) and off[-1] == pytest.approx(-25e-6)
    assert np.all(np.diff(off) <= 1e-12)  # it never turns back
    assert np.max(np.abs(push)) <= 5.0 * (1.0 + 1e-9)
    assert np.max(np.abs(np.diff(off))) < 50e-6 / 20  # no jump
    assert np.cumsum(speed)[-1] * 1e-4 == pytest.approx(-50e-6, rel=0.02)
    assert s.aimed == 0.0 and s.direction == -1.0


def test_a_load_that_ran_ahead_is_pushed_to_its_target_from_behind() -> None:
    p = tables(Correction(up=(-25e-6,) * 2, down=(25e-6,) * 2))
    braking = Target(0.05, 0.1, -5.0, math.inf)  # harder than its friction brakes: 2 m/s^2
    s, _ = correction.aimed(p, UP, braking, (0.05,), (0.1,), math.nan, 0.0)
    assert s.aimed == 0.0 and s.direction == 1.0
    softly = braking._replace(acceleration=-1.0)  # it stays there, it will not come back
    s, aim = correction.aimed(p, s, softly, (0.05,), (0.1,), math.nan, 0.1)
    assert s.aimed == 0.0
    spare = 3.0 * LOAD.pitch  # it must not be pushed back
    assert aim.position == pytest.approx(0.05 - 25e-6 - spare)
    rest = still(0.05)
    s, _ = correction.aimed(p, s, rest, (0.05,), (0.0,), math.nan, 0.2)
    assert s.pushed > 0.0 and s.aimed == 1.0
    speeds = []
    for k in range(1000):
        _, aim = correction.aimed(p, s, rest, (0.05,), (0.0,), math.nan, 0.2 + k * 1e-4)
        left = 0.05 + 25e-6 - aim.position
        # A load that bounces off at twice the speed slides on no farther than the drive itself.
        if k * 1e-4 > 0.5 * s.length and left > 1e-9:
            assert (2.0 * aim.velocity) ** 2 / (2.0 * LOAD.coast) <= left * (1.0 + 1e-6)
        speeds.append(aim.velocity)
    assert aim.position == pytest.approx(0.05 + 25e-6) and min(speeds) >= 0.0


def test_while_it_pushes_the_position_is_behind_and_the_laws_friction_is_off() -> None:
    p = tables(Correction(up=(-25e-6,) * 2, down=(25e-6,) * 2))
    s = Flank(1.0, 0.0, 1.0, -3e-6, 0.0, 1.0, 0.02, 0.5)
    early = correction.position(p, s, 0.05, (0.05,), math.nan, 1.001)
    assert early == pytest.approx(0.05 - 25e-6)
    up = Target(0.05, 0.001, 0.0, math.inf)
    assert correction.effort(p, s, up, up, 0.05, 1.001) == pytest.approx(-LOAD.friction)
    assert correction.effort(p, s, up, up, 0.05, 1.021) == 0.0


@pytest.mark.parametrize("load", [LOAD._replace(weight=9.8), LOAD._replace(coast=math.inf)])
def test_a_weight_keeps_a_load_on_its_flank_however_it_is_braked(load: Load) -> None:
    braking = Target(0.05, 0.1, -5.0, math.inf)
    s, _ = correction.aimed(tables(load=load), UP, braking, (0.05,), (0.1,), math.nan, 0.0)
    assert s.aimed == 1.0


def test_without_a_known_place_nothing_is_corrected() -> None:
    p = tables()._replace(origin=math.nan)
    target = Target(0.03, 0.1, 1.0, 0.2)
    assert aimed(p, UP, target) == target
    assert correction.position(p, UP, 0.03, (0.03,), 30.0, 0.0) == 0.03
    assert correction.effort(p, UP, target, target, 0.03, 0.0) == 0.0
    assert math.isnan(correction.position(tables(), UP, math.nan, (math.nan,), 20.0, 0.0))


@given(places, st.floats(-0.05, 0.05))
def test_places_count_from_the_machines_zero(x: float, zero: float) -> None:
    at_zero, moved = tables(), tables()._replace(origin=zero)
    here = aimed(at_zero, UP, still(x)).position
    there = aimed(moved, UP, still(x + zero)).position
    assert there - zero == pytest.approx(here, abs=1e-12)


def test_growth_counts_from_the_place_that_stays() -> None:
    p = tables(Correction(expansion=1e-5, fixed=0.02, temperature=20.0))
    for x, degrees, grown in ((0.07, 30.0, 5e-6), (0.02, 30.0, 0.0), (0.07, 20.0, 0.0)):
        place = correction.position(p, UP, x, (x,), degrees, 0.0)
        assert place - x == pytest.approx(grown, abs=1e-15)


def test_a_stage_without_a_temperature_sensor_grows_with_the_time_since_its_start() -> None:
    p = tables(Correction(warm_up=1e-4, warm_time=120.0, fixed=0.02))
    for t in (0.0, 120.0, 3600.0):
        grown = 1e-4 * (1.0 - math.exp(-t / 120.0)) * 0.05
        place = correction.position(p, UP, 0.07, (0.07,), math.nan, t)
        assert place - 0.07 == pytest.approx(grown, abs=1e-15)
        assert aimed(p, UP, still(place), t).position == pytest.approx(0.07, abs=1e-10)


def test_the_place_of_another_axis_counts_with_its_speed() -> None:
    square = Correction(other="y", across_high=0.1, across=(0.0, 10e-6))
    p = correction.tables(square, LOAD, ("x", "y"))
    assert p.other == 1
    place = correction.position(p, UP, 0.03, (0.03, 0.05), math.nan, 0.0)
    assert place - 0.03 == pytest.approx(5e-6)
    target = Target(0.03, 0.0, 0.0, math.inf)
    _, aim = correction.aimed(p, UP, target, (0.03, 0.05), (0.0, 0.1), math.nan, 0.0)
    assert aim.position == pytest.approx(0.03 - 5e-6)
    assert aim.velocity == pytest.approx(-0.1 * 1e-4)


def test_efforts_follow_the_direction() -> None:
    p = tables(
        Correction(
            effort_up=(0.1, 0.3), effort_down=(-0.2, -0.2), effort_period=4e-3,
            effort_waves=(0.05, 0.0),
        )
    )  # fmt: skip
    wave = 0.05 * math.sin(2.0 * math.pi * 0.051 / 4e-3)
    middle = 0.1 + 0.2 * 0.51  # two values are a line
    for velocity, own in ((0.1, middle), (-0.1, -0.2), (0.0, 0.5 * (middle - 0.2))):
        target = Target(0.05, velocity, 0.0, math.inf)
        found = correction.effort(p, UP, target, target, 0.051, 0.0)
        assert found == pytest.approx(own + wave)


def turned_back() -> list[tuple[float, float]]:
    """Speeds and efforts while a set point turns from 0.02 m/s to the other direction."""
    p = tables(Correction(turn_effort=0.2, turn_damping=30.0, turn_way=10e-6))
    s, rows = UP._replace(turn=Turn(0.0)), []
    for k in range(300):
        t = k * 1e-4
        target = Target(0.02 * t - t * t, 0.0199 - 2.0 * t, -2.0, math.inf)
        s, aim = correction.aimed(p, s, target, (target.position,), (0.0,), math.nan, t)
        effort = correction.effort(p, s, target, aim, aim.position, t)
        rows.append((target.velocity, effort))
    return rows


def test_where_a_motion_turns_back_friction_turns_round_gradually() -> None:
    rows = turned_back()
    after = [effort for speed, effort in rows if speed < 0.0]
    assert all(effort == 0.0 for speed, effort in rows if speed > 0.0)
    # Just turned, the effort is off; then the speed's share outweighs it, until both have faded.
    assert after[0] == pytest.approx(0.2, rel=0.02)
    assert min(after) < -0.005 and abs(after[-1]) < 1e-6
    assert max(abs(b - a) for a, b in pairwise(after)) < 0.02  # no jump


def test_a_motion_that_begins_at_rest_does_not_turn_back() -> None:
    p = tables(Correction(turn_effort=0.2, turn_damping=30.0, turn_way=10e-6))
    s, _ = correction.aimed(p, UP, still(0.05), (0.05,), (0.0,), math.nan, 0.0)
    for k in range(1, 50):
        t = k * 1e-4
        target = Target(0.05 - t * t, -2.0 * t, -2.0, math.inf)
        s, aim = correction.aimed(p, s, target, (0.05,), (0.0,), math.nan, t)
        assert correction.effort(p, s, target, aim, 0.05, t) == 0.0


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("high", -0.1, "above"),
        ("down", (0.0, 0.0, 0.0), "as many as up"),
        ("effort_down", (0.0,), "as many as effort_up"),
        ("waves", (1e-6,), "pairs"),
        ("across", (0.0,), "two values"),
        ("up", (0.0, 0.05), "slopes below"),
        ("waves", (1e-3, 0.0), "slopes below"),
    ],
)
def test_tables_that_cannot_be_are_refused_by_name(key: str, value: object, words: str) -> None:
    broken = Correction(down=(0.0, 0.0))._replace(**{key: value})
    with pytest.raises(InputError, match=words):
        config.check(broken, "calibration.toml")
