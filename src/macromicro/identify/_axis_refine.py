"""Output error for an axis: the parameters whose free simulation is nearest to the record."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.identify import _axis_noise, _axis_spread
from macromicro.identify._axis_pieces import Pieces, cut, settled
from macromicro.identify._axis_slopes import slopes
from macromicro.identify._axis_spread import Spread
from macromicro.identify.axis import Axis, late, simulate
from macromicro.identify.axis_inverse import ECCENTRIC, Estimate, Rows
from macromicro.identify.notices import ConvergenceWarning, DataWarning, notice
from macromicro.identify.search import least_squares

_FORCES = ("coulomb", "offset", "stribeck", *ECCENTRIC)
_SIGNED = ("offset", "asymmetry", *ECCENTRIC)
_WHOLE, _TURNS = 60, 20  # time constants M/Fv: a record that stays whole, a piece of a longer one
_LEAST = 1000  # samples in a piece
_NOISY, _HOPELESS = 3.0, 300.0  # times the noise of the position: at the end, at the begin
_FAR = 10.0  # times its errors inverse dynamics may be off, as its bias by noise is not in them
_SURE = 3.0  # times its own errors output error may be off by chance
_SLOPE = 1e-3  # of a parameter: over which slopes are taken


def begun(rows: Rows) -> tuple[float, float]:
    v = float(rows.v[0])
    moving = abs(v) > 0.02 * float(np.abs(rows.v).max())
    return float(rows.run.x[0]), v if moving else 0.0


def free_runs(
    rows: list[Rows], axis: Axis, starts: Sequence[tuple[float, float]] = ()
) -> tuple[list[Array], list[Array]]:
    free, errors = [], []
    for k, r in enumerate(rows):
        run = simulate(axis, r.force, r.run.dt, *(starts[k] if starts else begun(r)))
        free.append(run)
        errors.append(r.run.x - run)
    return free, errors


def started(rows: list[Rows], axis: Axis) -> list[tuple[float, float]]:
    """Initial states: measured, or fitted if the error then is little more than position noise."""
    found = []
    for whole in cut(rows, max(len(r.v) for r in rows), True):
        r, at = whole.rows, settled(whole, axis)
        x, v = begun(r)
        if noisy(at.error, [r]):
            v = float(at.speeds[0])
            if whole.placed:
                x = float(at.at[0])
            else:
                x += float(np.mean(r.run.x - simulate(axis, r.force, r.run.dt, x, v)))
        found.append((x, v))
    return found


def noisy(error: Array, rows: list[Rows], most: float = _NOISY) -> bool:
    return bool(np.sqrt(np.mean(error**2)) < most * _axis_noise.sensor(rows))


def piece(rows: list[Rows], start: Estimate, free: bool) -> int:
    """Length of a piece: enough to show friction, short where disturbances accumulate."""
    p, dt = start.axis, rows[0].run.dt
    longest = max(len(r.v) for r in rows)
    if not (p.mass > 0.0 and p.viscous > 0.0):
        return longest
    turn = p.mass / p.viscous / dt
    if free or longest <= _WHOLE * turn:
        return longest
    return int(min(max(_TURNS * turn, _LEAST / rows[0].thin), longest))


def refined(
    rows: list[Rows], start: Estimate, lag: float | None = None, *, told: bool = True
) -> Estimate:
    """Output error from an estimate by inverse dynamics; mass and friction stay positive."""
    # Initial states of the pieces are fitted if the error then is mere position noise; otherwise
    # they would absorb disturbances. Gradients are differences over 0.1 % of a parameter, wide
    # enough to smooth over single samples at which the axis sticks or slides.
    names, first = start.names, start.values
    if lag is not None:
        names, first = (*names, "lag"), np.append(first, lag)
    push = max(float(np.abs(r.force).max()) for r in rows)
    scale = np.maximum(np.abs(first), 1e-2 * push * np.array([n in _FORCES for n in names]))
    if "asymmetry" in names:
        at = names.index("asymmetry")
        scale[at] = max(scale[at], 0.1 * scale[names.index("viscous")])
    if lag is not None:
        scale[-1] = rows[0].run.dt
    scale[scale == 0.0] = 1.0
    signed = np.array([n in _SIGNED for n in names])
    low = np.where(signed, -np.inf, 1e-6)
    begin = np.where(signed, first / scale, np.maximum(first / scale, 1e-2))

    def axis(values: Array) -> Axis:
        return Axis(**dict(zip(names, (values * scale).tolist(), strict=True)))

    # What is minimised is the distance of a simulation from the record, not of an equation from
    # the data: positions are taken as measured and never differentiated, so their noise does not
    # bias the result. The price is a cost with local minima, and kinks where the axis sticks; that
    # is why the search starts from inverse dynamics and is given wide differences.
    for free in (True, False):
        pieces = cut(rows, piece(rows, start, free), free)

        def missed(values: Array, pieces: list[Pieces] = pieces) -> Array:
            return np.concatenate([settled(p, axis(values)).error for p in pieces])

        def sloped(values: Array, pieces: list[Pieces] = pieces) -> Array:
            nudge = _SLOPE * np.maximum(np.abs(values), 1e-2)
            return slopes(pieces, axis, values, nudge, (low, np.full(len(low), np.inf)))

        if free and not noisy(missed(begin), rows, _HOPELESS):
            continue
        found = least_squares(
            missed, begin, sloped, bounds=(low, np.inf), xtol=1e-7, ftol=1e-9, max_nfev=100
        )
        if noisy(found.fun, rows):
            break
    if found.status == 0:
        notice(ConvergenceWarning, "output error: not settled; the last values are returned")
    final = axis(found.x)
    sure = Spread(np.full((len(names), len(names)), np.nan), False)
    if told:
        sure = _spread(rows, pieces, start, final, found, scale)
        least = ~signed & (found.x <= 2.0 * low)
        if least.any():
            ended = ", ".join(n for n, at in zip(names, least, strict=True) if at)
            notice(
                DataWarning,
                f"output error: {ended} at the lower bound, near 0; the record does not "
                "determine it, so it has no standard error",
            )
            sure.covariance[least, :] = sure.covariance[:, least] = np.nan
    error = np.concatenate(free_runs(rows, final, started(rows, final))[1])
    about = np.concatenate([r.run.x - r.run.x.mean() for r in rows])
    rms = float(np.sqrt(np.mean(error**2)))
    percent = 100.0 * rms / float(np.sqrt(np.mean(about**2)))
    return Estimate(final, names, sure.covariance, rms, percent, sure.draws, sure.sensed)


def _spread(
    rows: list[Rows], pieces: list[Pieces], start: Estimate, final: Axis, found: Any, scale: Array
) -> Spread:
    pushed = [r._replace(force=late(r.force, final.lag / r.run.dt)) for r in rows]
    noise = _axis_noise.disturbance(pushed, start)
    told = _axis_spread.covariance(pieces, final, found.jac, found.fun, noise)
    spread = told.covariance * np.outer(scale, scale)
    # Two methods that ought to agree say how far apart a wrong model can be. Where the free run is
    # explained, what is many times more than inverse dynamics' own errors, and more than those of
    # output error, counts (after Hausman, Econometrica 46, 1978), but for records that noise of the
    # position alone keeps it from.
    apart = np.array([getattr(final, n) for n in start.names]) - start.values
    own = np.sqrt(np.diag(start.covariance))
    near = np.abs(apart) <= np.maximum(_FAR * own, _SURE * np.sqrt(np.diag(spread))[: len(own)])
    apart[told.explained & (near | noisy(found.fun, rows))] = 0.0
    at = np.arange(len(apart))
    spread[at, at] += apart**2
    # What two methods are apart is neither rounding nor cogging.
    draws = None if told.draws is None or apart.any() else told.draws * scale
    return told._replace(covariance=spread, draws=draws)
