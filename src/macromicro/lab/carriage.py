"""The carriage of the virtual bench alone, compiled: open loop, or under one law all the time."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.control import macro as control
from macromicro.control.macro import MacroLaw, Memory
from macromicro.control.stage_law import Sample, Target
from macromicro.kernel import kernel
from macromicro.nominal import PERIOD
from macromicro.plant import amplifier, carriage, encoder
from macromicro.plant.amplifier import Amplifier
from macromicro.plant.carriage import Macro, MacroState
from macromicro.plant.encoder import Encoder


class MacroBench(NamedTuple):
    """The part of the bench that moves the carriage."""

    amplifier: Amplifier
    macro: Macro
    encoder: Encoder
    substeps: int


@kernel
def effort(
    p: MacroLaw, memory: Memory, closed: bool, target: float, x: Sample, dt: float
) -> tuple[Memory, float]:
    """Memory and volts [V]: by the law for `target` [counts] where `closed`, else `target` [V]."""
    if closed:
        return control.step(p, memory, Target(target, 0.0, 0.0, math.inf), x, dt)
    return memory, target


@kernel
def rollout(
    bench: MacroBench,
    p: MacroLaw,
    closed: bool,
    s: MacroState,
    targets: Array,
    out: Array,
    dt: float,
) -> None:
    """Counts, D/A volts and integral effort into the rows of `out`."""
    latched = 0.0
    memory = control.begun(p)
    for k in range(len(targets)):
        x = encoder.count(bench.encoder, s.x)
        memory, motor = effort(p, memory, closed, targets[k], Sample(k * dt, x), dt)
        out[0, k], out[1, k], out[2, k] = x, motor, control.integral(memory)
        drive = amplifier.motor_volts(bench.amplifier, latched, s.i)
        s = carriage.advance(bench.macro, s, drive, dt, bench.substeps)
        latched = amplifier.convert(bench.amplifier, motor)


def run(bench: MacroBench, p: MacroLaw, closed: bool, targets: Array, start: float) -> Array:
    """Rows of `rollout` from rest at `start` [counts]."""
    out = np.empty((3, len(targets)))
    rest = carriage.at_rest(start * bench.encoder.pitch)
    p.machine(rollout)(bench, p, closed, rest, targets, out, PERIOD)
    return out


@kernel
def _asked(p: MacroLaw, targets: Array, x: Array, out: Array, dt: float) -> None:
    memory = control.begun(p)
    for k in range(len(x)):
        memory, out[k] = effort(p, memory, True, targets[k], Sample(k * dt, x[k]), dt)


KERNELS = (rollout, _asked)  # that call a law


def unlimited_effort(p: MacroLaw, targets: Array, x: Array) -> Array:
    """Effort [V] that a law would have given without its limit, from the counts of a run."""
    out = np.empty_like(x)
    p.machine(_asked)(p._replace(limit=math.inf), targets, x, out, PERIOD)
    return out
