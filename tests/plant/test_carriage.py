"""The macro-stage in motion: claims M1-M3b (Sections 4.2.3, 4.2.5) and the laws of mechanics."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.plant import carriage, friction, motor
from macromicro.plant.friction import Friction

from .drives import COUNT, DT, MACRO, energy, lifted, motor_volts, ride

DRY = MACRO._replace(friction=MACRO.friction._replace(ripple=0.0))


def counts(x: np.ndarray) -> np.ndarray:
    """Encoder counts of positions [m]."""
    return np.floor(x / COUNT)


def speed(effort: float, seconds: float) -> float:
    """Mean speed [counts/s] of the later half of steps in both directions (Section 4.2.5)."""
    n = round(seconds / DT)
    found = []
    for way, place in ((1.0, 0.5), (-1.0, 2799.5), (1.0, 60.5), (-1.0, 2740.5)):
        run = ride(np.full(n, motor_volts(way * lifted(effort))), carriage.at_rest(place * COUNT))
        moved = counts(run.x)
        found.append(way * (moved[-1] - moved[n // 2]) / ((n - 1 - n // 2) * DT))
    return float(np.mean(found))


@pytest.mark.parametrize(
    ("effort", "seconds", "expected", "tolerance"),
    [(0.1, 1.35, 1700.0, 0.04), (1.0, 0.65, 3977.0, 0.04), (2.0, 0.4, 6507.0, 0.06)],
)
def test_steady_speeds_of_the_identification_runs(
    effort: float, seconds: float, expected: float, tolerance: float
) -> None:
    """Section 4.2.5 (M2, M3, M3b): 3.1, 4 and 5 V at the D/A after the dead-zone inverse."""
    assert speed(effort, seconds) == pytest.approx(expected, rel=tolerance)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_nothing_moves_at_2_5_volts(way: float) -> None:
    """Section 4.2.3: the carriage stays within its bristles, wherever it starts."""
    for place in np.arange(20.0, 2800.0, 139.0):
        x0 = place * COUNT
        run = ride(np.full(500, way * motor_volts(2.5)), carriage.at_rest(x0))
        assert abs(run.x[-1] - x0) < 1.5 * COUNT
        assert abs(run.v[-1]) < 1e-6


def crosses(da: float) -> bool:
    """Does `da` [V] carry the stage to the far end from every start, both ways, never standing?"""
    for way in (1.0, -1.0):
        for place in np.arange(0.5, 2500.0, 99.0):
            x0 = (place if way > 0.0 else 2800.0 - place) * COUNT
            run = ride(np.full(2600, way * motor_volts(da)), carriage.at_rest(x0))
            after = way * (run.x - x0) > (2750.0 - place) * COUNT
            if not after.any():
                return False
            moving = way * run.v[100 : int(np.argmax(after))]
            if moving.size and moving.min() < 100.0 * COUNT:
                return False
    return True


def test_dead_zone_is_three_volts() -> None:
    """Section 4.2.3 (M1): lowest voltage that goes through from every start: 3 +-0.15 V."""
    grid = np.round(np.arange(2.80, 3.21, 0.025), 3)
    through = [da for da in grid if crosses(float(da))]
    assert through, "no voltage up to 3.2 V goes through"
    assert through[0] == pytest.approx(3.0, abs=0.15)
    assert grid[-len(through)] == through[0]  # and every higher voltage does too


def test_motion_below_the_dead_zone_depends_on_the_place() -> None:
    """Section 4.2.3: irregular below 3 V: some starts go, some stick."""
    moved = []
    for place in np.arange(0.5, 2000.0, 57.0):
        run = ride(np.full(400, motor_volts(2.85)), carriage.at_rest(place * COUNT))
        moved.append(run.x[-1] - place * COUNT > 100.0 * COUNT)
    assert 0.1 < np.mean(moved) < 0.9


@pytest.mark.parametrize("effort", [0.3, 1.0, 2.0])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_halving_the_step_moves_the_arrival_by_at_most_one_count(effort: float, way: float) -> None:
    """A move of 0.7 s: driven for 0.4 s, then braked by friction alone."""
    da = way * lifted(effort)
    volts = np.r_[np.full(400, motor_volts(da)), np.zeros(300)]
    start = carriage.at_rest((200.5 if way > 0.0 else 2599.5) * COUNT)
    ends = [ride(volts, start, substeps=n) for n in (20, 40)]
    assert abs(counts(ends[0].x)[-1] - counts(ends[1].x)[-1]) <= 1
    assert abs(ends[0].x[-1] - ends[1].x[-1]) < COUNT
    assert np.ptp(ends[0].x[-100:]) < 0.1 * COUNT  # only the belt still rocks it
    assert abs(ends[0].x[-1] - start.x) > 300.0 * COUNT


@given(st.lists(st.floats(-20.0, 20.0), min_size=1, max_size=8), st.floats(0.02, 0.18))
@settings(max_examples=25, deadline=None)
def test_energy_balance(volts: list[float], x0: float) -> None:
    """Electrical work = heat in the winding and by friction + what is stored; never less.

    Stored: kinetic energy of carriage and mode, bristle, belt, inductance. What is left
    over was rubbed away, so it cannot be negative, apart from the step's error.
    """
    fine = 200
    drive = np.repeat(volts, 12)
    start = carriage.at_rest(x0)
    # A substep a period, so that every current and speed is seen.
    run = ride(np.repeat(drive, fine), start, substeps=1, dt=DT / fine)
    h = DT / fine
    u = np.repeat(drive, fine)
    p = MACRO
    given_ = float(np.sum(u * run.i) * h)
    joule = float(np.sum(p.motor.resistance * run.i * run.i) * h)
    viscous = float(np.sum(p.friction.viscous * run.v * run.v) * h)
    mass = p.carriage.mass
    mode = p.belt.participation * mass
    stored = (
        0.5 * mass * run.v[-1] ** 2
        + 0.5 * mode * (run.qv[-1] + run.v[-1]) ** 2
        + energy(p.belt, mass, run.q[-1], 0.0)
        + 0.5 * p.friction.bristle * run.z[-1] ** 2
        + 0.5 * p.motor.inductance * run.i[-1] ** 2
    )
    rubbed = given_ - joule - viscous - stored
    way = float(np.sum(np.abs(run.v)) * h)
    spread = friction.level(p.friction, 0.0, p.friction.ripple)
    error = 0.004 * (abs(given_) + joule + stored) + 1e-9
    assert -error <= rubbed <= spread * way + 0.01 * joule + error


def test_coasting_loses_speed_and_never_turns() -> None:
    """No voltage: kinetic energy falls until the carriage stands."""
    start = carriage.at_rest(0.05)._replace(v=0.4)
    run = ride(np.zeros(400), start)
    assert np.all(np.diff(run.v[:11]) < 0.0)
    assert run.v.min() > -0.01
    assert np.ptp(run.x[-100:]) < 0.1 * COUNT
    assert run.x[-1] > 0.05


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_end_stops_hold_full_voltage(way: float) -> None:
    """Section 4.3.3: the way ends after 3000 counts; the carriage comes to rest in the rubber.

    Not deeper than motor and friction together can hold the stop's spring.
    """
    p = MACRO.carriage
    run = ride(np.full(3000, 20.0 * way), carriage.at_rest(0.1))
    edge = p.stop_high if way > 0.0 else p.stop_low
    force = motor.force(MACRO.motor, 20.0 / MACRO.motor.resistance)
    rub = friction.level(MACRO.friction, 0.0, MACRO.friction.ripple)
    depth = way * (run.x - edge)
    assert depth[-1] > 0.0
    assert depth.max() < 5e-3
    assert depth[-1] <= (force + rub) / p.stop_stiffness
    assert abs(run.v[-1]) < 1e-3
    assert p.stop_high / COUNT == pytest.approx(3000.0, abs=1.0)


def test_a_stop_gives_back_less_than_it_took() -> None:
    """Thrown against the stop at 0.5 m/s, the carriage comes back slower."""
    start = carriage.at_rest(MACRO.carriage.stop_high - 0.002)._replace(v=0.5)
    free = MACRO._replace(friction=Friction(coulomb=0.0, stribeck=0.0, ripple=0.0, viscous=0.0))
    run = ride(np.zeros(60), start, p=free)
    assert -0.5 < run.v.min() < -0.05


def test_steady_slope_without_friction_is_the_viscous_gain() -> None:
    """(4.2): K_a K_t r / (B R + K_t K_b): about 2530 counts/s more for every D/A volt."""
    ends = [ride(np.full(300, motor_volts(da)), carriage.at_rest(0.01), p=DRY) for da in (3.5, 4.5)]
    slope = (ends[1].v[-1] - ends[0].v[-1]) / COUNT
    k, r, b = (
        MACRO.motor.constant / MACRO.motor.pulley,
        MACRO.motor.resistance,
        DRY.friction.viscous,
    )
    assert slope == pytest.approx(4.0 * k / (b * r + k * k) / COUNT, rel=0.01)
    assert slope == pytest.approx(2530.0, rel=0.03)
