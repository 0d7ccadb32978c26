"""Open-loop drives of the plant's parts, compiled; one row of the result a quantity."""

from __future__ import annotations

import math
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.control import deadzone
from macromicro.kernel import compiled, kernel
from macromicro.plant import amplifier, bench, carriage, micro, wire
from macromicro.plant.amplifier import Amplifier
from macromicro.plant.belt import Belt
from macromicro.plant.bench import Bench, Plant, Sensors
from macromicro.plant.carriage import Macro, MacroState
from macromicro.plant.micro import Micro, MicroState
from macromicro.plant.wire import WireState
from macromicro.thesis import kiln_bench
from macromicro.thesis.kiln_bench import KilnBench, KilnPlant
from macromicro.types import Outputs

Array = npt.NDArray[np.float64]
DT = 1e-3
COUNT = 0.2 / 2800.0
PLANT = bench.prepare(Bench(), Sensors())
KILN = KilnBench()
MACRO = PLANT.macro
MICRO = PLANT.micro


def energy(p: Belt, mass: float, q: float, speed: float) -> float:
    """Energy [J] of the belt's mode at `q` [m] and `speed` [m/s], on a carriage of `mass` [kg]."""
    w = 2.0 * math.pi * p.frequency
    return 0.5 * p.participation * mass * (speed * speed + w * w * q * q)


@kernel
def _carriage(
    p: Macro, s: MacroState, volts: Array, dt: float, substeps: int, out: Array
) -> MacroState:
    for k in range(len(volts)):
        s = carriage.advance(p, s, volts[k], dt, substeps)
        out[0, k] = s.x
        out[1, k] = s.v
        out[2, k] = s.z
        out[3, k] = s.i
        out[4, k] = s.q
        out[5, k] = s.qv
    return s


@kernel
def _actuator(
    p: Micro, s: MicroState, ctrl: Array, fan: float, dt: float, out: Array
) -> MicroState:
    for k in range(len(ctrl)):
        s = micro.advance(p, s, ctrl[k], fan, 0.0, dt)
        out[0, k] = s.wire.x
        out[1, k] = s.wire.temperature
        out[2, k] = s.plates
        out[3, k] = s.body
        out[4, k] = s.power
        out[5, k] = s.cut
        out[6, k] = s.wire.austenite
    return s


@kernel
def _tempered(p: KilnPlant, s: WireState, temperature: Array, out: Array) -> None:
    for k in range(len(temperature)):
        s = wire.tempered(p.wire, p.load, p.table, s, temperature[k])
        out[k] = s.x


@kernel
def _positioner(
    p: Plant, s: bench.State, motor: Array, ctrl: Array, noise: Array, out: Array
) -> None:
    for k in range(len(motor)):
        draw = bench.drawn(noise, k)
        m = bench.measure(p, s, k * 1e-3, draw)
        out[0, k] = m.encoder
        out[1, k] = m.hall
        out[2, k] = m.laser
        out[3, k] = s.micro.wire.x
        s = bench.advance(p, s, Outputs(motor[k], ctrl[k], 0.0, 0.0), draw, 1e-3)


@cache
def _fast(function: Any) -> Any:
    return compiled(function)


class Ride(NamedTuple):
    """A ride of the carriage, values after every period: SI units."""

    x: Array
    v: Array
    z: Array
    i: Array
    q: Array
    qv: Array


def ride(
    volts: Array, start: MacroState, p: Macro = MACRO, substeps: int = 20, dt: float = DT
) -> Ride:
    """Drive the carriage with motor volts (20 V at full scale), one value a period."""
    out = np.empty((6, len(volts)))
    _fast(_carriage)(p, start, np.ascontiguousarray(volts, dtype=float), dt, substeps, out)
    return Ride(*out)


def motor_volts(da: float) -> float:
    """Motor volts of a D/A voltage."""
    return amplifier.motor_volts(Amplifier(), amplifier.convert(Amplifier(), da), 0.0)


def lifted(effort: float, dead_zone: float = 3.0) -> float:
    """Effort [V] lifted over the dead zone, as Section 4.2.5 drives the stage."""
    return deadzone.inverse(dead_zone, effort)


class Heating(NamedTuple):
    """A run of the actuator, values after every period: SI units, degC; and the last state."""

    x: Array
    temperature: Array
    plates: Array
    body: Array
    power: Array
    cut: Array
    austenite: Array
    last: MicroState


def heat(
    ctrl: Array, p: Micro = MICRO, fan: float = 0.0, dt: float = DT, start: MicroState | None = None
) -> Heating:
    """Drive the actuator with CTRL volts, one value a period, from the cold by default.

    A `start` is used up: its relay memory is written on.
    """
    out = np.empty((7, len(ctrl)))
    s = micro.cold(p, p.thermal.ambient) if start is None else start
    last = _fast(_actuator)(p, s, np.ascontiguousarray(ctrl, dtype=float), fan, dt, out)
    return Heating(*out, last)


def tempered(temperature: Array, spec: KilnBench = KILN) -> Array:
    """Contraction [m] of the kiln's actuator at imposed wire temperatures, from fresh."""
    out = np.empty(len(temperature))
    p = kiln_bench.prepare(spec)
    start = micro.cold_wire(p.wire, p.load, p.table, float(temperature[0]))
    _fast(_tempered)(p, start, np.ascontiguousarray(temperature, dtype=float), out)
    return out


def drive(motor: Array, ctrl: Array, seed: int = 0, p: Plant = PLANT) -> Array:
    """Rows encoder [counts], Hall [V], laser [m], true contraction [m] of the whole bench."""
    noise = np.random.default_rng(seed).standard_normal((len(motor), 3))
    out = np.empty((4, len(motor)))
    volts = (np.ascontiguousarray(v, dtype=float) for v in (motor, ctrl))
    _fast(_positioner)(p, bench.initial(p), *volts, noise, out)
    return out
