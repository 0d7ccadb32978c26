"""Efforts where a motion turns back, learned from circles at several speeds.

Friction turns round over some way, and grows with the speed there. So an effort is taken off and
one per speed is added, both of which fade over that way. Circles with each of them show its effect
on the following error; both are then chosen for the least error.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import count, pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import nnls

from macromicro.arrays import Array
from macromicro.calibration import measuring, targets
from macromicro.machines import composite, correcting, programmes
from macromicro.machines.composite import Composite
from macromicro.machines.joint import planning
from macromicro.machines.joint.course import Leg
from macromicro.machines.moves import Course
from macromicro.machines.planning import Planned
from macromicro.machines.sequence import MOVING
from macromicro.motion import path as paths
from macromicro.recording import Recording
from macromicro.rig.session import Fixture

SPEEDS = (1.0, 0.5, 0.25)  # of the circles, of the greatest
RADIUS = 0.4  # of the shorter travel
TURNS = 2  # of a circle
WAYS = (2.0, 4.0, 8.0, 16.0, 32.0)  # counts
AFTER = 0.02  # of the time from a reversal to the next: what counts as its error
ROUNDS = 4  # of choosing both: together they do more than the sum of what each does
TRIED = 3.0  # times the law's effort against friction: the effort per speed that is tried


class Turning(NamedTuple):
    """RMS following error after reversals, before and after."""

    before: float  # m
    after: float


class _Circles(NamedTuple):
    plan: Planned
    acceleration: float  # of the fastest, m/s^2


class _Trial(NamedTuple):
    """What is added where a stage turns back."""

    effort: float = 0.0  # V
    damping: float = 0.0  # V s/m
    way: float = 1.0  # m


def learn(
    machine: Composite,
    settings: Any,
    seed: int = 0,
    bench: Any = None,
    rigs: Sequence[Fixture] | None = None,
) -> tuple[Any, tuple[Turning, ...]]:
    """Settings that know the efforts of each axis, and what they gain."""
    ready, settings = measuring.ready(machine, settings)
    assert isinstance(ready, Composite)
    machine = ready
    circles, trees, seeds = _circles(machine, settings), machine.trees(settings), count(seed)

    def errors(trials: Sequence[_Trial]) -> list[Array]:
        tried = _with(machine, settings, trials)
        how: dict[str, Any] = {"seed": next(seeds), "bench": bench, "rigs": rigs}
        found = measuring.record(machine, tried, circles.plan, "the circles", **how)
        each = zip(targets.names(machine), composite.places(machine), strict=True)
        return [_after(found, start) / place.per for start, place in each]

    nothing = [_Trial() for _ in trees]
    before = errors(nothing)
    best = [(_rms(error), trial) for error, trial in zip(before, nothing, strict=True)]
    for counts in WAYS:
        units = [_unit(own, counts, circles.acceleration) for own in trees]
        first = errors([unit._replace(damping=0.0) for unit in units])
        second = errors([unit._replace(effort=0.0) for unit in units])
        effects = [
            np.stack((one - zero, two - zero), axis=1)
            for one, two, zero in zip(first, second, before, strict=True)
        ]
        seen, trials = before, [unit._replace(effort=0.0, damping=0.0) for unit in units]
        for _ in range(ROUNDS):
            pairs = zip(seen, effects, units, trials, strict=True)
            trials = [_least(*each) for each in pairs]
            seen = errors(trials)
            results = [(_rms(error), trial) for error, trial in zip(seen, trials, strict=True)]
            best = [min(pair) for pair in zip(best, results, strict=True)]
    chosen = [trial for _, trial in best]
    rms = [[_rms(e) for e in errors(trials)] for trials in (nothing, chosen)]
    found = tuple(Turning(*each) for each in zip(*rms, strict=True))
    kept = [
        trial if turn.after < turn.before else _Trial()
        for trial, turn in zip(chosen, found, strict=True)
    ]
    return _with(machine, settings, kept), found


def _circles(machine: Composite, settings: Any) -> _Circles:
    trees = machine.trees(settings)
    spans = [targets.span(own) for own in trees]
    x, y = (0.5 * (low + high) for low, high in spans)
    radius = RADIUS * min(high - low for low, high in spans)
    start = (x - radius, y)
    arc = paths.arc(start, (x, y), TURNS * paths.TURN)
    fastest = planning.limits(arc, settings).speed
    legs = [Leg("line", (paths.line((0.0, 0.0), start),), (math.inf,), start, targets.HOLD)]
    legs += [Leg("arc", (arc,), (share * fastest,), start, targets.HOLD) for share in SPEEDS]
    plan = programmes.plan(machine, settings, Course("circles", tuple(legs), "the circles"))
    return _Circles(plan, fastest**2 / radius)


def _unit(own: Any, counts: float, acceleration: float) -> _Trial:
    """What is tried first: the law's effort against friction."""
    way, friction = counts * float(own.encoder.pitch), correcting.load(own).friction
    return _Trial(friction, TRIED * friction / math.sqrt(2.0 * acceleration * way), way)


def _least(seen: Array, effects: Array, unit: _Trial, trial: _Trial) -> _Trial:
    """The efforts with the least error, none of them negative, from an error seen with others."""
    pairs = ((trial.effort, unit.effort), (trial.damping, unit.damping))
    shares = [value / one if one > 0.0 else 0.0 for value, one in pairs]
    (first, second), _ = nnls(effects, effects @ shares - seen)
    return unit._replace(effort=first * unit.effort, damping=second * unit.damping)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _with(machine: Composite, settings: Any, trials: Sequence[_Trial]) -> Any:
    changed = []
    for own, trial in zip(machine.trees(settings), trials, strict=True):
        names = ("turn_effort", "turn_damping", "turn_way")
        found = {name: float(f"{value:.6g}") for name, value in zip(names, trial, strict=True)}
        changed.append(own._replace(correction=own.correction._replace(**found)))
    return composite.with_trees(machine, settings, changed)


def _after(found: Recording, start: str) -> Array:
    """Following errors of an axis after all its reversals on circles."""
    names = ("target", "position", "target_speed")
    target, position, speed = (found[f"{start}{name}"] for name in names)
    moving = found["phase"] == MOVING
    parts = []
    for move in range(1, len(SPEEDS) + 1):
        rows = np.flatnonzero(moving & (found["move"] == move))
        turns = np.flatnonzero(np.diff(np.sign(speed[rows])))
        length = max(round(AFTER * min(b - a for a, b in pairwise(turns))), 1)
        for turn in turns[1:-1]:  # without the begin and the end, at rest
            own = rows[turn + 1 : turn + 1 + length]
            parts.append(target[own] - position[own])
    return np.concatenate(parts)
