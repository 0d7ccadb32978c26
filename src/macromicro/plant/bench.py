"""The whole positioner: stages, sensors and converters; outputs act one period late."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.columns import Meaning, Quantity
from macromicro.kernel import kernel
from macromicro.plant import amplifier, carriage, encoder, hall, laser, micro
from macromicro.plant._steps import Steps
from macromicro.plant.amplifier import Amplifier
from macromicro.plant.belt import Belt
from macromicro.plant.carriage import Carriage, Macro, MacroState
from macromicro.plant.driver import Driver
from macromicro.plant.encoder import Converter, Encoder
from macromicro.plant.flexure import Bias, Flexure, stiffness
from macromicro.plant.friction import Friction
from macromicro.plant.hall import Hall
from macromicro.plant.laser import Laser
from macromicro.plant.micro import Micro, MicroState
from macromicro.plant.motor import Motor
from macromicro.plant.phase import TABLE_END, Phase
from macromicro.plant.thermal import Thermal
from macromicro.plant.wire import Load, Wire
from macromicro.types import Outputs, Sample


def _whole(name: str, bits: float) -> tuple[bool, str, Any, str]:
    """Rule: a number of bits is whole."""
    return not bits.is_integer(), name, bits, "a whole number"


class Bench(NamedTuple):
    """All physical settings of the positioner; SI and degC."""

    amplifier: Amplifier = Amplifier()
    motor: Motor = Motor()
    friction: Friction = Friction()
    belt: Belt = Belt()
    carriage: Carriage = Carriage()
    driver: Driver = Driver()
    thermal: Thermal = Thermal()
    phase: Phase = Phase()
    wire: Wire = Wire()
    flexure: Flexure = Flexure()
    bias: Bias = Bias()
    steps: Steps = Steps()

    def problems(self) -> list[tuple[str, Any, str]]:
        wire, driver, friction, phase = self.wire, self.driver, self.friction, self.phase
        low, high = self.carriage.stop_low, self.carriage.stop_high
        ctrl, heat = driver.map_ctrl, driver.map_heat
        # (wrong?, parameter, value, accepted)
        rules: tuple[tuple[bool, str, Any, str], ...] = (
            (
                wire.stop >= wire.stroke,
                "wire.stop",
                wire.stop,
                "below {wire.stroke}",
            ),
            (
                driver.contract_on > wire.stop,
                "driver.contract_on",
                driver.contract_on,
                "at most {wire.stop}",
            ),
            (
                driver.contract_off >= driver.contract_on,
                "driver.contract_off",
                driver.contract_off,
                "below {driver.contract_on}",
            ),
            (low >= high, "carriage.stop_low", low, "below {carriage.stop_high}"),
            (
                len(ctrl) != len(heat),
                "driver.map_heat",
                f"{len(heat)} values",
                f"{len(ctrl)}, as in driver.map_ctrl",
            ),
            (
                any(b <= a for a, b in pairwise(ctrl)),
                "driver.map_ctrl",
                ctrl,
                "values that increase",
            ),
            (len(ctrl) < 2, "driver.map_ctrl", f"{len(ctrl)} values", "two values or more"),
            (
                any(b < a for a, b in pairwise(heat)),
                "driver.map_heat",
                heat,
                "values that do not fall",
            ),
            (high > low > 0.0, "carriage.stop_low", low, "at most 0 mm, where the carriage starts"),
            (high <= 0.0, "carriage.stop_high", high, "above 0 mm, where the carriage starts"),
            _whole("amplifier.bits", self.amplifier.bits),
            (
                phase.heat_start >= phase.heat_end,
                "phase.heat_start",
                phase.heat_start,
                "below {phase.heat_end}",
            ),
            (
                phase.heat_end > TABLE_END,
                "phase.heat_end",
                phase.heat_end,
                f"at most {TABLE_END:.0f} degC, where the relay table ends",
            ),
            (
                phase.cool_end + phase.width_min > phase.heat_start,
                "phase.cool_end",
                phase.cool_end,
                "at least phase.width_min below {phase.heat_start}",
            ),
            (
                friction.ripple >= friction.coulomb,
                "friction.ripple",
                friction.ripple,
                "below {friction.coulomb}",
            ),
        )
        return [(name, value, accepted) for wrong, name, value, accepted in rules if wrong]


class Sensors(NamedTuple):
    encoder: Encoder = Encoder()
    hall: Hall = Hall()
    laser: Laser = Laser()
    converter: Converter = Converter()

    def problems(self) -> list[tuple[str, Any, str]]:
        rules = (
            _whole("encoder.bits", self.encoder.bits),
            _whole("converter.bits", self.converter.bits),
        )
        return [(name, value, accepted) for wrong, name, value, accepted in rules if wrong]


class Plant(NamedTuple):
    amplifier: Amplifier
    macro: Macro
    micro: Micro
    encoder: Encoder
    hall: Hall
    laser: Laser
    converter: Converter
    macro_steps: int
    micro_steps: int


class Noise(NamedTuple):
    hall: Annotated[float, Meaning("draw for the Hall sensor's noise")] = 0.0
    laser: Annotated[float, Meaning("draw for the laser's fast noise")] = 0.0
    drift: Annotated[float, Meaning("draw for the laser's slow noise")] = 0.0


NOISES = len(Noise._fields)


def _true(name: str, unit: str, meaning: str, scale: float = 1.0) -> Quantity:
    return Quantity(unit, f"bench truth: {meaning}", column=f"true_{name}", scale=scale)


class State(NamedTuple):
    macro: Annotated[MacroState, Meaning("carriage")]
    micro: Annotated[MicroState, Meaning("actuator")]
    hall: Annotated[float, Meaning("output of the Hall sensor", "V")]
    drift: Annotated[float, Meaning("slow noise of the laser", "m")]
    zero: Annotated[float, Meaning("place of the laser's zero", "m")]
    motor: Annotated[float, Meaning("latched output still to take effect", "V")]
    ctrl: Annotated[float, Meaning("latched output still to take effect", "V")]


def macro_stage(bench: Bench) -> Macro:
    return Macro(bench.carriage, bench.motor, bench.friction, bench.belt)


def prepare(bench: Bench, sensors: Sensors) -> Plant:
    load = Load(bench.bias.preload, bench.bias.rate + stiffness(bench.flexure), bench.bias.platform)
    return Plant(
        bench.amplifier,
        macro_stage(bench),
        micro.prepare(bench.driver, bench.thermal, bench.wire, bench.phase, load),
        sensors.encoder,
        sensors.hall,
        sensors.laser,
        sensors.converter,
        int(bench.steps.macro),
        int(bench.steps.micro),
    )


def initial(p: Plant, position: float = 0.0) -> State:
    """The positioner at rest, at room temperature, laser at zero."""
    # Half a count in: a carriage left on an encoder's edge would flicker by rounding.
    x = position + 0.5 * p.encoder.pitch
    fine = micro.cold(p.micro, p.micro.thermal.ambient)
    return State(carriage.at_rest(x), fine, hall.volts(p.hall, 0.0, 0.0), 0.0, x, 0.0, 0.0)


@kernel
def drawn(noise: npt.NDArray[np.float64], k: int) -> Noise:
    return Noise(noise[k, 0], noise[k, 1], noise[k, 2])


@kernel
def stage(p: Plant, s: State) -> float:
    """Absolute position of the micro-stage's platform: carriage, rocking, contraction."""
    return s.macro.x + p.macro.belt.participation * s.macro.q + s.micro.wire.x


@kernel
def measure(p: Plant, s: State, t: float, draw: Noise) -> Sample:
    return Sample(
        t,
        encoder.count(p.encoder, s.macro.x),
        encoder.sample(p.converter, s.hall + p.hall.noise * draw.hall),
        laser.reading(p.laser, stage(p, s) - s.zero, draw.laser, s.drift),
        1.0 if s.micro.wire.x <= p.micro.driver.extend_on else 0.0,
        s.micro.cut,
    )


@kernel
def advance(p: Plant, s: State, out: Outputs, draw: Noise, dt: float) -> State:
    # A reset sets the laser's zero to the present reading's place, its noise included.
    zero = s.zero
    if out.laser_reset > 0.5:
        zero = stage(p, s) + s.drift
    volts = amplifier.motor_volts(p.amplifier, s.motor, s.macro.i)
    macro = carriage.advance(p.macro, s.macro, volts, dt, p.macro_steps)
    level_in = amplifier.ctrl_level(p.amplifier, s.ctrl)
    pull = -p.micro.load.mass * macro.accel
    fine = s.micro
    level = s.hall
    h = dt / p.micro_steps
    for _ in range(p.micro_steps):
        before = fine.wire.x
        fine = micro.advance(p.micro, fine, level_in, out.fan, pull, h)
        warm = fine.body - p.micro.thermal.ambient
        level = hall.lagged(p.hall, level, 0.5 * (before + fine.wire.x), warm, h)
    return State(
        macro,
        fine,
        level,
        laser.drifted(p.laser, s.drift, draw.drift, dt),
        zero,
        amplifier.convert(p.amplifier, out.motor),
        max(amplifier.convert(p.amplifier, out.ctrl), 0.0),
    )


class Truth(NamedTuple):
    """True quantities of the bench, in SI units and degC; each is a column of a recording."""

    carriage: Annotated[float, _true("carriage", "mm", "carriage position", 1e3)]
    speed: Annotated[float, _true("speed", "mm/s", "carriage speed", 1e3)]
    belt: Annotated[float, _true("belt", "um", "belt oscillation as seen at the stage", 1e6)]
    micro: Annotated[float, _true("micro", "mm", "contraction", 1e3)]
    current: Annotated[float, _true("current", "A", "motor current")]
    wire: Annotated[float, _true("wire", "degC", "wire temperature")]
    plates: Annotated[float, _true("plates", "degC", "plate temperature")]
    body: Annotated[float, _true("body", "degC", "body temperature")]
    austenite: Annotated[float, _true("austenite", "1", "austenite fraction")]
    heat: Annotated[float, _true("heat", "W", "heat into the wires")]


@kernel
def truth(p: Plant, s: State) -> Truth:
    """The bench's true quantities (deg C), for recordings and teaching."""
    return Truth(
        s.macro.x,
        s.macro.v,
        p.macro.belt.participation * s.macro.q,
        s.micro.wire.x,
        s.macro.i,
        s.micro.wire.temperature,
        s.micro.plates,
        s.micro.body,
        s.micro.wire.austenite,
        s.micro.power,
    )
