"""What the bench shows of its state, and what outputs do to it."""

from __future__ import annotations

import math

import pytest

from macromicro.plant import (
    amplifier,
    bench,
    carriage,
    hall,
    laser,
    micro,
)
from macromicro.plant.bench import Bench, Noise, Sensors, State
from macromicro.plant.flexure import stiffness
from macromicro.types import Outputs, Sample

from .drives import PLANT

DT = 1e-3
PITCH = PLANT.encoder.pitch


def somewhere() -> State:
    """Every quantity of the positioner another number."""
    s = bench.initial(PLANT, 0.1)
    fine = micro.advance(PLANT.micro, s.micro, 5.0, 0.0, 0.0, 0.4)
    fine = fine._replace(wire=fine.wire._replace(x=1.2e-3, austenite=0.31, temperature=71.0))
    return State(
        s.macro._replace(x=0.1234, v=0.02, i=0.3, q=1e-4, accel=3.0),
        fine._replace(power=0.9, plates=33.0, body=29.0),
        1.9, 2e-7, 0.12, 2.0, 1.5,
    )  # fmt: skip


def test_the_stages_platform_is_carriage_rocking_and_contraction() -> None:
    s = somewhere()
    share = PLANT.macro.belt.participation
    assert bench.stage(PLANT, s) == pytest.approx(0.1234 + share * 1e-4 + 1.2e-3, abs=1e-15)


def test_the_truth_is_the_state() -> None:
    rocking = PLANT.macro.belt.participation * 1e-4
    assert bench.truth(PLANT, somewhere()) == (
        0.1234, 0.02, pytest.approx(rocking), 1.2e-3, 0.3, 71.0, 33.0, 29.0, 0.31, 0.9
    )  # fmt: skip


@pytest.mark.parametrize(("n0", "n1"), [(0.0, 0.0), (3.0, -2.0), (-3.0, 2.0)])
def test_sensors_show_the_state_and_their_own_noise(n0: float, n1: float) -> None:
    """Standard normal draws times the sensors' standard deviations, rounded to their codes."""
    s = somewhere()
    m = bench.measure(PLANT, s, 7.0, Noise(n0, n1))
    assert (m.t, m.encoder) == (7.0, math.floor(0.1234 / PITCH))
    lsb = PLANT.converter.full_scale / 2.0**PLANT.converter.bits
    assert m.hall == pytest.approx(1.9 + PLANT.hall.noise * n0, abs=0.5001 * lsb)
    place = bench.stage(PLANT, s) - 0.12 + 2e-7 + PLANT.laser.noise * n1
    assert m.laser == pytest.approx(place, abs=0.5001 * PLANT.laser.resolution)
    assert isinstance(m, Sample) and (m.extend, m.contract) == (0.0, 0.0)


@pytest.mark.parametrize("x", [PLANT.micro.driver.extend_on, 1.01 * PLANT.micro.driver.extend_on])
@pytest.mark.parametrize("cut", [0.0, 1.0])
def test_the_two_end_switches(x: float, cut: float) -> None:
    s = somewhere()
    s = s._replace(micro=s.micro._replace(wire=s.micro.wire._replace(x=x), cut=cut))
    m = bench.measure(PLANT, s, 0.0, Noise())
    assert (m.extend, m.contract) == (float(x == PLANT.micro.driver.extend_on), cut)


def test_the_positioner_begins_in_the_midst_of_a_count_with_empty_outputs() -> None:
    s = bench.initial(PLANT, 0.1)
    assert s.macro == carriage.at_rest(0.1 + 0.5 * PITCH)
    assert s.hall == hall.volts(PLANT.hall, 0.0, 0.0)
    assert (s.drift, s.zero, s.motor, s.ctrl) == (0.0, 0.1 + 0.5 * PITCH, 0.0, 0.0)
    assert s.micro.body == PLANT.micro.thermal.ambient


def test_the_wires_load_is_that_of_bias_and_flexure() -> None:
    b = Bench()
    load = PLANT.micro.load
    assert load == (b.bias.preload, b.bias.rate + stiffness(b.flexure), b.bias.platform)
    sharp = bench.prepare(b._replace(steps=b.steps._replace(macro=7.0, micro=3.0)), Sensors())
    assert (sharp.macro_steps, sharp.micro_steps) == (7, 3)


@pytest.mark.parametrize("reset", [0.0, 0.5, 1.0])
def test_a_reset_puts_the_lasers_zero_where_it_reads_now(reset: float) -> None:
    """Its slow noise included, so that it reads nothing but its fast noise."""
    s = somewhere()
    place = bench.stage(PLANT, s) + s.drift
    new = bench.advance(PLANT, s, Outputs(0.0, 0.0, 0.0, reset), Noise(drift=0.3), DT)
    assert new.zero == (place if reset > 0.5 else 0.12)
    assert new.drift == laser.drifted(PLANT.laser, 2e-7, 0.3, DT)


@pytest.mark.parametrize("steps", [1, 3])
@pytest.mark.parametrize("fan", [0.0, 1.0])
def test_a_period_of_both_stages(steps: int, fan: float) -> None:
    """Outputs latched before act now; the carriage's acceleration pulls at the platform; the Hall
    sensor sees the mean contraction of each step."""
    p = PLANT._replace(micro_steps=steps)
    s, twin = somewhere(), somewhere()
    new = bench.advance(p, s, Outputs(1.0, 2.0, fan, 0.0), Noise(), DT)
    volts = amplifier.motor_volts(p.amplifier, 2.0, twin.macro.i)
    macro = carriage.advance(p.macro, twin.macro, volts, DT, p.macro_steps)
    assert new.macro == macro
    fine, level = twin.micro, 1.9
    ctrl = amplifier.ctrl_level(p.amplifier, 1.5)
    for _ in range(steps):
        before = fine.wire.x
        fine = micro.advance(p.micro, fine, ctrl, fan, -p.micro.load.mass * macro.accel, DT / steps)
        level = hall.lagged(p.hall, level, 0.5 * (before + fine.wire.x), 0.0, DT / steps)
    assert new.micro[:5] == fine[:5] and new.micro.wire[:6] == fine.wire[:6]
    assert new.hall == level
    assert new.motor == amplifier.convert(p.amplifier, 1.0)
    assert new.ctrl == amplifier.convert(p.amplifier, 2.0)
