"""Hysteresis and creep of a piezo stage from slow swings: play operators, each with its creep.

    x = offset + sum of w_i (y_i + c sum of lags of y_i),     y_i the play of threshold r_i

Weights by non-negative least squares; creep c of log(t) type with lags a decade apart (Kuhnen and
Janocha 2002) by search. Relaxation from before a record is fitted with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.commission.stand import CommissionError, Record
from macromicro.hysteresis.prandtl_fit import moved, spaced
from macromicro.identify import clusters
from macromicro.plant import creep

PLAYS = 16
_MOST_CREEP = 0.1  # per decade
_SCALE = 1e6  # of positions: least squares with bounds have absolute tolerances
# Standard deviation of what this leaves out (thresholds between those here, other lags of the
# creep, warmth), as a part of the value, by simulation: seen on 12 random stages of
# docs/commissioning_piezo.py, checked on others there.
SIMULATED = 12  # stages by which these are known
MODEL_ERRORS = {"creep": 0.025, "stroke": 0.002, "hysteresis": 0.005}
_ROWS = 3000  # samples of a record that are compared


class Loops(NamedTuple):
    # thresholds, weights: V, and m/V at the D/A
    thresholds: tuple[float, ...]
    weights: tuple[float, ...]
    creep: float  # per decade of time, of the displacement before
    stroke: float  # of a slow cycle over the whole range, without creep, m
    width: float  # of its loop in the middle, over the stroke
    spread: tuple[float, ...]  # standard deviations of creep, stroke and width
    half: tuple[float, ...]  # halves of their 95 % intervals
    rms: float  # residual, m


class _Part(NamedTuple):
    """A record for the fit, less its offset and past."""

    plays: Array  # (n, k)
    lagged: Array  # (n, k)
    x: Array
    branch: Array


def fitted(swings: Sequence[Record], dt: float) -> Loops:
    from scipy.optimize import minimize_scalar, nnls

    every = np.concatenate([s.u for s in swings])
    span = float(np.ptp(every))
    thresholds = spaced(every, PLAYS)
    parts = [_part(s, thresholds, span, dt) for s in swings]
    plays, lagged, x, branch = (np.concatenate(c) for c in zip(*_numbered(parts), strict=True))
    # All products that any creep needs, so that a trial costs no row.
    r = np.linalg.qr(np.hstack([plays, lagged, x[:, None]]))[1]
    k = PLAYS

    def weights(c: float) -> tuple[Array, float]:
        found, rest = nnls(r[:, :k] + c * r[:, k : 2 * k], r[:, -1], maxiter=100 * k)
        return found, float(rest)

    best = minimize_scalar(
        lambda c: weights(c)[1], bounds=(0.0, _MOST_CREEP), method="bounded",
        options={"xatol": 1e-6},
    )  # fmt: skip
    c = float(best.x)
    w, _ = weights(c)
    if not w[0] > 0.0:
        raise CommissionError("the reading lags the effort throughout. Check for a sensor filter")
    error = x - (plays + c * lagged) @ w
    used = np.flatnonzero(w > 0.0)
    jacobian = np.column_stack([(plays + c * lagged)[:, used], lagged @ w])
    edges = np.searchsorted(branch, np.arange(branch[-1] + 2))
    sure = clusters.spread(jacobian, error, edges)
    left = 0.5 * span - thresholds
    to_stroke, to_width = 2.0 * left, 2.0 * np.minimum(thresholds, left)
    stroke = float(to_stroke @ w)
    width = float(to_width @ w) / stroke
    slopes = np.zeros((3, len(used) + 1))
    slopes[0, -1] = 1.0
    slopes[1, :-1] = to_stroke[used]
    slopes[2, :-1] = (to_width[used] - width * to_stroke[used]) / stroke
    hidden = np.array(list(MODEL_ERRORS.values())) * [c, stroke, width]
    spread = np.hypot(clusters.errors(sure.covariance, slopes), hidden)
    half = clusters.half_widths(sure, slopes, hidden, SIMULATED)
    metres = 1.0 / _SCALE
    units = np.array([1.0, metres, 1.0])
    return Loops(
        tuple(thresholds.tolist()), tuple((metres * w).tolist()), c, metres * stroke, width,
        tuple((units * spread).tolist()), tuple((units * half).tolist()), metres * float(np.sqrt(np.mean(error**2))),
    )  # fmt: skip


def predicted(found: Loops, swing: Record, dt: float) -> tuple[Array, Array, Array]:
    """Effort, position and prediction of a record, for a figure."""
    u, x, columns, lagged, past, known = _columns(swing, np.array(found.thresholds), dt)
    explained = (columns + found.creep * lagged) @ np.array(found.weights)
    rest = (x / _SCALE - explained)[known:]
    q = np.linalg.qr(past[known:])[0]
    return u[known:], x[known:] / _SCALE, rest - q @ (q.T @ rest)


def _columns(
    swing: Record, thresholds: Array, dt: float
) -> tuple[Array, Array, Array, Array, Array, int]:
    """Effort, position, plays, their lags, past terms, and the first valid row."""
    from scipy.signal import lfilter

    every = max(len(swing.t) // _ROWS, 1)
    n = len(swing.t) // every * every
    h = every * dt
    u, x = (c[:n].reshape(-1, every).mean(axis=1) for c in (swing.u, _SCALE * swing.x))
    t = np.arange(len(u)) * h
    plays = moved(u, thresholds)
    table = creep.prepare(creep.Creep(share=1.0))
    falls = np.exp(-h / table.times)
    from_start = plays - plays[0]
    lagged = sum(lfilter([1.0 - f], [1.0, -f], from_start, axis=0) for f in falls)
    past = np.stack([np.ones_like(t), *(np.exp(-t / own) for own in table.times[:2]), t], axis=1)
    span = float(np.ptp(u))
    near = 1e-3 * span
    known = max(int(np.argmax(u >= u.max() - near)), int(np.argmax(u <= u.min() + near)))
    return u, x, plays, np.asarray(lagged), past, known


def _part(swing: Record, thresholds: Array, span: float, dt: float) -> _Part:
    """Valid part of a record; offset and past are projected out of every column."""
    u, x, plays, lagged, past, known = _columns(swing, thresholds, dt)
    q = np.linalg.qr(past[known:])[0]

    def less(a: Array) -> Array:
        return np.asarray(a[known:] - q @ (q.T @ a[known:]))

    ways = np.sign(np.diff(u[known:], prepend=u[known]))
    for k in range(1, len(ways)):  # a rest belongs to the branch before it
        ways[k] = ways[k] or ways[k - 1]
    branch = np.cumsum(np.diff(ways, prepend=ways[0]) != 0.0)
    return _Part(less(plays), less(lagged), less(x), branch)


def _numbered(parts: Sequence[_Part]) -> list[_Part]:
    """Branches with numbers of their own."""
    done, made = 0, []
    for part in parts:
        made.append(part._replace(branch=part.branch + done))
        done += int(part.branch.max()) + 1
    return made
