"""Inverse dynamics: the drive's force as a linear function of the axis' parameters.

    F = M a + Fv v + Fc sgn v + F0 (+ Fa |v|) (+ Fs exp(-(v/vs)^2) sgn v) (+ A sin x + B cos x)

After M. Gautier and A. Janot: central differences behind a zero-phase Butterworth filter; columns
and force pass the same low-pass and are decimated. Unbiased by instruments from the free
simulation (IDIM-IV; A. Janot, P.-O. Vandanjon, M. Gautier, A generic instrumental variable approach
for industrial robot identification, IEEE Trans. Control Systems Technology 22 (2014)).
"""

# The force is held from sample to sample. The equation is therefore averaged with a triangular
# weight over the sample before and the one after: the mean acceleration is then exactly the second
# difference of the position, and the mean force that of its two held values.

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.identify import clusters
from macromicro.identify._disturbances import Ripple
from macromicro.identify.clusters import Spread
from macromicro.identify.runs import Run
from macromicro.identify.search import solve_scaled, triangle
from macromicro.models.mass import Axis, late, simulate

# Parameters of each structure, from the poorest to the richest.
STRUCTURES: dict[str, tuple[str, ...]] = {
    "viscous": ("mass", "viscous", "offset"),
    "coulomb": ("mass", "viscous", "coulomb", "offset"),
    "asymmetric": ("mass", "viscous", "coulomb", "offset", "asymmetry"),
    "stribeck": ("mass", "viscous", "coulomb", "offset", "stribeck", "stribeck_speed"),
    "full": ("mass", "viscous", "coulomb", "offset", "asymmetry", "stribeck", "stribeck_speed"),
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
BLOCKS = 8  # parts of all records that errors are judged by
_PADDED = 15  # samples by which a signal goes on for the low-pass, mirrored about its ends
HELD = 0.5  # samples by which the mean of a held force is late


@dataclass(frozen=True)
class Estimate:
    """Parameters by one method.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.identify import Axis, Estimate
    >>> axis, spread = Axis(mass=1.2, viscous=14.0), np.diag([1e-4, 0.04])
    >>> print(Estimate(axis, ("mass", "viscous"), spread, rms=0.1, percent=1.0))
    mass 1.2 +- 0.01, viscous 14 +- 0.2
    """

    axis: Axis  #: all parameters
    names: tuple[str, ...]  #: the free ones
    covariance: Array  #: covariance of these, in their order
    rms: float  #: error of the force (inverse dynamics) or of the position (output error)
    percent: float  #: the same as 100 |error| / |measured|, for positions about their mean
    #: information of each part of the records within the covariance of white noise, shape (k, p,
    #: p): its parts give Student's factors; None where errors are normal
    shares: Array | None = None
    #: A force that repeats along the way and is not in the model, where the residuals show one
    repeats: Ripple | None = None

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
        """Coverage factors of the 68 and 95 % intervals of these, shape (2, p)."""
        return self.spread.factors()

    @property
    def spread(self) -> Spread:
        """Covariance and what its factors follow from."""
        return clusters.normal_spread(self.covariance, self.shares)

    def __str__(self) -> str:
        pairs = zip(self.names, self.values, self.std, strict=True)
        return ", ".join(f"{n} {v:.5g} +- {s:.2g}" for n, v, s in pairs)


class Rows(NamedTuple):
    run: Run  # as measured
    force: Array  # gain times u, held from each sample to the next
    v: Array  # filtered speed
    a: Array  # filtered acceleration
    # where the axis stands, its speed under 1 % of the record's greatest, shape (n,)
    still: npt.NDArray[np.bool_]
    factor: int  # decimation to come
    # cut-off of the low-pass that speed and acceleration have passed, Hz; infinite for none
    corner: float = math.inf
    eccentric: bool = False  # eccentric load of a rotary axis


def parameters(rows: list[Rows], structure: str) -> tuple[str, ...]:
    named = STRUCTURES[structure] + (ECCENTRIC if any(r.eccentric for r in rows) else ())
    return (*linear(named), *(n for n in named if n == SPEED))


def linear(names: tuple[str, ...]) -> tuple[str, ...]:
    """Parameters that the force is linear in: all but Stribeck's speed."""
    return tuple(n for n in names if n != SPEED)


def differences(
    run: Run, force: Array, cutoff: float, factor: int, *, eccentric: bool = False
) -> Rows:
    """Speed and acceleration of a run: central differences behind a zero-phase low-pass."""
    smooth = low_pass(run.x, cutoff, run.dt)
    v, a = means(smooth, run.dt)
    still = np.abs(v) < _STILL * np.abs(v).max()
    return Rows(run, force, v, a, still, factor, cutoff, eccentric=eccentric)


def low_pass(signal: Array, corner: float, dt: float) -> Array:
    """A signal behind the zero-phase low-pass; unchanged for an infinite corner."""
    if math.isinf(corner):
        return signal
    from scipy.signal import sosfiltfilt

    padding = min(_PADDED, len(signal) - 1)
    return np.asarray(sosfiltfilt(_sections(2.0 * dt * corner), signal, padlen=padding))


@lru_cache(maxsize=8)
def _sections(corner: float) -> Array:
    """Low-pass of fourth order; `corner` in half the sampling rate."""
    from scipy.signal import butter

    return np.asarray(butter(4, corner, output="sos"))


def means(x: Array, dt: float) -> tuple[Array, Array]:
    """Triangular means of speed (fourth order) and acceleration (exact); plain differences at the
    ends.
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
    """The regressors with the force as the last column, filtered and decimated alike."""
    # Rows around which the axis stands for half the time or more are left out, since friction at
    # rest balances any force. A mere reversal stays in.
    asked = [n for n in names if n in TERMS]
    rough = [n not in SMOOTH for n in asked]

    def made() -> Iterator[Array]:  # one by one: records may be long
        for name in asked:
            yield TERMS[name](rows, stribeck_speed)
        if forced:
            yield late(rows.force, HELD)

    return decimate_rows(rows, made(), [*rough, True] if forced else rough)


def _fading(rows: Rows, speed: float) -> Array:
    return np.asarray(np.sign(rows.v) * np.exp(-((rows.v / speed) ** 2)))


# What a unit of each parameter adds to the force, by Stribeck's speed.
TERMS: dict[str, Callable[[Rows, float], Array]] = {
    "mass": lambda rows, _: rows.a,
    "viscous": lambda rows, _: rows.v,
    "coulomb": lambda rows, _: np.sign(rows.v),
    "offset": lambda rows, _: np.ones_like(rows.v),
    "asymmetry": lambda rows, _: np.abs(rows.v),
    "stribeck": _fading,
    SPEED: lambda rows, speed: _fading(rows, speed) * 2.0 * rows.v**2 / speed**3,
    "sine": lambda rows, _: np.sin(rows.run.x),
    "cosine": lambda rows, _: np.cos(rows.run.x),
    "spring": lambda rows, _: rows.run.x,
}


def decimate_rows(rows: Rows, signals: Iterable[Array], rough: Sequence[bool]) -> Array:
    """Columns behind the same low-pass, decimated, without rows at rest."""
    moves = ~_standing(rows.still, rows.factor)
    kept = np.empty((int(moves.sum()), len(rough)))
    for k, (signal, is_rough) in enumerate(zip(signals, rough, strict=True)):
        even = low_pass(signal, rows.corner, rows.run.dt) if is_rough else signal
        kept[:, k] = _decimate(even, rows.factor)[moves]
    return kept


def stack(rows: Sequence[Rows], made: Callable[[Rows], Array]) -> tuple[Array, list[int]]:
    """Tables of all records, each copied into place as soon as it is made to save memory."""
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
    n, factor = len(rows.v), rows.factor
    return n if factor == 1 else len(range(10 * factor, n - 10 * factor, factor))


def _decimate(column: Array, factor: int) -> Array:
    """Every `factor`-th value behind a zero-phase low-pass, without the filter's ends."""
    if factor == 1:
        return column
    from scipy.signal import upfirdn

    taps = _taps(factor)
    skipped = len(taps) // factor
    count = (len(column) - len(taps)) // factor + 1
    return np.asarray(upfirdn(taps, column, down=factor)[skipped : skipped + count])


@lru_cache(maxsize=8)
def _taps(factor: int) -> Array:
    from scipy.signal import firwin

    return np.asarray(firwin(20 * factor + 1, 0.8 / factor))


def _standing(still: npt.NDArray[np.bool_], factor: int) -> npt.NDArray[np.bool_]:
    """Decimated rows with half or more of the `factor` samples to each side at rest."""
    if factor == 1:
        return still
    half = 10 * factor
    total = np.concatenate([[0], np.cumsum(still)])
    centre = np.arange(half, len(still) - half, factor)
    return np.asarray(total[centre + factor + 1] - total[centre - factor] >= factor + 0.5)


class _Solved(NamedTuple):
    estimate: Estimate
    left: Array
    missed: Array

    def with_errors(self, rows: list[Rows]) -> Estimate:
        """The estimate with its errors, to first order including Stribeck's speed."""
        found, table = self.estimate, self.left
        if SPEED in found.names:
            table = np.c_[table, by_speed(rows, found)]
        return with_errors(found, table, self.missed)


def with_errors(found: Estimate, slopes: Array, missed: Array) -> Estimate:
    """An estimate with the errors that parts of its records leave it."""
    spread = clusters.spread(slopes, missed, clusters.blocks(len(missed), BLOCKS))
    return replace(found, covariance=spread.covariance, shares=spread.shares)


def with_lag(found: Estimate, lag: float, error: float, moved: Array) -> Estimate:
    """An estimate at a delay that has an error, by which the parameters move."""
    count = len(moved)
    slopes = np.append(moved, error)  # of all parameters by that error
    covariance = np.outer(slopes, slopes)
    covariance[:count, :count] += found.covariance
    shares = None
    if found.shares is not None:
        shares = np.zeros((len(found.shares), count + 1, count + 1))
        shares[:, :count, :count] = found.shares
    return replace(
        found,
        axis=found.axis._replace(lag=lag),
        names=(*found.names, "lag"),
        covariance=covariance,
        shares=shares,
    )


def by_speed(rows: list[Rows], estimate: Estimate) -> Array:
    p = estimate.axis
    table, _ = stack(rows, lambda r: columns(r, (SPEED,), p.stribeck_speed, forced=False))
    return np.asarray(p.stribeck * table[:, 0])


def fit_structure(rows: list[Rows], structure: str, *, errors: bool = True) -> Estimate:
    """Least squares over all records; Stribeck's speed by search, plausible results first."""
    names = parameters(rows, structure)
    top = max(float(np.abs(r.v).max()) for r in rows)
    speeds = _SPEEDS * top if SPEED in names else [top]
    most = _LARGEST * max(float(np.abs(r.force).max()) for r in rows)
    best: _Solved | None = None
    # What does not depend on Stribeck's speed is filtered once.
    fixed = tuple(n for n in linear(names) if n != "stribeck")
    steady, _ = stack(rows, lambda r: columns(r, fixed, top))
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
    return best.with_errors(rows) if errors else best.estimate


def _nearer(rows: list[Rows], steady: Array, found: _Solved) -> _Solved:
    """Stribeck's speed between the grid values, by Gauss-Newton steps."""
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


def _linear(rows: list[Rows], steady: Array, names: tuple[str, ...], speed: float) -> _Solved:
    """Least squares at a fixed Stribeck speed; `steady` holds the other columns."""
    table, each = steady, linear(names)
    if "stribeck" in names:
        added, _ = stack(rows, lambda r: columns(r, ("stribeck",), speed, forced=False))
        table = np.insert(table, each.index("stribeck"), added[:, 0], axis=1)
    left, force, p = table[:, :-1], table[:, -1], len(each)
    square = triangle([table])
    scale = np.linalg.norm(square[:, :p], axis=0)
    even = square[:, :p] / np.where(scale > 0.0, scale, 1.0)
    if (scale == 0.0).any() or len(table) < p or np.linalg.cond(even) > 1e8:
        raise ProblemError(
            "record",
            f"the motion does not determine all parameters ({_together(even, scale, each)})",
            "Record accelerated motion in both directions at several speeds, or choose a simpler "
            "structure.",
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
    return _Solved(made, left, missed)


def _together(even: Array, scale: Array, names: tuple[str, ...]) -> str:
    """Parameters that the unit regressors cannot separate, or do not show at all."""
    unseen = [n for n, s in zip(names, scale, strict=True) if s == 0.0]
    if unseen:
        return f"not seen: {', '.join(unseen)}"
    weights = np.abs(np.linalg.svd(even, full_matrices=False)[2][-1])
    mixed = [n for n, w in zip(names, weights, strict=True) if w > _MIXED * weights.max()]
    return f"cannot be separated: {', '.join(mixed)}"


def plausible(estimate: Estimate) -> bool:
    p = estimate.axis
    return p.mass > 0.0 and p.viscous >= abs(p.asymmetry) and min(p.coulomb, p.stribeck) >= 0.0


def subtract_bias(found: Estimate, own: Array) -> Estimate:
    """The estimate less its bias on a free simulation of the identified axis."""
    values = found.values - (own - found.values)
    other = replace(found, axis=found.axis._replace(**dict(zip(found.names, values, strict=True))))
    sound = plausible(other) and (SPEED not in found.names or other.axis.stribeck_speed > 0.0)
    return other if sound else found


# Disturbing forces and position noise are also in the measured acceleration, which biases least
# squares towards zero. Regressors of a simulation under the measured force are free of both.


_ROUNDS = 5
_SETTLED = 0.01  # standard errors
_POOR = 1e8
_LIKE = 0.9  # correlation of each instrument with its regressor, at least


def with_instruments(rows: list[Rows], start: Estimate) -> Estimate:
    """Inverse dynamics with instruments; the start itself if its free simulation is no guide."""
    names = linear(start.names)
    speed = start.axis.stribeck_speed
    table, _ = stack(rows, lambda r: columns(r, names, speed))
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
            # that otherwise correlates with the record: its reversals are blurred alike.
            others = near[[n != "stribeck" for n in names]]
            return _subtract_blur(rows, start, names) if others.min() >= _LIKE else start
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
    return _subtract_blur(rows, found, names)


def under(rows: list[Rows], found: Estimate, repeats: Ripple | None) -> Estimate:
    """The errors with those by a force that repeats along the way, in any phase."""
    # Its two quadratures move the parameters by a and b, a phase that may be any by (a a' + b b')/2
    if repeats is None or not plausible(found):
        return replace(found, repeats=repeats)

    def quadratures(rows: Rows) -> Array:
        turns = (repeats.at(rows.run.x, turn) for turn in (0.0, 0.5 * math.pi))
        return decimate_rows(rows, turns, [True, True])

    names = linear(found.names)
    slopes = _slopes(rows, found, _instruments(rows, found, names))
    pair, _ = stack(rows, quadratures)
    moved = solve_scaled(slopes, pair)
    covariance = np.asarray(found.covariance + 0.5 * (moved @ moved.T))
    return replace(found, covariance=covariance, repeats=repeats)


def _slopes(rows: list[Rows], found: Estimate, guides: Array) -> Array:
    """Regressors of all parameters, to first order including Stribeck's speed."""
    if SPEED not in found.names:
        return guides
    other, _ = stack(
        rows, lambda r: by_speed([_free(r, found)._replace(still=r.still)], found)[:, None]
    )
    return np.asarray(np.c_[guides, other])


def _subtract_blur(rows: list[Rows], found: Estimate, names: tuple[str, ...]) -> Estimate:
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
    own = solve_scaled(guides, force)
    held = np.zeros(len(own))
    held[len(names) :] = speed
    return subtract_bias(found, own + held)


def _instruments(rows: list[Rows], estimate: Estimate, names: tuple[str, ...]) -> Array:
    speed = estimate.axis.stribeck_speed

    def made(rows: Rows) -> Array:
        run = _free(rows, estimate)._replace(still=rows.still)
        return columns(run, names, speed, forced=False)

    return stack(rows, made)[0]


def _free(rows: Rows, estimate: Estimate) -> Rows:
    r = rows.run
    x = simulate(estimate.axis, rows.force, r.dt, float(r.x[0]), float(rows.v[0]))
    made = differences(r._replace(x=x), rows.force, rows.corner, rows.factor)
    return made._replace(eccentric=rows.eccentric)
