"""Inverse dynamics: the drive's force as a linear function of the axis' parameters.

    F = M a + Fv v + Fc sgn v + F0 (+ Fa |v|) (+ Fs exp(-(v/vs)^2) sgn v) (+ A sin x + B cos x)

After M. Gautier and A. Janot: speed and acceleration are central differences of the
position behind a zero-phase Butterworth filter; all columns and the force then pass
the same low-pass and are decimated, which keeps least squares free of bias.

The force is held from sample to sample. The equation is therefore taken in its mean over the
sample before and the one after, the earlier and the later time weighted less: there the mean of
the acceleration is the second difference of the position, whatever the force did, and the mean
of the force is that of its two held values.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify import coverage
from macromicro.identify.axis import Axis, late
from macromicro.identify.ripple import Ripple
from macromicro.identify.runs import Run
from macromicro.identify.spread import robust_covariance
from macromicro.identify.triangle import triangle

# Parameters of each structure, from the poorest to the richest.
STRUCTURES: dict[str, tuple[str, ...]] = {
    "viscous": ("mass", "viscous", "offset"),
    "coulomb": ("mass", "viscous", "coulomb", "offset"),
    "asymmetric": ("mass", "viscous", "coulomb", "offset", "asymmetry"),
    "stribeck": ("mass", "viscous", "coulomb", "offset", "stribeck", "stribeck_speed"),
    "full": (
        "mass",
        "viscous",
        "coulomb",
        "offset",
        "asymmetry",
        "stribeck",
        "stribeck_speed",
    ),
}
SPEED = "stribeck_speed"
ECCENTRIC = ("sine", "cosine")  # of any structure, where gravity pulls at an eccentric load
_SPEEDS = np.geomspace(0.005, 0.5, 25)  # Stribeck speeds tried, parts of the top speed

_STEPS, _NEAR = 8, 1e-3  # of the search between these, and its end, parts of the speed
_LARGEST = 3.0  # of the largest force: no breakaway friction is above it

_ROUNDING = 1e-9  # of the force: a parameter that takes no more is 0
_STILL = 0.01
SMOOTH = ("mass", "viscous")  # their regressors have passed the low-pass of the position
_MIXED = 0.1  # of the largest weight in what the regressors do not show
HELD = 0.5  # samples by which the mean of a held force is late


@dataclass(frozen=True)
class Estimate:
    """Parameters by one method.

    Attributes
    ----------
    axis : Axis
        All parameters.
    names : tuple[str, ...]
        The free ones.
    covariance : ndarray, shape (p, p)
        Covariance of these, in their order.
    rms : float
        Error of the force (inverse dynamics) or of the position (output error).
    percent : float
        The same as 100 |error| / |measured|, for positions about their mean.
    draws : ndarray, shape (n, p), or None
        Errors as rounding of the positions to counts makes them, or a force that repeats along the
        way; None where errors are normal.
    sensed : bool
        Whether noise of the positions, white or rounding, is all that moved the parameters.
    repeats : Ripple or None
        A force that repeats along the way and is not in the model, where the residuals show one.
    searched : bool
        Whether it was sought.
    """

    axis: Axis
    names: tuple[str, ...]
    covariance: Array
    rms: float
    percent: float
    draws: Array | None = None
    sensed: bool = False
    repeats: Ripple | None = None
    searched: bool = False

    @property
    def values(self) -> Array:
        """The free parameters, in the order of `names`."""
        return np.array([getattr(self.axis, name) for name in self.names])

    @property
    def std(self) -> Array:
        """Standard errors, in the order of `names`."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def factors(self) -> Array:
        """Coverage factors (`coverage.factors`) of these, shape (2, p)."""
        return coverage.factors(self.draws, np.eye(len(self.names)))

    def __str__(self) -> str:
        pairs = zip(self.names, self.values, self.std, strict=True)
        return ", ".join(f"{n} {v:.5g} +- {s:.2g}" for n, v, s in pairs)


class Rows(NamedTuple):
    """One record, ready for inverse dynamics.

    Attributes
    ----------
    run : Run
        As measured.
    force : ndarray, shape (n,)
        Gain times u, held from each sample to the next.
    v : ndarray, shape (n,)
        Filtered speed.
    a : ndarray, shape (n,)
        Filtered acceleration.
    still : npt.NDArray[np.bool_]
        Where the axis stands, its speed under 1 % of the record's greatest, shape (n,).
    factor : int
        Decimation to come.
    corner : float
        Cut-off of the low-pass that speed and acceleration have passed, Hz; infinite for none.
    thin : int
        Measured samples of which each is the mean (`axis_thin`).
    eccentric : bool
        Whether gravity pulls at an eccentric load, which turns.
    """

    run: Run
    force: Array
    v: Array
    a: Array
    still: npt.NDArray[np.bool_]
    factor: int
    corner: float = math.inf
    thin: int = 1
    eccentric: bool = False


def parameters(rows: list[Rows], structure: str) -> tuple[str, ...]:
    """What is free in a structure, for these records.

    Parameters
    ----------
    rows : list[Rows]
        The records.
    structure : str
        A key of `STRUCTURES`.

    Returns
    -------
    tuple[str, ...]
        Names of parameters, that which is not linear at the end.
    """
    named = STRUCTURES[structure] + (ECCENTRIC if any(r.eccentric for r in rows) else ())
    return (*linear(named), *(n for n in named if n == SPEED))


def linear(names: tuple[str, ...]) -> tuple[str, ...]:
    """Those parameters that the force is linear in: all but Stribeck's speed.

    Parameters
    ----------
    names : tuple[str, ...]
        Of parameters.

    Returns
    -------
    tuple[str, ...]
        In their order.
    """
    return tuple(n for n in names if n != SPEED)


def differences(
    run: Run, force: Array, cutoff: float, factor: int, *, eccentric: bool = False
) -> Rows:
    """Speed and acceleration of a run behind a zero-phase low-pass: central differences.

    Parameters
    ----------
    run : Run
        Evenly sampled.
    force : ndarray, shape (n,)
        Force of the drive.
    cutoff : float
        Cut-off frequency, Hz.
    factor : int
        Decimation to come.
    eccentric : bool, optional
        Whether gravity pulls at an eccentric load.

    Returns
    -------
    Rows
        With speed in units of x/s, acceleration in x/s2.
    """
    smooth = smoothed(run.x, cutoff, run.dt)
    v, a = means(smooth, run.dt)
    still = np.abs(v) < _STILL * np.abs(v).max()
    return Rows(run, force, v, a, still, factor, cutoff, eccentric=eccentric)


def smoothed(signals: Array, corner: float, dt: float) -> Array:
    """Signals, one a column, behind the zero-phase low-pass; as they are for an infinite corner.

    Parameters
    ----------
    signals : ndarray, shape (n, ...)
        Evenly sampled.
    corner : float
        Cut-off, Hz.
    dt : float
        Sample time, s.

    Returns
    -------
    ndarray
        Of the same shape.
    """
    if math.isinf(corner):
        return signals
    from scipy.signal import sosfiltfilt

    return np.asarray(sosfiltfilt(_sections(2.0 * dt * corner), signals, axis=0))


@lru_cache(maxsize=8)
def _sections(corner: float) -> Array:
    """The low-pass of fourth order; `corner` in half the samples' rate."""
    from scipy.signal import butter

    return np.asarray(butter(4, corner, output="sos"))


def means(x: Array, dt: float) -> tuple[Array, Array]:
    """Speed and acceleration in their mean over the sample before and the one after.

    Weighted by a triangle: the acceleration exactly, the speed to the fourth order of the sample
    time. The two samples at either end are plain differences.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Positions.
    dt : float
        Sample time, s.

    Returns
    -------
    v : ndarray, shape (n,)
        Units of x/s.
    a : ndarray, shape (n,)
        Units of x/s2.
    """
    v = np.gradient(x, dt)
    a = np.gradient(v, dt)
    near, far = x[3:-1] - x[1:-3], x[4:] - x[:-4]
    v[2:-2] = (14.0 * near - far) / (24.0 * dt)
    a[2:-2] = (x[3:-1] - 2.0 * x[2:-2] + x[1:-3]) / dt**2
    return v, a


def columns(
    rows: Rows, names: tuple[str, ...], stribeck_speed: float, *, forced: bool = True
) -> Array:
    """The regressors, and the mean of the held force last, filtered and decimated alike.

    Rows around which the axis stands for half the time or more are left out: friction at rest
    balances any force, which no regressor says. A mere reversal stays in.

    Parameters
    ----------
    rows : Rows
        One record.
    names : tuple[str, ...]
        Parameters; of Stribeck's speed it is what it changes of a unit of breakaway.
    stribeck_speed : float
        Units of x/s.
    forced : bool, optional
        Whether the force is asked for.

    Returns
    -------
    ndarray, shape (m, p + 1)
        One column per regressor, then the force.
    """
    asked = [n for n in names if n in _TERMS]
    rough = [n not in SMOOTH for n in asked]

    def made() -> Iterator[Array]:  # one by one: records may be long
        for name in asked:
            yield _TERMS[name](rows, stribeck_speed)
        if forced:
            yield late(rows.force, HELD)

    return evened(rows, made(), [*rough, True] if forced else rough)


def _fading(rows: Rows, speed: float) -> Array:
    """Breakaway of 1 that fades with the speed."""
    return np.asarray(_signs(rows) * np.exp(-((rows.v / speed) ** 2)))


# What a unit of each parameter adds to the force, by Stribeck's speed.
_TERMS: dict[str, Callable[[Rows, float], Array]] = {
    "mass": lambda rows, _: rows.a,
    "viscous": lambda rows, _: rows.v,
    "coulomb": lambda rows, _: _signs(rows),
    "offset": lambda rows, _: np.ones_like(rows.v),
    "asymmetry": lambda rows, _: np.abs(rows.v),
    "stribeck": _fading,
    SPEED: lambda rows, speed: _fading(rows, speed) * 2.0 * rows.v**2 / speed**3,
    "sine": lambda rows, _: np.sin(rows.run.x),
    "cosine": lambda rows, _: np.cos(rows.run.x),
}


def evened(rows: Rows, signals: Iterable[Array], rough: Sequence[bool]) -> Array:
    """A table of forces behind the same low-pass, decimated, without rows that stand.

    Parameters
    ----------
    rows : Rows
        The record that they are of.
    signals : Iterable[ndarray]
        One for each column, shape (n,).
    rough : Sequence[bool]
        Whether each has not passed the low-pass of the position.

    Returns
    -------
    ndarray, shape (m, p)
        Filtered and decimated alike.
    """
    moves = ~_standing(rows.still, rows.factor)
    kept = np.empty((int(moves.sum()), len(rough)))
    for k, (signal, is_rough) in enumerate(zip(signals, rough, strict=True)):
        even = smoothed(signal, rows.corner, rows.run.dt) if is_rough else signal
        kept[:, k] = _decimated(even, rows.factor)[moves]
    return kept


def stacked(rows: Sequence[Rows], made: Callable[[Rows], Array]) -> tuple[Array, list[int]]:
    """Tables of all records in a row.

    Each is copied into its place as soon as it is made: together they may be long.

    Parameters
    ----------
    rows : Sequence[Rows]
        The records.
    made : Callable[[Rows], ndarray]
        The table of one, shape (m, p), by `columns` or `evened`.

    Returns
    -------
    table : ndarray, shape (n, p)
        All rows.
    lengths : list[int]
        Rows of each record.
    """
    first = made(rows[0])
    lengths = [len(first)]
    if len(rows) == 1:
        return first, lengths
    table = np.empty((sum(_most(r) for r in rows), first.shape[1]))
    table[: len(first)] = first
    for record in rows[1:]:
        one, at = made(record), sum(lengths)
        table[at : at + len(one)] = one
        lengths.append(len(one))
    return table[: sum(lengths)], lengths


def _most(rows: Rows) -> int:
    """Rows of a table of a record that never stands."""
    n, factor = len(rows.v), rows.factor
    return n if factor == 1 else len(range(10 * factor, n - 10 * factor, factor))


def _signs(rows: Rows) -> Array:
    """The sign of the speed; of means, its mean where the motion turns within them."""
    if rows.thin == 1:
        return np.sign(rows.v)
    turn = np.abs(rows.a) * rows.run.dt  # the speed changes so much to either side
    part = np.clip(np.divide(rows.v, turn, out=np.sign(rows.v), where=turn > 0.0), -1.0, 1.0)
    return np.asarray(part * (2.0 - np.abs(part)))  # weighted by a triangle, as `means` does


def _decimated(column: Array, factor: int) -> Array:
    """Every `factor`-th value behind a zero-phase low-pass; the filter's ends are cut off."""
    if factor == 1:
        return column
    from scipy.signal import oaconvolve

    return np.asarray(oaconvolve(column, _taps(factor), mode="valid")[::factor])


@lru_cache(maxsize=8)
def _taps(factor: int) -> Array:
    """The low-pass of a decimation."""
    from scipy.signal import firwin

    return np.asarray(firwin(20 * factor + 1, 0.8 / factor))


def _standing(still: npt.NDArray[np.bool_], factor: int) -> npt.NDArray[np.bool_]:
    """For each decimated row, whether half or more of the `factor` samples to each side stand."""
    if factor == 1:
        return still
    half = 10 * factor
    total = np.concatenate([[0], np.cumsum(still)])
    centre = np.arange(half, len(still) - half, factor)
    return np.asarray(total[centre + factor + 1] - total[centre - factor] >= factor + 0.5)


class _Solved(NamedTuple):
    """Least squares, its regressors and what they miss, and the rows of each record."""

    estimate: Estimate
    left: Array
    missed: Array
    lengths: list[int]

    def told(self, rows: list[Rows]) -> Estimate:
        """With its covariance, to first order by Stribeck's speed, too."""
        found, table = self.estimate, self.left
        if SPEED in found.names:
            table = np.c_[table, by_speed(rows, found)]
        spread = robust_covariance(table, self.missed, np.cumsum(self.lengths))
        return replace(found, covariance=spread)


def by_speed(rows: list[Rows], estimate: Estimate) -> Array:
    """What Stribeck's speed changes of the force.

    Parameters
    ----------
    rows : list[Rows]
        The records.
    estimate : Estimate
        The axis.

    Returns
    -------
    ndarray, shape (m,)
        Decimated, all records in a row.
    """
    p = estimate.axis
    table, _ = stacked(rows, lambda r: columns(r, (SPEED,), p.stribeck_speed, forced=False))
    return np.asarray(p.stribeck * table[:, 0])


def fitted(rows: list[Rows], structure: str, *, told: bool = True) -> Estimate:
    """Least squares over all records; Stribeck's speed by search, plausible results first.

    Parameters
    ----------
    rows : list[Rows]
        The records.
    structure : str
        A key of `STRUCTURES`.
    told : bool, optional
        Whether standard errors are found, which takes longer than the rest; else they are NaN.

    Returns
    -------
    Estimate
        Its `rms` is that of the force.

    Raises
    ------
    InputError
        The motion does not determine the parameters.
    """
    names = parameters(rows, structure)
    top = max(float(np.abs(r.v).max()) for r in rows)
    speeds = _SPEEDS * top if SPEED in names else [top]
    most = _LARGEST * max(float(np.abs(r.force).max()) for r in rows)
    best: _Solved | None = None
    # What does not depend on Stribeck's speed is filtered once.
    fixed = tuple(n for n in linear(names) if n != "stribeck")
    steady = stacked(rows, lambda r: columns(r, fixed, top))
    for k, speed in enumerate(speeds):
        try:
            found = _linear(rows, steady, names, float(speed))
        except InputError:  # a breakaway that fades so soon, or so late, shows nowhere
            if best is None and k + 1 == len(speeds):
                raise
            continue
        made = found.estimate
        if abs(made.axis.stribeck) > most and k + 1 < len(speeds):
            continue
        rank = (not plausible(made), made.rms)
        if best is None or rank < (not plausible(best.estimate), best.estimate.rms):
            best = found
    assert best is not None
    if SPEED in names:
        best = _nearer(rows, steady, best)
    return best.told(rows) if told else best.estimate


def _nearer(rows: list[Rows], steady: tuple[Array, list[int]], found: _Solved) -> _Solved:
    """Stribeck's speed between those that were tried, by Gauss-Newton steps."""
    for _ in range(_STEPS):
        made = found.estimate
        speed, slope = made.axis.stribeck_speed, by_speed(rows, made)
        slope = slope - found.left @ np.linalg.lstsq(found.left, slope, rcond=None)[0]
        power = float(slope @ slope)
        if not power > 0.0:
            break
        step = float(slope @ found.missed) / power
        try:
            other = _linear(
                rows, steady, made.names, float(np.clip(speed + step, 0.5 * speed, 2.0 * speed))
            )
        except InputError:
            break
        if plausible(other.estimate) < plausible(made) or other.estimate.rms >= made.rms:
            break
        found = other
        if abs(step) <= _NEAR * speed:
            break
    return found


def _linear(
    rows: list[Rows], steady: tuple[Array, list[int]], names: tuple[str, ...], speed: float
) -> _Solved:
    """Least squares with Stribeck's speed held; `steady`: all other columns, rows per record."""
    (table, lengths), each = steady, linear(names)
    if "stribeck" in names:
        added, _ = stacked(rows, lambda r: columns(r, ("stribeck",), speed, forced=False))
        table = np.insert(table, each.index("stribeck"), added[:, 0], axis=1)
    left, force, p = table[:, :-1], table[:, -1], len(each)
    square = triangle([table])
    scale = np.linalg.norm(square[:, :p], axis=0)
    even = square[:, :p] / np.where(scale > 0.0, scale, 1.0)
    if (scale == 0.0).any() or len(table) < p or np.linalg.cond(even) > 1e8:
        raise InputError(
            "record",
            f"the motion does not determine all parameters; {_together(even, scale, each)}",
            "accelerated motion in both directions at several speeds, or a simpler structure",
        )
    parts = np.linalg.lstsq(even, square[:, p], rcond=None)[0]
    parts[np.abs(parts) <= _ROUNDING * np.linalg.norm(square[:, p])] = 0.0
    theta = parts / scale
    missed = force - left @ theta
    found = dict(zip(each, theta.tolist(), strict=True))
    axis = Axis(**found, stribeck_speed=speed)
    rms = float(np.sqrt(np.mean(missed**2)))
    percent = 100.0 * rms / float(np.sqrt(np.mean(force**2)))
    unknown = np.full((len(names), len(names)), np.nan)
    made = Estimate(axis, names, unknown, rms, percent)
    return _Solved(made, left, missed, lengths)


def _together(even: Array, scale: Array, names: tuple[str, ...]) -> str:
    """Which parameters regressors, of length 1 each, do not tell apart, or do not show at all."""
    unseen = [n for n, s in zip(names, scale, strict=True) if s == 0.0]
    if unseen:
        return f"not seen: {', '.join(unseen)}"
    weights = np.abs(np.linalg.svd(even, full_matrices=False)[2][-1])
    mixed = [n for n, w in zip(names, weights, strict=True) if w > _MIXED * weights.max()]
    return f"cannot be separated: {', '.join(mixed)}"


def plausible(estimate: Estimate) -> bool:
    """Whether no mass or friction came out negative.

    Parameters
    ----------
    estimate : Estimate
        By any method.

    Returns
    -------
    bool
        False if one did.
    """
    p = estimate.axis
    return p.mass > 0.0 and p.viscous >= abs(p.asymmetry) and min(p.coulomb, p.stribeck) >= 0.0


def corrected(found: Estimate, own: Array) -> Estimate:
    """An estimate less what its method makes of a free run of the axis that was found.

    Parameters
    ----------
    found : Estimate
        By a method.
    own : ndarray, shape (p,)
        What the same method makes of that free run, in the order of its names.

    Returns
    -------
    Estimate
        As it was where no axis has these values.
    """
    values = found.values - (own - found.values)
    other = replace(found, axis=found.axis._replace(**dict(zip(found.names, values, strict=True))))
    sound = plausible(other) and (SPEED not in found.names or other.axis.stribeck_speed > 0.0)
    return other if sound else found


def force_residuals(rows: list[Rows], estimate: Estimate) -> list[Array]:
    """Measured less predicted force, decimated.

    Parameters
    ----------
    rows : list[Rows]
        The records.
    estimate : Estimate
        Whose force is predicted.

    Returns
    -------
    list[Array]
        Arrays of shape (m,), one per record.
    """
    theta = np.array([getattr(estimate.axis, n) for n in linear(estimate.names)])
    return [table[:, -1] - table[:, :-1] @ theta for table in _tables(rows, estimate)]


def regressors(rows: list[Rows], estimate: Estimate) -> list[Array]:
    """What each parameter of an estimate adds to the force, decimated.

    Parameters
    ----------
    rows : list[Rows]
        The records.
    estimate : Estimate
        Whose parameters; Stribeck's speed has no regressor.

    Returns
    -------
    list[Array]
        Arrays of shape (m, p), one per record.
    """
    return _tables(rows, estimate, forced=False)


def _tables(rows: list[Rows], estimate: Estimate, *, forced: bool = True) -> list[Array]:
    names, speed = linear(estimate.names), estimate.axis.stribeck_speed
    return [columns(r, names, speed, forced=forced) for r in rows]
