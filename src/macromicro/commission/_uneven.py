"""Friction that varies with the position, fitted together with the model."""

# It is common to all strokes, so no number of them averages it away. Levels along the travel (hat
# functions) represent it, with a Gaussian prior from the measured breakaway.

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.commission.stand import Record
from macromicro.identify.axis import Axis, acting, late, step
from macromicro.kernel import compiled, kernel

KNOTS = 20
_ROUNDS, _HALVED = 8, 3
_SETTLED = 0.99  # a round that lowers the mean square by less is the last
_WITNESSES = 5.0  # values that a stroke counts for when data and prior are weighed
_COMPARED = 150  # samples of each stroke
_STEP = 0.01  # of a parameter, for differences


class Level(NamedTuple):
    places: Array  # evenly spaced, m
    levels: Array  # in addition to Coulomb friction, V


class Fit(NamedTuple):
    axis: Axis  # the parameters
    level: Level  # friction along the travel
    covariance: Array  # of the parameters, a stroke a witness
    # strokes less all that was fitted, the levels as far as the prior leaves them free
    freedom: float
    square: float  # mean square of the positions missed, m^2


@kernel
def free_run(
    p: Axis, places: Array, levels: Array, force: Array, x: float, h: float, out: Array
) -> None:
    """Positions from rest under a force, with friction along the travel."""
    v = 0.0
    apart = places[1] - places[0]
    for k in range(len(out)):
        out[k] = x
        at = min(max((x - places[0]) / apart, 0.0), len(places) - 1.000001)
        j = int(at)
        level = levels[j] + (at - j) * (levels[j + 1] - levels[j])
        here = Axis(
            p.mass,
            p.viscous,
            max(p.coulomb + level, 0.0),
            p.offset,
            p.asymmetry,
            p.stribeck,
            p.stribeck_speed,
            p.lag,
            p.limit,
            p.back,
            p.sine,
            p.cosine,
            p.spring,
            p.dead_zone,
        )
        v, gone = step(here, v, acting(p, force[k], x, v, h), h)
        x += gone


def missed(strokes: Sequence[Record], axis: Axis, level: Level, dt: float) -> list[Array]:
    plain = Axis(*(float(value) for value in axis))
    run = compiled(free_run)
    found = []
    for one in strokes:
        out = np.empty_like(one.x)
        run(plain, level.places, level.levels, late(one.u, axis.lag / dt), float(one.x[0]), dt, out)
        found.append(one.x - out)
    return found


def held(axis: Axis, breakaway: float) -> Axis:
    """An axis with the measured breakaway friction."""
    return axis._replace(stribeck=max(breakaway - axis.coulomb, 0.0))


def fitted(
    strokes: Sequence[Record],
    start: Axis,
    names: tuple[str, ...],
    *,
    breakaway: float,
    spread: float,
    dt: float,
) -> Fit:
    """Parameters and friction along the travel by Gauss-Newton, from a simpler search."""
    every = np.concatenate([one.x for one in strokes])
    level = Level(np.linspace(every.min(), every.max(), KNOTS), np.zeros(KNOTS))
    count, steps = len(names), np.array([_step(start, n, dt) for n in names])
    prior = np.concatenate([np.zeros(count), np.full(KNOTS, 1.0 / spread**2)])

    def axis(by: Array) -> Axis:
        values = {n: getattr(start, n) + b for n, b in zip(names, by, strict=True)}
        values = {n: min(max(v, _LEAST[n]), _MOST.get(n, math.inf)) for n, v in values.items()}
        return held(start._replace(**values), breakaway)

    some = [taken(one) for one in strokes]
    free = [_beginning(one.t[k], start) for one, k in zip(strokes, some, strict=True)]

    def errors(by: Array) -> Array:
        run = missed(strokes, axis(by[:count]), level._replace(levels=by[count:]), dt)
        parts = [e[k] for e, k in zip(run, some, strict=True)]
        return np.concatenate([e - q @ (q.T @ e) for e, q in zip(parts, free, strict=True)])

    by = np.zeros(count + KNOTS)
    steps = np.concatenate([steps, np.full(KNOTS, _STEP * max(start.coulomb, spread))])
    error = errors(by)
    weight = np.mean(error**2) * len(error) / (_WITNESSES * len(strokes))
    for _ in range(_ROUNDS):
        jacobian = _slopes(errors, by, steps)
        normal = jacobian.T @ jacobian + weight * np.diag(prior)
        slope = jacobian.T @ error - weight * prior * by
        change, before = np.linalg.pinv(normal, hermitian=True) @ slope, np.mean(error**2)
        for _ in range(_HALVED):
            tried = errors(by + change)
            if np.mean(tried**2) < before:
                by, error = by + change, tried
                break
            change = 0.5 * change
        if np.mean(error**2) > _SETTLED * before:
            break
    jacobian = _slopes(errors, by, steps)
    weight = np.mean(error**2) * len(error) / (_WITNESSES * len(strokes))
    bread = np.linalg.pinv(jacobian.T @ jacobian + weight * np.diag(prior), hermitian=True)
    freedom = len(strokes) - float(np.trace(bread @ (jacobian.T @ jacobian)))
    cuts = np.cumsum([len(k) for k in some])[:-1]
    parts = zip(np.split(jacobian, cuts), np.split(error, cuts), strict=True)
    scores = np.stack([j.T @ e for j, e in parts])
    freedom = max(freedom, 1.0)
    covariance = len(strokes) / freedom * bread @ (scores.T @ scores) @ bread
    found = level._replace(levels=by[count:])
    square = float(np.mean(error**2))
    final = axis(by[:count])
    return Fit(
        Axis(*(float(value) for value in final)), found, covariance[:count, :count], freedom, square
    )


_LEAST = {
    "mass": 1e-12,
    "viscous": 0.0,
    "coulomb": 0.0,
    "offset": -math.inf,
    "lag": 0.0,
    "limit": 0.0,
    "back": 0.0,
    "sine": -math.inf,
    "cosine": -math.inf,
}
_MOST = {"back": 1.0}


def taken(stroke: Record) -> npt.NDArray[np.intp]:
    """Compared samples; positions are smooth, so some suffice."""
    count = min(len(stroke.t), _COMPARED)
    return np.linspace(0, len(stroke.t) - 1, count).round().astype(np.intp)


def _beginning(t: Array, axis: Axis) -> Array:
    """An orthonormal basis of the effects of a stroke's initial position and speed."""
    # Bristles absorb momentum before sliding, which sliding friction does not model; so these
    # effects are projected out of the errors.
    fall = axis.viscous / axis.mass
    way = t if fall * t[-1] < 1e-6 else -np.expm1(-fall * t) / fall
    return np.asarray(np.linalg.qr(np.stack([np.ones_like(way), way], axis=1))[0])


def _step(axis: Axis, name: str, dt: float) -> float:
    """Step of a parameter for differences."""
    if name == "lag":
        return 0.1 * dt
    if name == "back":
        return -_STEP if axis.back > 0.5 else _STEP  # into what may be
    if name in ("offset", "sine", "cosine"):
        return float(_STEP * max(abs(getattr(axis, name)), axis.coulomb))
    return float(_STEP * max(abs(getattr(axis, name)), 1e-9))


def _slopes(errors: Callable[[Array], Array], by: Array, steps: Array) -> Array:
    """Slopes of the simulated positions by differences."""
    here, columns = errors(by), []
    for k, change in enumerate(steps):
        there = by.copy()
        there[k] += change
        columns.append((here - errors(there)) / change)
    return np.stack(columns, axis=1)
