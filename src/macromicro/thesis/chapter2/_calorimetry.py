"""A virtual differential scanning calorimeter (Appendix A) for the bench's wires.

The heat flow is the temperature difference of furnace and sample over a thermal resistance.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.plant import micro, wire
from macromicro.plant.wire import Load
from macromicro.thesis.chapter2._wire_tests import Specimen

DENSITY = 6450.0  # kg/m^3, NiTi
RATE = 10.0 / 60.0  # K/s
RESISTANCE = 100.0  # K/W
LOW, HIGH = 5.0, 120.0
DT = 0.2
_LOOSE = Load(0.0, 0.0, 0.0)


class Scan(NamedTuple):
    """One direction of the ramp, shape (points,) each: furnace and sample [degC], heat flow [W]."""

    furnace: Array
    sample: Array
    flow: Array
    mass: float


class Peak(NamedTuple):
    """A peak of the trace, at temperatures of the sample [degC]."""

    onset: float
    top: float
    end: float
    heat: float  # area over the baseline [J/kg], positive for heat taken in


def scan(s: Specimen) -> tuple[Scan, Scan]:
    ramp = np.arange(LOW, HIGH, RATE * DT)
    furnace = np.concatenate((ramp, ramp[::-1]))
    sample = np.empty_like(furnace)
    start = micro.cold_wire(s.wire, _LOOSE, s.table, LOW)
    _ramped(s, start, furnace, sample)
    flow = (furnace - sample) / RESISTANCE
    mass = DENSITY * s.area * s.length
    half = len(ramp)
    return (
        Scan(furnace[:half], sample[:half], flow[:half], mass),
        Scan(furnace[half:], sample[half:], flow[half:], mass),
    )


def _ramped(s: Specimen, state: wire.WireState, furnace: Array, sample: Array) -> None:
    for k in range(len(furnace)):
        sample[k] = state.temperature
        gain = (furnace[k] - state.temperature) / RESISTANCE * DT
        state = wire.heated(s.wire, _LOOSE, s.table, state, gain, 0.0, s.capacity)


def peak(trace: Scan, settled: float = 10.0, quiet: float = 4.0) -> Peak:
    """The peak of one direction, by the usual constructions.

    Baseline: a straight line between the mean flows over `quiet` [K] after the first
    `settled` [K], in which the ramp settles, and over the last `quiet` [K]. Onset and end: the
    steepest tangents before and after the top, extended to the baseline, averaged over 1 K.
    """
    t, flow = trace.sample, trace.flow
    gone = np.abs(t - t[0])
    first = (gone > settled) & (gone <= settled + quiet)
    last = gone > gone[-1] - quiet
    (t1, t2), (f1, f2) = ([float(c[part].mean()) for part in (first, last)] for c in (t, flow))
    over = flow - (f1 + (t - t1) * (f2 - f1) / (t2 - t1))
    inside = np.flatnonzero((gone > settled) & (gone < gone[-1] - 1.0))
    sign = 1.0 if t[-1] > t[0] else -1.0
    top = int(inside[np.argmax(sign * over[inside])])
    heat = float(np.sum(over[gone > settled])) * DT / trace.mass
    width = round(1.0 / (RATE * DT)) | 1
    smooth = np.convolve(over, np.full(width, 1.0 / width), "same")
    steep = np.gradient(smooth, DT * RATE * sign)
    rise = inside[inside < top]
    fall = inside[inside > top]
    before = int(rise[np.argmax(steep[rise])])
    after = int(fall[np.argmin(steep[fall])])
    onset, end = (float(t[k] - smooth[k] / steep[k]) for k in (before, after))
    return Peak(onset, float(t[top]), end, heat)
