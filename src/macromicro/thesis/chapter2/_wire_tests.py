"""A virtual test machine for the bench's wires (Section 2.3).

The specimen is all six wires as one, without the actuator and its stop. The machine imposes
temperature and load exactly and quasi-statically, and reads temperature, load and length.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.hysteresis import Everett
from macromicro.plant import micro, phase, wire
from macromicro.plant.bench import Bench
from macromicro.plant.flexure import GRAM_FORCE
from macromicro.plant.wire import Load, Wire

_HANGING = Load(0.0, 0.0, 0.0)
ROOM, HOT = 25.0, 125.0


class Specimen(NamedTuple):
    wire: Wire
    table: Everett
    capacity: float

    @property
    def area(self) -> float:
        """Cross-section [m^2], as measured with a caliper."""
        return self.wire.area

    @property
    def length(self) -> float:
        """Gauge length [m]: the cold wire without load."""
        return self.wire.length


class Readings(NamedTuple):
    """Temperature [degC], load [N] and extension [m] of the cold, unloaded length; (points,)."""

    temperature: Array
    load: Array
    extension: Array


def specimen(bench: Bench) -> Specimen:
    free = bench.wire._replace(stop=math.inf)
    return Specimen(free, phase.table(bench.phase), bench.thermal.wire_capacity)


def tested(s: Specimen, temperature: Array, load: Array) -> Readings:
    """The wires led through temperatures [degC] and loads [N], from martensite without load.

    Between two points both change together.
    """
    state = micro.cold_wire(s.wire, _HANGING, s.table, float(temperature[0]))
    extension = np.empty(len(temperature))
    for k, (t, force) in enumerate(zip(temperature.tolist(), load.tolist(), strict=True)):
        state = wire.tempered(s.wire, Load(force, 0.0, 0.0), s.table, state, t)
        contraction, _ = wire.geometry(s.wire, _HANGING, state.austenite, force)
        extension[k] = -contraction
    return Readings(np.array(temperature), np.array(load), extension)


def path(*points: tuple[float, float], each: int = 160) -> tuple[Array, Array]:
    """Temperatures [degC] and loads [N] along lines through (degC, gf), `each` points a line."""
    t, gf = np.array(points, dtype=float).T
    places = np.linspace(0.0, len(points) - 1.0, each * (len(points) - 1) + 1)
    index = np.arange(len(points))
    return np.interp(places, index, t), GRAM_FORCE * np.interp(places, index, gf)


class Turning(NamedTuple):
    """Start and finish [degC] of a transformation, by tangents, and the tangent's slope."""

    start: float
    finish: float
    slope: float


def tangents(temperature: Array, length: Array) -> Turning:
    """Where the steepest tangent of a branch meets its first and last reading.

    `length` over a `temperature` that runs one way. The tangent is a line through the readings
    within 1.5 K of the steepest place.
    """
    t, y = np.asarray(temperature), np.asarray(length)
    steep = int(np.argmax(np.abs(np.gradient(y, t))))
    near = np.abs(t - t[steep]) <= 1.5
    slope, level = np.polyfit(t[near], y[near], 1)
    return Turning(float((y[0] - level) / slope), float((y[-1] - level) / slope), float(slope))


def enclosed(x: Array, y: Array) -> float:
    """Area that a path encloses, closed by a straight line; always positive."""
    return abs(0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)))
