"""What the kiln shows of its state, and what a step does to it."""

from __future__ import annotations

import math

import pytest

from macromicro.plant import encoder, wire
from macromicro.plant.bench import Bench
from macromicro.thesis import kiln_bench
from macromicro.thesis.kiln_bench import KilnBench, KilnNoise, KilnState

SPEC = KilnBench()
KILN = kiln_bench.prepare(SPEC)
OVEN = SPEC.oven


def hot(**changed: float) -> KilnState:
    s = kiln_bench.initial(KILN)._replace(air=80.0, thermocouple=74.0)
    alloy = wire.tempered(KILN.wire, KILN.load, KILN.table, s.wire, 70.0)
    return s._replace(wire=alloy)._replace(**changed)


def test_a_kiln_begins_at_the_rooms_temperature() -> None:
    s = kiln_bench.initial(KILN)
    assert s[:4] == (OVEN.ambient, OVEN.ambient, 0.0, 0.0)
    assert KILN.load == (OVEN.weight, 0.0, 0.0)
    other = kiln_bench.with_bench(Bench()._replace(thermal=Bench().thermal._replace(ambient=19.0)))
    assert other.oven == OVEN._replace(ambient=19.0) and other.encoder.pitch == 14e-6


@pytest.mark.parametrize("n0", [0.0, 2.0, -2.0])
def test_the_thermocouple_shows_interference_and_noise(n0: float) -> None:
    m = kiln_bench.measure(KILN, hot(spike=-6.0), 3.0, KilnNoise(n0))
    assert m[:2] == (3.0, pytest.approx(74.0 - 6.0 + 0.12 * n0))
    x = hot().wire.x
    assert m.encoder == encoder.count(KILN.encoder, x + 0.5 * 14e-6)


@pytest.mark.parametrize("heater", [0.0, 1.0])
@pytest.mark.parametrize("dt", [0.01, 2.0])
def test_air_thermocouple_and_wires_follow_one_another(heater: float, dt: float) -> None:
    """Newton's cooling of the air; first-order lags, exact over a step, behind it."""
    new = kiln_bench.advance(KILN, hot(), heater, KilnNoise(0.0, 1.0, 0.0), dt)
    loss = (80.0 - OVEN.ambient) / OVEN.loss_time
    air = 80.0 + dt * (OVEN.power * heater - loss)
    assert new.air == pytest.approx(air)
    couple = air + (74.0 - air) * math.exp(-dt / OVEN.thermocouple_lag)
    assert new.thermocouple == pytest.approx(couple)
    there = OVEN.ambient + (1.0 - OVEN.gradient) * (air - OVEN.ambient)
    wires = there + (70.0 - there) * math.exp(-dt / OVEN.wire_lag)
    assert new.wire.temperature == pytest.approx(wires)


# A share 0.5 erfc(n / sqrt 2) of all draws lies above n: 2e-4 of them above 3.5401.
@pytest.mark.parametrize(("n1", "begins"), [(3.53, False), (3.55, True)])
@pytest.mark.parametrize(("n2", "height"), [(0.5, 0.9), (-0.5, -0.9), (2.0, 1.5), (-1.0, -1.1)])
def test_interference_begins_as_often_as_its_rate_says(
    n1: float, begins: bool, n2: float, height: float
) -> None:
    """0.02 times a second: with a chance of 2e-4 in 0.01 s. Height and length are drawn: 0.7 and
    0.4 |n| of the typical height, 1 s and |n| s."""
    new = kiln_bench.advance(KILN, hot(), 0.0, KilnNoise(0.0, n1, n2), 0.01)
    assert new.spike == pytest.approx(9.0 * height if begins else 0.0)
    assert new.left == pytest.approx(1.0 + abs(n2) if begins else 0.0)


@pytest.mark.parametrize(("left", "goes_on"), [(0.011, True), (0.009, False), (0.01, False)])
def test_interference_lasts_for_its_time(left: float, goes_on: bool) -> None:
    draw = KilnNoise(0.0, 9.0 if goes_on else 0.0, 1.0)
    new = kiln_bench.advance(KILN, hot(spike=-6.0, left=left), 0.0, draw, 0.01)
    assert new.spike == (-6.0 if goes_on else 0.0)
    assert new.left == pytest.approx(left - 0.01 if goes_on else 0.0)
