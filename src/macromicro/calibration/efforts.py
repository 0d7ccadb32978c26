"""Efforts that repeat along the travel (cogging, friction, weight), from slow passes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.calibration import fitting, measuring, targets
from macromicro.machines import planning
from macromicro.machines.machine import Machine
from macromicro.machines.sequence import MOVING
from macromicro.place import of as place_of
from macromicro.rig.session import Fixture

SPEED = 0.01  # of the greatest; at most 5 mm/s, or 5 deg/s of a stage that turns
SLOWEST = (5e-3, math.radians(5.0))  # m/s, rad/s
STARTING = 0.05  # of a pass, in which friction and law settle
AVERAGED, COUNTS = 0.1, 20.0  # s, or counts if that is longer, over which a speed is taken
LONGEST = 30.0  # s; a pass covers no more of the travel than this takes
TABLE = (3, 5, 9, 17)
POINTS = 4000  # of a fit
CYCLES = 400.0  # most periods along a pass


class Passes(NamedTuple):
    """Two slow passes over the same way, up and down."""

    place: Array  # m
    effort: Array  # V
    direction: Array
    ripple: float  # RMS deviation of the speed from the set point's once it is steady, m/s


def slow(settings: Any) -> float:
    """Speed of a pass, m/s."""
    return float(min(SPEED * settings.motion.velocity, SLOWEST[int(place_of(settings).turns)]))


def passes(
    machine: Machine,
    settings: Any,
    seed: int = 0,
    bench: Any = None,
    rigs: Sequence[Fixture] | None = None,
) -> Passes:
    """Go slowly up and down, and record efforts and the own sensor's readings."""
    low, high = targets.span(settings)
    place = place_of(settings)
    speed = slow(settings)
    high = min(high, low + speed * LONGEST)
    fast = settings.motion.velocity
    ends = ((low, fast), (high, speed), (low, speed))
    plan = planning.stops(ends, targets.HOLD, settings, "the slow passes")
    how: dict[str, Any] = {"seed": seed, "bench": bench, "rigs": rigs}
    found = measuring.record(machine, settings, plan, "the slow passes", **how)
    wanted = ("move", "phase", "reading", "effort", "target_speed", "t")
    move, phase, reading, effort, wish, t = (found[name] for name in wanted)
    at_speed = (phase == MOVING) & (np.abs(wish) > 0.99 * speed * place.per)
    steady = np.zeros(len(move), dtype=bool)
    for way in (1, 2):
        rows = np.flatnonzero(at_speed & (move == way))
        steady[rows[round(STARTING * len(rows)) :]] = True
    x = reading / place.per
    dt = float(settings.timing.period)
    span = max(round(max(AVERAGED, COUNTS * settings.encoder.pitch / speed) / dt), 1)
    moved = np.full(len(x), np.nan)
    moved[span:] = (x[span:] - x[:-span]) / (t[span:] - t[:-span])
    inside = steady & np.isfinite(moved)
    inside[span:] &= steady[:-span]
    off = np.abs(moved[inside]) - speed
    return Passes(x[steady], effort[steady], np.sign(wish)[steady], float(np.sqrt(np.mean(off**2))))


def fit(found: Passes, low: float, high: float, periods: list[float]) -> dict[str, Any]:
    """Fields of the correction: a table for each direction, and what repeats."""
    step = max(len(found.place) // POINTS, 1)
    x = _thin(found.place, step)
    effort, way = _thin(found.effort, step), _thin(found.direction, step)
    both = np.stack([(way > 0.0).astype(float), (way < 0.0).astype(float)], axis=1)
    left = effort - both @ np.linalg.lstsq(both, effort, rcond=None)[0]
    period = _strongest(x, left, periods)
    waves = fitting.waves(period, x)
    best, score, size = None, math.inf, 0
    inside = (float(x.min()), float(x.max()))
    for count in (0, *TABLE):
        parts = [both, waves]
        if count:
            table = fitting.basis(*inside, count, x)
            parts += [(way > 0.0)[:, None] * table, (way < 0.0)[:, None] * table]
        matrix = np.concatenate(parts, axis=1)
        tried = _held_out(x, matrix, effort)
        if tried < 0.95 * score:
            best, score, size = matrix, tried, count
    assert best is not None
    solved = fitting.solve(best, effort)
    made: dict[str, Any] = {
        "effort_period": period,
        "effort_waves": tuple(solved[2 : 2 + waves.shape[1]].tolist()),
    }
    if size:
        tables = solved[2 + waves.shape[1] :].reshape(2, size)
        # Their means are friction, against which the law has an effort of its own.
        tables = tables - tables.mean(axis=1, keepdims=True)
        places = np.clip(np.linspace(low, high, 2 * size - 1), *inside)
        weights = fitting.basis(*inside, size, places)
        names = ("effort_up", "effort_down")
        made |= {
            name: tuple((weights @ own).tolist()) for name, own in zip(names, tables, strict=True)
        }
    return made


def _thin(values: Array, step: int) -> Array:
    count = len(values) // step * step
    return np.asarray(values[:count].reshape(-1, step).mean(axis=1))


def _strongest(x: Array, left: Array, periods: list[float]) -> float:
    """The period that explains most: of those that the drive suggests, or of a spectrum."""
    length = float(np.ptp(x))
    cycles = [length / period for period in periods if 0.0 < period < length]
    cycles += np.arange(2.0, CYCLES, 1.0 / fitting.FREQUENCIES).tolist()

    return fitting.strongest(x, left, length, np.array(cycles))


def _held_out(x: Array, matrix: Array, wanted: Array) -> float:
    """RMS error in stretches of the travel that a fit has not seen."""
    stretch = np.floor(fitting.FOLDS * 8 * (x - x.min()) / (np.ptp(x) + 1e-12)) % fitting.FOLDS
    errors = []
    for fold in range(fitting.FOLDS):
        out = stretch == fold
        errors.append(wanted[out] - matrix[out] @ fitting.solve(matrix[~out], wanted[~out]))
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))
