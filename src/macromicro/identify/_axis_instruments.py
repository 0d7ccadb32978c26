"""Unbiased inverse dynamics: instruments from the free simulation (IDIM-IV).

A. Janot, P.-O. Vandanjon, M. Gautier, A generic instrumental variable approach for industrial robot
identification, IEEE Trans. Control Systems Technology 22 (2014).
"""

# Disturbing forces and position noise are also in the measured acceleration, which biases least
# squares towards zero. Regressors of a simulation under the measured force are free of both.

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from macromicro.arrays import Array
from macromicro.identify._ripple import Ripple
from macromicro.identify.axis import simulate
from macromicro.identify.axis_inverse import (
    SPEED,
    Estimate,
    Rows,
    by_speed,
    columns,
    corrected,
    differences,
    evened,
    linear,
    plausible,
    stacked,
    with_errors,
)
from macromicro.identify.search import triangle

_ROUNDS = 5
_SETTLED = 0.01  # standard errors
_POOR = 1e8
_LIKE = 0.9  # correlation of each instrument with its regressor, at least


def instrumented(rows: list[Rows], start: Estimate) -> Estimate:
    """Inverse dynamics with instruments; the start itself if its free simulation is no guide."""
    names = linear(start.names)
    speed = start.axis.stribeck_speed
    table, _ = stacked(rows, lambda r: columns(r, names, speed))
    left, force = table[:, :-1], table[:, -1]
    found = start
    for _ in range(_ROUNDS):
        if not plausible(found):
            return start
        guides = np.empty(0)  # those of the round before are in memory no longer
        guides = _instruments(rows, found, names)
        sizes = [np.sqrt(np.einsum("ij,ij->j", m, m)) for m in (guides, left)]
        if any((s == 0.0).any() for s in sizes):
            return start
        near = np.abs(np.einsum("ij,ij->j", guides, left)) / (sizes[0] * sizes[1])
        square = guides.T @ left / np.outer(*sizes)
        if near.min() < _LIKE or np.linalg.cond(square) > _POOR:
            # Friction that drops within a few samples is the first to be missed by a free run
            # that goes with the record otherwise: its reversals are blurred alike.
            others = near[[n != "stribeck" for n in names]]
            return _unblurred(rows, start, names) if others.min() >= _LIKE else start
        theta = np.linalg.solve(square, guides.T @ force / sizes[0]) / sizes[1]
        missed = force - left @ theta
        before, rms = found, float(np.sqrt(np.mean(missed**2)))
        found = replace(
            start,
            axis=start.axis._replace(**dict(zip(names, theta.tolist(), strict=True))),
            rms=rms,
            percent=100.0 * rms / float(np.sqrt(np.mean(force**2))),
        )
        found = with_errors(found, _slopes(rows, before, guides), missed)
        moved = np.abs(found.values - before.values)[: len(names)]
        if (moved <= _SETTLED * found.std[: len(names)]).all():
            break
    if not plausible(found):
        return start if plausible(start) else found
    return _unblurred(rows, found, names)


def under(rows: list[Rows], found: Estimate, repeats: Ripple | None) -> Estimate:
    """The errors with those by a force that repeats along the way, in any phase."""
    # Its two quadratures move the parameters by a and b, a phase that may be any by (a a' + b b')/2
    if repeats is None or not plausible(found):
        return replace(found, repeats=repeats)

    def quadratures(rows: Rows) -> Array:
        turns = (repeats.at(rows.run.x, turn) for turn in (0.0, 0.5 * math.pi))
        return evened(rows, turns, [True, True])

    names = linear(found.names)
    slopes = _slopes(rows, found, _instruments(rows, found, names))
    pair, _ = stacked(rows, quadratures)
    size = np.linalg.norm(slopes, axis=0)  # none is 0: the parameters were found by them
    moved = np.linalg.lstsq(slopes / size, pair, rcond=None)[0] / size[:, None]
    covariance = np.asarray(found.covariance + 0.5 * (moved @ moved.T))
    return replace(found, covariance=covariance, repeats=repeats)


def _slopes(rows: list[Rows], found: Estimate, guides: Array) -> Array:
    """Regressors of all parameters, to first order including Stribeck's speed."""
    if SPEED not in found.names:
        return guides
    other, _ = stacked(
        rows, lambda r: by_speed([_free(r, found)._replace(still=r.still)], found)[:, None]
    )
    return np.asarray(np.c_[guides, other])


def _unblurred(rows: list[Rows], found: Estimate, names: tuple[str, ...]) -> Estimate:
    """The estimate less the bias of the method on the axis' own free simulation."""
    # The low-pass blurs reversals, where friction changes sign at once, which biases the result
    # even without noise.
    speed, searched = found.axis.stribeck_speed, SPEED in found.names

    def made(rows: Rows) -> Array:
        run = _free(rows, found)
        run = run._replace(still=run.still | rows.still)
        table = columns(run, names, speed)
        return np.c_[by_speed([run], found), table] if searched else table

    square = triangle(made(r) for r in rows)
    guides, force = square[:, :-1], square[:, -1]
    if searched:
        guides = np.roll(guides, -1, axis=1)
    sizes = np.linalg.norm(guides, axis=0)
    sizes[sizes == 0.0] = 1.0
    own = np.linalg.lstsq(guides / sizes, force, rcond=None)[0] / sizes
    held = np.zeros(len(own))
    held[len(names) :] = speed
    return corrected(found, own + held)


def _instruments(rows: list[Rows], estimate: Estimate, names: tuple[str, ...]) -> Array:
    speed = estimate.axis.stribeck_speed

    def made(rows: Rows) -> Array:
        run = _free(rows, estimate)._replace(still=rows.still)
        return columns(run, names, speed, forced=False)

    return stacked(rows, made)[0]


def _free(rows: Rows, estimate: Estimate) -> Rows:
    r = rows.run
    x = simulate(estimate.axis, rows.force, r.dt, float(r.x[0]), float(rows.v[0]))
    made = differences(r._replace(x=x), rows.force, rows.corner, rows.factor)
    return made._replace(eccentric=rows.eccentric)
