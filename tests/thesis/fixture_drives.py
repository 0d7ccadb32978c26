"""Kiln and cycle bench for tests: open-loop drives, compiled, and simulated rigs."""

from __future__ import annotations

from typing import Any, Self

import numpy as np

from macromicro.arrays import Array
from macromicro.kernel import compiled, kernel
from macromicro.rig.fixtures import (
    CYCLE_PERIOD,
    KILN_PERIOD,
    CycleOutputs,
    CycleSample,
    KilnOutputs,
    KilnSample,
)
from macromicro.rig.twin import VirtualClock, noise_source
from macromicro.thesis import cycle_bench, kiln_bench
from macromicro.thesis.cycle_bench import CycleBench, CyclePlant
from macromicro.thesis.kiln_bench import KILN_NOISES, KilnBench, KilnNoise, KilnPlant, KilnState

KILN, CYCLE = KilnBench(), CycleBench()


@kernel
def _kiln(p: KilnPlant, s: KilnState, heater: Array, noise: Array, dt: float, out: Array) -> None:
    for k in range(len(heater)):
        draw = kiln_bench.drawn(noise, k)
        m = kiln_bench.measure(p, s, k * dt, draw)
        out[0, k] = m.thermocouple
        out[1, k] = m.encoder
        out[2, k] = s.wire.temperature
        s = kiln_bench.advance(p, s, heater[k], draw, dt)


@kernel
def _cycled(
    p: cycle_bench.CyclePlant, s: cycle_bench.CycleState, reference: Array, dt: float, out: Array
) -> None:
    """Appendix D's PID, with conditional integration and Kd per sample (an erratum)."""
    integral = 0.0
    before = 0.0
    for k in range(len(reference)):
        m = cycle_bench.measure(p, s, k * dt)
        error = reference[k] - m.encoder
        u = 0.5 * error + integral + 0.1 * (error - before)
        if 0.0 <= u <= 5.0 or (u < 0.0 < error) or (u > 5.0 and error < 0.0):
            integral += 0.5 * error * dt
        before = error
        u = min(max(u, 0.0), 5.0)
        out[0, k] = m.encoder
        out[1, k] = u
        s = cycle_bench.advance(p, s, u, 0.0, dt)


def fire(heater: Array, seed: int = 0, dt: float = 0.01, spec: KilnBench = KILN) -> Array:
    """Rows thermocouple [degC], encoder [counts], wires [degC] of a kiln run."""
    noise = np.random.default_rng(seed).standard_normal((len(heater), 3))
    out = np.empty((3, len(heater)))
    p = kiln_bench.prepare(spec)
    heating = np.ascontiguousarray(heater, dtype=float)
    compiled(_kiln)(p, kiln_bench.initial(p), heating, noise, dt, out)
    return out


def cycled(cycles: int, spec: CycleBench = CYCLE) -> Array:
    """Rows encoder [counts], CTRL [V] over 4 s cycles of 150 counts for 2 s, then 0."""
    p = cycle_bench.prepare(spec)
    reference = np.tile(np.r_[np.full(2000, 150.0), np.zeros(2000)], cycles)
    out = np.empty((2, len(reference)))
    compiled(_cycled)(p, cycle_bench.initial(p), reference, 1e-3, out)
    return out


class Twin:
    """Simulated clock and safe outputs of both rigs."""

    channels: tuple[str, ...]

    def __init__(self, dt: float, safe: Any) -> None:
        self.dt, self.tick, self.clock = dt, 0, VirtualClock(self)
        self._safe = self._outputs = safe

    def advance(self) -> None:
        raise NotImplementedError

    def write(self, outputs: Any) -> None:
        self._outputs = outputs

    def stop(self) -> None:
        self._outputs = self._safe

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.stop()


class KilnTwin(Twin):
    channels = KilnSample._fields
    block = 1000

    def __init__(self, plant: KilnPlant, seed: int) -> None:
        super().__init__(KILN_PERIOD, KilnOutputs(0.0))
        self._plant, self._state = plant, kiln_bench.initial(plant)
        self._measure, self._advance = compiled(kiln_bench.measure), compiled(kiln_bench.advance)
        self._random = noise_source(seed)

    def read(self) -> KilnSample:
        k = self.tick % self.block
        if k == 0:
            self._noise = self._random.standard_normal((self.block, KILN_NOISES)).tolist()
        self._draw = KilnNoise(*self._noise[k])
        now = self.tick * self.dt
        sample: KilnSample = self._measure(self._plant, self._state, now, self._draw)
        return sample

    def advance(self) -> None:
        heater = self._outputs.heater
        self._state = self._advance(self._plant, self._state, heater, self._draw, self.dt)
        self.tick += 1


class CycleTwin(Twin):
    channels = CycleSample._fields

    def __init__(self, plant: CyclePlant) -> None:
        super().__init__(CYCLE_PERIOD, CycleOutputs(0.0, 0.0))
        self._plant, self._state = plant, cycle_bench.initial(plant)
        self._measure, self._advance = compiled(cycle_bench.measure), compiled(cycle_bench.advance)

    def read(self) -> CycleSample:
        sample: CycleSample = self._measure(self._plant, self._state, self.tick * self.dt)
        return sample

    def advance(self) -> None:
        self._state = self._advance(self._plant, self._state, *self._outputs, self.dt)
        self.tick += 1
