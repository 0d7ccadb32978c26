"""Closed-loop runs of the macro-stage alone, and what is read off them (Section 4.3).

Only what a rig shows is used: the reference, encoder counts and commanded volts. There is
no sequence around the control law: it is never parked, so stiction and chatter stay visible.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.columns import COLUMNS
from macromicro.control import macro as control
from macromicro.control import settings
from macromicro.control.macro import MacroLaw
from macromicro.control.settings import Control
from macromicro.experiments.machine import Machine, play, recorded
from macromicro.experiments.macro_friction import DT
from macromicro.kernel import compiled, kernel
from macromicro.plant import amplifier, carriage, encoder
from macromicro.plant.bench import Plant
from macromicro.plant.carriage import MacroState
from macromicro.recording import Recording
from macromicro.rig.session import Fixture
from macromicro.types import Command, Outputs, Sample

Array = npt.NDArray[np.float64]

NAMES = ("t", "macro_reference", "macro_position", "motor", "macro_integral")
RAMP = 1.0  # V
ARRIVED = 2.0  # counts; the tolerance of the default sequence

_SHOWN = tuple(c for c in COLUMNS if c.name in NAMES)


@kernel
def _closed_loop(
    p: Plant, law: MacroLaw, s: MacroState, reference: Array, out: Array, dt: float
) -> None:
    """Counts, D/A volts and integral effort into the rows of `out`, the law always at work."""
    latched = 0.0
    memory = control.rest(0.0)
    for k in range(len(reference)):
        x = encoder.count(p.encoder, s.x)
        memory, motor = control.step(law, memory, reference[k] - x, dt)
        out[0, k], out[1, k], out[2, k] = x, motor, control.integral(memory)
        drive = amplifier.motor_volts(p.amplifier, latched)
        s = carriage.advance(p.macro, s, drive, dt, p.macro_steps)
        latched = amplifier.convert(p.amplifier, motor)


def law(name: str) -> MacroLaw:
    """`pid`, `pd-initial` or `pd-tuned` with the gains and compensation of the thesis."""
    return settings.prepare(Control(macro_law=name)).macro


def closed_loop(
    plant: Machine, controller: MacroLaw, reference: npt.ArrayLike, start: float = 0.0
) -> Recording:
    """One run: `reference` [counts] a sample each ms, from rest at `start` [counts].

    The recording has the columns `NAMES`.
    """
    aim = np.ascontiguousarray(reference, dtype=np.float64)
    if isinstance(plant, Fixture):
        return _on_rig(plant, controller, aim, start)
    out = np.empty((3, len(aim)))
    s = carriage.at_rest((start + 0.5) * plant.encoder.pitch)
    compiled(_closed_loop)(plant, controller, s, aim, out, DT)
    columns = dict(zip(NAMES, (np.arange(len(aim)) * DT, aim, *out), strict=True))
    return Recording.from_arrays(_SHOWN, [columns[c.name] for c in _SHOWN], DT, {})


def _on_rig(rig: Fixture, controller: MacroLaw, aim: Array, start: float) -> Recording:
    """The same on any rig."""
    rig.need("the macro-stage under control", "encoder")
    memory = control.rest(0.0)
    integral = np.empty_like(aim)

    def follow(k: int, sample: Sample) -> tuple[Command, Outputs]:
        nonlocal memory
        motor = 0.0
        # A missing reading gives no effort and leaves the memory: the guard counts how long.
        if not math.isnan(sample.encoder):
            memory, motor = control.step(controller, memory, float(aim[k]) - sample.encoder, DT)
        integral[k] = control.integral(memory)
        return Command(float(aim[k]), 1.0, 0.0, 0.0, 0.0), Outputs(motor, 0.0, 0.0, 0.0)

    done = play(rig, "the macro-stage under control", len(aim), follow, start=start)
    columns = (done["t"], aim, done["encoder"], done["motor"], integral)
    return recorded(rig, _SHOWN, dict(zip(NAMES, columns, strict=True)), DT, 0)


def rise_time(x: Array, target: float, share: float = 0.98) -> float:
    """Time [s] until a move from x[0] to `target` first has this share behind it; or nan."""
    gone = (x - x[0]) / (target - x[0])
    return float(np.argmax(gone >= share)) * DT if gone.max() >= share else math.nan


def settling_time(x: Array, target: float, share: float = 0.02) -> float:
    """Time [s] from which on the error stays within this share of the move; or nan."""
    outside = np.flatnonzero(np.abs(target - x) > share * abs(target - x[0]))
    row = int(outside[-1]) + 1 if len(outside) else 0
    return row * DT if row < len(x) else math.nan


def overshoot(x: Array, target: float) -> float:
    """How far [counts] the position goes beyond `target` in the direction of the move."""
    return max(0.0, float((np.sign(target - x[0]) * (x - target)).max()))


def swings(x: Array, target: float, band: float = ARRIVED) -> Array:
    """Sizes [counts] of the swings back after arrival, one per reversal of the position.

    Arrival: the first error within `band` counts. Empty when it never arrives or never
    reverses. The motion that arrives is no swing.
    """
    near = np.abs(target - x) <= band
    if not near.any():
        return np.zeros(0)
    row = int(near.argmax())
    moved = np.diff(x[max(row - 1, 0) :])
    moved = moved[moved != 0.0]
    if not len(moved):
        return np.zeros(0)
    edges = np.flatnonzero(np.diff(np.sign(moved))) + 1
    return np.abs([float(part.sum()) for part in np.split(moved, edges)[1:]])


class Stuck(NamedTuple):
    """Stiction off the target: `seconds` that the carriage stands there while the effort ramps
    towards the target, from `begin` to `end` [V]; `back`: it then moves towards the target,
    against the way that it came."""

    seconds: float
    begin: float
    end: float
    back: bool


def sticking(x: Array, motor: Array, target: float, below: float) -> Stuck | None:
    """The longest time after the rise (98 %) in which `x` stays the same count off `target`
    while the effort [V] ramps by `RAMP` or more in the direction of the error, its size below
    `below` [V] all the time; None without one.

    At the target, or with an effort that stays or falls away, nothing is stuck.
    """
    rise = rise_time(x, target)
    if math.isnan(rise):
        return None
    first = round(rise / DT)
    edges = np.concatenate([[first], first + np.flatnonzero(np.diff(x[first:])) + 1, [len(x)]])
    found: list[Stuck] = []
    for a, b in pairwise(int(e) for e in edges):
        way = float(np.sign(target - x[a]))
        # The sample of a new count has the kick of the derivative.
        part = motor[a + 1 : b]
        if way == 0.0 or not len(part) or float(np.abs(part).max()) >= below:
            continue
        if way * (part[-1] - part[0]) < RAMP or float((way * np.diff(part)).min(initial=0.0)) < 0.0:
            continue
        turned = way * np.sign(target - x[0]) < 0.0
        moved = b < len(x) and way * (x[b] - x[a]) > 0.0
        pushed = way * part[-1] > 0.0
        back = bool(turned and moved and pushed)
        found.append(Stuck(len(part) * DT, float(part[0]), float(part[-1]), back))
    return max(found, key=lambda s: s.seconds, default=None)


def sign_changes(motor: Array) -> int:
    """How often the effort changes its sign, zeros left out."""
    signs = np.sign(motor[motor != 0.0])
    return int(np.count_nonzero(np.diff(signs)))


def nrmse(model: Array, measured: Array) -> float:
    """RMS difference over the range of `measured` [%]."""
    return 100.0 * float(np.sqrt(np.mean((model - measured) ** 2)) / np.ptp(measured))
