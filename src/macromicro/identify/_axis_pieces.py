"""Free simulations over pieces of a record, each from its own initial state."""

# Over a whole record disturbing forces accumulate like a random walk; in pieces, a longer record
# gives a better estimate. If position noise dominates, the initial states are estimated with the
# parameters: the position as the mean error, or, where gravity depends on it, like the speed.

from __future__ import annotations

from functools import singledispatch
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.identify.axis import Axis, acting, late, step
from macromicro.identify.axis_inverse import Rows
from macromicro.kernel import compiled, kernel

Index = npt.NDArray[np.int64]
_ROUNDS = 2  # Gauss-Newton steps for the speeds at the start: a free run is nearly linear in them
_REST = 0.02  # of the greatest speed
_NUDGE = 1e-3  # of the greatest speed, for the slope by it
_TURN = 1e-3  # rad, for the slope by the angle


class Pieces(NamedTuple):
    rows: Rows  # the record
    starts: Index  # first sample of each piece, the first one 0
    lengths: Index  # samples of each
    # whether position and speed at the start of each are found with the parameters; else they are
    # as measured
    free: bool
    # whether a free piece that begins at rest goes on from rest: elastic friction is then in
    # balance with the force, and beside a speed, however small, at its level
    rests: bool = False

    @property
    def placed(self) -> bool:
        """Whether initial positions are estimated rather than only shift what follows."""
        return self.free and self.rows.eccentric


class Settled(NamedTuple):
    error: Array  # measured less free run; of free starts, its mean taken off in each piece
    speeds: Array  # at the start of each piece, units of x/s
    # of the free run by its piece's speed, centred and of length one; 0 where it moves nothing
    slope: Array
    at: Array  # place at the start of each piece
    # what of the slope by that place is not in `slope`, of length one; 0 where a place only shifts
    # all that follows
    shift: Array


def cut(rows: list[Rows], length: int, free: bool) -> list[Pieces]:
    made = []
    for r in rows:
        n = len(r.v)
        ends = np.linspace(0, n, max(round(n / length), 1) + 1).round().astype(np.int64)
        made.append(Pieces(r, ends[:-1], np.diff(ends), free))
    return made


@kernel
def restarted(
    p: Axis, force: Array, starts: Index, at: Array, speeds: Array, h: float, out: Array
) -> None:
    """Distances under a force, from 0 and a new speed at the start of each piece, as a kernel."""
    piece = 0
    first = 0.0
    x = 0.0
    v = 0.0
    for k in range(len(out)):
        if piece < len(starts) and k == starts[piece]:
            first = at[piece]
            x = 0.0
            v = speeds[piece]
            piece += 1
        out[k] = x
        v, gone = step(p, v, acting(p, force[k], first + x, v, h), h)
        x += gone


@singledispatch
def laid(
    model: Any,
    force: Array,
    starts: Index,
    at: Array,
    speeds: Array,
    dt: float,
) -> Array:
    out = np.empty_like(force)
    plain = Axis(*(float(value) for value in model))
    pull = np.ascontiguousarray(late(force, model.lag / dt))
    compiled(restarted)(plain, pull, starts, at, speeds, float(dt), out)
    return out


def runs(cutting: Pieces, axis: Any, speeds: Array, at: Array | None = None) -> Array:
    """Free simulations over the pieces from 0, less the mean of free starts."""
    r = cutting.rows
    if at is None:
        at = r.run.x[cutting.starts]
    made = laid(axis, r.force, cutting.starts, at, speeds, r.run.dt)
    if cutting.placed:
        return np.asarray(made + np.repeat(at, cutting.lengths))
    return centred(cutting, made)


def centred(cutting: Pieces, values: Array) -> Array:
    """Values less their mean (free starts) or their first (measured starts)."""
    if cutting.placed:
        return values
    level = values[cutting.starts]
    if cutting.free:
        level = np.add.reduceat(values, cutting.starts) / cutting.lengths
    return np.asarray(values - np.repeat(level, cutting.lengths))


def settled(cutting: Pieces, axis: Any) -> Settled:
    """Free simulations from measured speeds, or from those nearest to the record."""
    # Measured speeds are filtered; less than 2 % of the maximum counts as rest. The search for
    # other speeds starts there and rejects steps that do not lower the error.
    r = cutting.rows
    seen = centred(cutting, r.run.x)
    fastest = float(np.abs(r.v).max())
    nudge = _NUDGE * fastest
    speeds = np.where(np.abs(r.v[cutting.starts]) > _REST * fastest, r.v[cutting.starts], 0.0)
    at, none = r.run.x[cutting.starts], np.zeros_like(seen)
    if cutting.placed:
        return _placed(cutting, axis, at, speeds, nudge)
    made = runs(cutting, axis, speeds)
    if not cutting.free:
        return Settled(seen - made, speeds, none, at, none)

    moving = np.ones(len(speeds)) if not cutting.rests else (speeds != 0.0).astype(np.float64)

    for left in range(_ROUNDS, -1, -1):
        error = seen - made
        slope = (runs(cutting, axis, speeds + nudge * moving) - made) / nudge
        if not left:
            break
        power = _total(cutting, slope * slope)
        asked = _total(cutting, slope * error)
        step = np.divide(asked, power, out=np.zeros_like(power), where=power > 0.0)
        tried = runs(cutting, axis, speeds + step)
        nearer = _total(cutting, (seen - tried) ** 2) < _total(cutting, error**2)
        speeds = np.where(nearer, speeds + step, speeds)
        made = np.where(np.repeat(nearer, cutting.lengths), tried, made)
    return Settled(error, speeds, _unit(cutting, slope), at, none)


def _total(cutting: Pieces, values: Array) -> Array:
    return np.asarray(np.add.reduceat(values, cutting.starts))


def _unit(cutting: Pieces, values: Array) -> Array:
    """Values scaled to length one in each piece, 0 where they are 0."""
    power = _total(cutting, values * values)
    return np.asarray(
        values / np.repeat(np.sqrt(np.where(power > 0.0, power, 1.0)), cutting.lengths)
    )


def _less(cutting: Pieces, unit: Array, values: Array) -> Array:
    """Part of values orthogonal to unit vectors, in each piece."""
    share = _total(cutting, values * unit)
    return np.asarray(values - unit * np.repeat(share, cutting.lengths))


def _placed(cutting: Pieces, axis: Any, at: Array, speeds: Array, nudge: float) -> Settled:
    seen = cutting.rows.run.x
    made = runs(cutting, axis, speeds, at)
    for left in range(_ROUNDS, -1, -1):
        error = seen - made
        slope = (runs(cutting, axis, speeds + nudge, at) - made) / nudge
        turn = (runs(cutting, axis, speeds, at + _TURN) - made) / _TURN
        across = _less(cutting, _unit(cutting, slope), turn)
        if not left:
            break
        # Of the two: the place by what lies across the other, then the speed by the rest.
        power = _total(cutting, across * across), _total(cutting, slope * slope)
        moves = [np.divide(1.0, p, out=np.zeros_like(p), where=p > 0.0) for p in power]
        by = _total(cutting, across * error) * moves[0]
        rest = error - turn * np.repeat(by, cutting.lengths)
        step = _total(cutting, slope * rest) * moves[1]
        tried = runs(cutting, axis, speeds + step, at + by)
        nearer = _total(cutting, (seen - tried) ** 2) < _total(cutting, error**2)
        speeds, at = np.where(nearer, speeds + step, speeds), np.where(nearer, at + by, at)
        made = np.where(np.repeat(nearer, cutting.lengths), tried, made)
    return Settled(error, speeds, _unit(cutting, slope), at, _unit(cutting, across))


def cleared(cutting: Pieces, at: Settled, values: Array) -> Array:
    """Values less what the initial states explain: mean and slope in each free piece."""
    if not cutting.free:
        return values
    even = _less(cutting, at.slope, centred(cutting, values))
    return _less(cutting, at.shift, even) if cutting.placed else even
