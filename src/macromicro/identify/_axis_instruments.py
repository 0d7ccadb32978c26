"""Unbiased inverse dynamics: instruments from the free simulation (IDIM-IV).

A. Janot, P.-O. Vandanjon, M. Gautier, A generic instrumental variable approach for industrial robot
identification, IEEE Trans. Control Systems Technology 22 (2014).
"""

# Disturbing forces and position noise are also in the measured acceleration, which biases least
# squares towards zero. Regressors of a simulation under the measured force are free of both.

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.identify import _counts
from macromicro.identify._axis_cogging import cogged, repeating
from macromicro.identify._axis_noise import sensed
from macromicro.identify._ripple import Ripple
from macromicro.identify._spread import robust_covariance
from macromicro.identify._triangle import triangle
from macromicro.identify.axis import Axis, simulate
from macromicro.identify.axis_inverse import (
    SPEED,
    Estimate,
    Rows,
    by_speed,
    columns,
    corrected,
    differences,
    linear,
    plausible,
    stacked,
)
from macromicro.identify.coverage import Drawn

_ROUNDS = 5
_SETTLED = 0.01  # standard errors
_POOR = 1e8
_LIKE = 0.9  # correlation of each instrument with its regressor, at least
_DRAWS, _FEWEST, _WORK = 60, 20, 1_000_000  # draws; fewer of long records, by samples in all


def instrumented(rows: list[Rows], start: Estimate, *, told: bool = True) -> Estimate:
    """Inverse dynamics with instruments; the start itself if its free simulation is no guide."""
    names = linear(start.names)
    speed = start.axis.stribeck_speed
    table, lengths = stacked(rows, lambda r: columns(r, names, speed))
    left, force, ends = table[:, :-1], table[:, -1], np.cumsum(lengths)
    found = start
    for _ in range(_ROUNDS if told else 1):
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
            return _unblurred(rows, start, names) if told and others.min() >= _LIKE else start
        theta = np.linalg.solve(square, guides.T @ force / sizes[0]) / sizes[1]
        missed = force - left @ theta
        spread = start.covariance.copy()
        if told:
            spread = _spread(rows, found, guides, left, missed, ends)
        values = dict(zip(names, theta.tolist(), strict=True))
        before, rms = found, float(np.sqrt(np.mean(missed**2)))
        found = replace(
            start,
            axis=start.axis._replace(**values),
            covariance=spread,
            rms=rms,
            percent=100.0 * rms / float(np.sqrt(np.mean(force**2))),
        )
        moved = np.abs(found.values - before.values)[: len(names)]
        if (moved <= _SETTLED * found.std[: len(names)]).all():
            break
    if not plausible(found):
        return start if plausible(start) else found
    repeats = repeating(rows, left, missed) if told else None
    found = replace(found, searched=told)
    if repeats is not None:
        found = _repeated(found, repeats.force, cogged(repeats, guides, left))
    return _unblurred(rows, found, names)


def _spread(
    rows: list[Rows],
    found: Estimate,
    guides: Array,
    left: Array,
    missed: Array,
    ends: npt.NDArray[np.int64],
) -> Array:
    """Covariance of all parameters, to first order including Stribeck's speed."""
    if SPEED in found.names:
        other, _ = stacked(
            rows, lambda r: by_speed([_free(r, found)._replace(still=r.still)], found)[:, None]
        )
        guides, left = np.c_[guides, other], np.c_[left, by_speed(rows, found)]
    return robust_covariance(guides, missed, ends, None, left)


def _repeated(found: Estimate, force: Ripple, told: Drawn) -> Estimate:
    p, spread = len(told.covariance), found.covariance.copy()
    spread[:p, :p] = told.covariance
    draws = np.zeros((len(told.draws), len(spread)))
    draws[:, :p] = told.draws
    return replace(found, covariance=spread, draws=draws, repeats=force)


def redrawn(rows: list[Rows], found: Estimate, axis: Axis, ways: list[Array]) -> Estimate:
    """The estimate with the errors due to position noise, where nothing else disturbs."""
    # Behind the low-pass, rounding is neither white nor stationary, and doubly differentiated white
    # noise is too steep for an autoregression. Both are drawn along trajectories of a known axis;
    # the error is the estimate less that axis, so the bias at reversals is included.
    known = {n: getattr(axis, n) for n in linear(found.names)}
    start = replace(found, axis=found.axis._replace(**known))
    sizes = [sensed(r.run.x) for r in rows]
    steps = [_counts.felt(r.run.x, size**2) for r, size in zip(rows, sizes, strict=True)]
    many, off = max(min(_DRAWS, _WORK // sum(map(len, ways))), _FEWEST), []
    random = np.random.Generator(np.random.PCG64(0))  # the same data give the same errors
    for zeros in _counts.places(len(rows), many):
        drawn = []
        for r, way, size, step, at in zip(rows, ways, sizes, steps, zeros, strict=True):
            white = size * random.standard_normal(len(way))
            noise = white if step is None else _counts.off(way, step, at)
            made = differences(r.run._replace(x=way + noise), r.force, r.corner, r.factor)
            drawn.append(made._replace(eccentric=r.eccentric))
        one = instrumented(drawn, start, told=False)
        if one is start:
            return found
        off.append(one.values - start.values)
    draws = np.array(off)
    spread = draws.T @ draws / many
    held = np.array([n == SPEED for n in found.names])  # it was not searched for in the draws
    spread[held] = spread[:, held] = np.nan
    return replace(found, covariance=spread, draws=draws if any(steps) else None)


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
