"""Free runs of an axis over pieces of its records, each from a state of its own.

Over a whole record the errors of a free run pile up like a random walk, for whatever disturbs the
force acts on all that comes after. Cut into pieces, each from the position and speed at its start,
the same record tells the more the longer it is. Where it is noise of the position that a free run
misses by, these starts are as little known as any sample, and are found with the parameters: the
place as the mean of what is missed, or, where gravity makes one place another than the next, as the
speed is.
"""

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
    """One record in pieces.

    Attributes
    ----------
    rows : Rows
        The record.
    starts : ndarray, shape (k,)
        First sample of each piece, the first one 0.
    lengths : ndarray, shape (k,)
        Samples of each.
    free : bool
        Whether position and speed at the start of each are found with the parameters; else they are
        as measured.
    rests : bool
        Whether a free piece that begins at rest goes on from rest: elastic friction is then in
        balance with the force, and beside a speed, however small, at its level.
    """

    rows: Rows
    starts: Index
    lengths: Index
    free: bool
    rests: bool = False

    @property
    def placed(self) -> bool:
        """Whether the places at the starts are found, and do not only shift what follows."""
        return self.free and self.rows.eccentric


class Settled(NamedTuple):
    """Free runs over pieces, their starts as the record asks for.

    Attributes
    ----------
    error : ndarray, shape (n,)
        Measured less free run; of free starts, its mean taken off in each piece.
    speeds : ndarray, shape (k,)
        At the start of each piece, units of x/s.
    slope : ndarray, shape (n,)
        Of the free run by its piece's speed, centred and of length one; 0 where it moves nothing.
    at : ndarray, shape (k,)
        Place at the start of each piece.
    shift : ndarray, shape (n,)
        What of the slope by that place is not in `slope`, of length one; 0 where a place only
        shifts all that follows.
    """

    error: Array
    speeds: Array
    slope: Array
    at: Array
    shift: Array


def cut(rows: list[Rows], length: int, free: bool) -> list[Pieces]:
    """Records in pieces of one length or nearly so.

    Parameters
    ----------
    rows : list[Rows]
        The records.
    length : int
        Samples in a piece, as near as a record allows.
    free : bool
        Whether the starts are found with the parameters.

    Returns
    -------
    list[Pieces]
        One for each record.
    """
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
    """Ways under a force, from 0 and a new speed at the start of each piece, as a kernel.

    Parameters
    ----------
    p : Axis
        Parameters of the axis.
    force : ndarray, shape (n,)
        N, held for `h` each.
    starts : ndarray, shape (k,)
        First sample of each piece.
    at : ndarray, shape (k,)
        Position there, m, or rad.
    speeds : ndarray, shape (k,)
        Speed there, m/s.
    h : float
        Sample time, s.
    out : ndarray, shape (n,)
        Ways are written here, m.
    """
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
    """Free runs of a model, each piece from a state of its own.

    Parameters
    ----------
    model : Any
        An `Axis`, or another type that registers how it moves.
    force : ndarray, shape (n,)
        Of the drive, held for `dt` each.
    starts : ndarray, shape (k,)
        First sample of each piece.
    at : ndarray, shape (k,)
        Position there.
    speeds : ndarray, shape (k,)
        Speed there.
    dt : float
        Sample time, s.

    Returns
    -------
    ndarray, shape (n,)
        Positions, up to a constant in each piece.
    """
    out = np.empty_like(force)
    plain = Axis(*(float(value) for value in model))
    pull = np.ascontiguousarray(late(force, model.lag / dt))
    compiled(restarted)(plain, pull, starts, at, speeds, float(dt), out)
    return out


def runs(cutting: Pieces, axis: Any, speeds: Array, at: Array | None = None) -> Array:
    """Free runs over the pieces, each from 0; of free starts, less its mean, or from their places.

    Parameters
    ----------
    cutting : Pieces
        The record.
    axis : Any
        Parameters: an `Axis`, or another model that `laid` knows.
    speeds : ndarray, shape (k,)
        At the start of each piece.
    at : ndarray, shape (k,), optional
        Places there; as measured by default.

    Returns
    -------
    ndarray, shape (n,)
        Positions.
    """
    r = cutting.rows
    if at is None:
        at = r.run.x[cutting.starts]
    made = laid(axis, r.force, cutting.starts, at, speeds, r.run.dt)
    if cutting.placed:
        return np.asarray(made + np.repeat(at, cutting.lengths))
    return centred(cutting, made)


def centred(cutting: Pieces, values: Array) -> Array:
    """Values less their mean in each piece; of measured starts, less their first one; of places
    that are found, as they are.

    Parameters
    ----------
    cutting : Pieces
        The record.
    values : ndarray, shape (n,)
        A value per sample.

    Returns
    -------
    ndarray, shape (n,)
        Likewise.
    """
    if cutting.placed:
        return values
    level = values[cutting.starts]
    if cutting.free:
        level = np.add.reduceat(values, cutting.starts) / cutting.lengths
    return np.asarray(values - np.repeat(level, cutting.lengths))


def settled(cutting: Pieces, axis: Any) -> Settled:
    """Free runs from measured speeds, or from those that bring each piece nearest to the record.

    Measured ones are filtered; less than 2 % of the record's greatest counts as rest. The search
    for others begins there; a step that brings a piece no nearer is not taken.

    Parameters
    ----------
    cutting : Pieces
        The record.
    axis : Any
        Parameters, as for `runs`.

    Returns
    -------
    Settled
        With errors and slopes.
    """
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
    """The sum of values in each piece."""
    return np.asarray(np.add.reduceat(values, cutting.starts))


def _unit(cutting: Pieces, values: Array) -> Array:
    """Values of length one in each piece, 0 where they are 0."""
    power = _total(cutting, values * values)
    return np.asarray(
        values / np.repeat(np.sqrt(np.where(power > 0.0, power, 1.0)), cutting.lengths)
    )


def _less(cutting: Pieces, unit: Array, values: Array) -> Array:
    """What of values lies across others of length one, in each piece."""
    share = _total(cutting, values * unit)
    return np.asarray(values - unit * np.repeat(share, cutting.lengths))


def _placed(cutting: Pieces, axis: Any, at: Array, speeds: Array, nudge: float) -> Settled:
    """`settled` in place and speed, from those measured."""
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
    """What of some values no start of a piece explains: of free ones, less mean and slope in each.

    Parameters
    ----------
    cutting : Pieces
        The record.
    at : Settled
        Its free runs.
    values : ndarray, shape (n,)
        A value per sample.

    Returns
    -------
    ndarray, shape (n,)
        Likewise.
    """
    if not cutting.free:
        return values
    even = _less(cutting, at.slope, centred(cutting, values))
    return _less(cutting, at.shift, even) if cutting.placed else even
