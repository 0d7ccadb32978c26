"""Disturbance of an axis with elastic friction: inverse dynamics along its measured path.

F = M a + (Fv + s Fa) v + f + tau df/dt + F0
"""

# The friction's elements follow the filtered positions, so f needs no free simulation.

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.identify._axis_refine import begun
from macromicro.identify._central import central
from macromicro.identify._presliding_search import Problem, Shape, bounds, nudges
from macromicro.identify._ripple import Ripple, ripple
from macromicro.identify.axis import late
from macromicro.identify.axis_inverse import HELD, Rows, differences, evened, smoothed
from macromicro.identify.presliding import STEPS, Presliding, begin, level, slid
from macromicro.identify.runs import Run
from macromicro.kernel import compiled, kernel

_LEAST = 40  # rows of a piece, of which the low-pass' ends take half
_MOST = 3.0  # standard deviations, by the median: more is not the force


@kernel
def rubbed(
    p: Presliding, x: Array, speed: float, pull: Array, h: float, f: Array, out: Array
) -> None:
    """Mean friction over each sample along a path, as a kernel."""
    part = h / STEPS
    begin(p, f, x[0], speed, pull[0])
    was = 0.0
    for k in range(len(f)):
        was += f[k]
    for i in range(len(x) - 1):
        v = (x[i + 1] - x[i]) / h
        mean, first = 0.0, was
        for j in range(STEPS):
            g = max(level(p, x[i] + (j + 0.5) * part * v, v), 1e-12)
            now = slid(p, f, g, v, part)
            mean += 0.5 * (was + now) / STEPS
            was = now
        out[i] = mean + p.settling * (was - first) / h
    out[len(x) - 1] = out[len(x) - 2]


def needed(rows: Rows, p: Presliding) -> Array:
    dt = rows.run.dt
    way = np.ascontiguousarray(smoothed(rows.run.x, rows.corner, dt))
    friction = np.empty_like(way)
    room = np.empty(max(len(p.shares), 1))
    compiled(rubbed)(p, way, begun(rows)[1], rows.force - p.offset, dt, room, friction)
    carried = p.mass * rows.a + p.viscous * rows.v
    rough = late(friction, HELD) + p.asymmetry * np.abs(rows.v) + p.offset
    table = evened(rows, [carried, rough], [False, True])
    return np.asarray(table.sum(axis=1))


class Disturbance(NamedTuple):
    """Unmeasured forces, by pieces that are long enough."""

    # shape (m,) per piece, N, less what the parameters can take up and less what repeats
    missed: list[Array]
    taken: list[Array]  # derivative of the force by each parameter, (m, p) per piece
    repeats: Ripple | None  # A force that repeats along the way, where there is one


def disturbed(problem: Problem, z: Array, shape: Shape, errors: list[Array]) -> Disturbance:
    """Unmeasured forces and the regressors that they were found with."""
    # The difference of inverse dynamics along the record and along the free simulation: both pass
    # the same filters, so artefacts of sudden friction changes cancel.
    low, _, scale = bounds(z, shape)
    model, high = problem.model(z, shape), np.full(len(z), np.inf)
    missed, taken, places = [], [], []
    for pieces, error in zip(problem.pieces, errors, strict=True):
        for first, many in zip(pieces.starts.tolist(), pieces.lengths.tolist(), strict=True):
            if many < _LEAST * pieces.rows.factor:
                continue
            at = slice(first, first + many)
            real = _part(pieces.rows, at, pieces.rows.run.x[at])
            free = _part(pieces.rows, at, pieces.rows.run.x[at] - error[at])

            def force(z: Array, one: Rows = real) -> Array:
                return needed(one, problem.model(z, shape))

            missed.append(force(z) - needed(free._replace(still=real.still), model))
            taken.append(central(force, z, nudges(z, scale, False), low, high))
            places.append(evened(real, [real.run.x], [False])[:, 0])
    if not missed:
        return Disturbance(missed, taken, None)
    table = np.concatenate(taken)
    left = np.concatenate(missed)
    left = left - table @ np.linalg.lstsq(table, left, rcond=None)[0]
    # Where an axis sticks a little elsewhere than its model, they differ much, for a few rows.
    repeats = ripple([_clipped(left)], [np.concatenate(places)], [table])
    if repeats is not None:
        left = left - repeats.at(np.concatenate(places))
        left = left - table @ np.linalg.lstsq(table, left, rcond=None)[0]
    cuts = np.cumsum([len(m) for m in missed])[:-1]
    return Disturbance(np.split(_clipped(left), cuts), taken, repeats)


def _clipped(force: Array) -> Array:
    """Forces with outliers clipped."""
    most = _MOST * 1.4826 * float(np.median(np.abs(force)))
    return np.clip(force, -most, most)


def _part(rows: Rows, at: slice, x: Array) -> Rows:
    run = Run(rows.run.t[at], rows.run.u[at], x)
    made = differences(run, rows.force[at], rows.corner, rows.factor)
    return made._replace(thin=rows.thin)
