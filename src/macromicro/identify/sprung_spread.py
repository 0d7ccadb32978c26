"""How sure a sprung drive's parameters are where forces disturb it.

A disturbing force moves the mass for as long as it swings, so what is left of the output is neither
white nor steady. The force that would account for it is estimated in blocks, its spectrum less what
noise of the sensor makes of it, and drawn anew: the scatter of what free runs under drawn forces
ask for is the covariance (a parametric bootstrap, B. Efron, R. Tibshirani, An Introduction to the
Bootstrap, chapter 6, with one Gauss-Newton step for each refit).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.identify.axis_spread import sensed
from macromicro.identify.runs import Run
from macromicro.identify.sprung import Sprung, simulate
from macromicro.identify.sprung_search import End

_BLOCKS = 20.0  # in a swing, or in 2 pi time constants
_LEAST = 100  # blocks in a record
_DRAWS = 80
_LAGS = 0.2  # of the shortest record: over which forces are taken to be alike
_COARSE = int(_BLOCKS) // 2  # lags of a spectrum as coarse as twice the swing's frequency
_FORCED = 0.1  # of the forces' variance that the sensor does not explain: there is a force


class Means(NamedTuple):
    """A record's residuals and slopes in blocks.

    Attributes
    ----------
    many : int
        Samples in a block.
    residual : ndarray, shape (m,)
        Means of the residual.
    slopes : ndarray, shape (m, p)
        Means of the slopes.
    """

    many: int
    residual: Array
    slopes: Array


def blocks(records: Sequence[Run], best: End, used: npt.NDArray[np.intp]) -> list[Means]:
    """Residuals and slopes as means over blocks.

    Parameters
    ----------
    records : Sequence[Run]
        The records.
    best : End
        Where the search ended.
    used : ndarray of int, shape (p,)
        Columns of its slopes.

    Returns
    -------
    list[Means]
        One per record.
    """
    p, found, at = best.axis, [], 0
    turn = 1.0 / p.frequency if p.frequency > 0.0 else np.inf
    fall = 2.0 * np.pi * p.mass / p.viscous if p.viscous > 0.0 else np.inf
    for r in records:
        n = len(r.x)
        q = int(min(max(min(turn, fall) / r.dt / _BLOCKS, 1.0), max(n // _LEAST, 1)))
        rows = slice(at, at + n // q * q)
        slopes = best.slopes[rows][:, used].reshape(-1, q, len(used)).mean(axis=1)
        found.append(Means(q, best.residual[rows].reshape(-1, q).mean(axis=1), slopes))
        at += n
    return found


def scattered(
    records: Sequence[Run],
    best: End,
    used: npt.NDArray[np.intp],
    lag: float,
    *,
    speed: bool,
) -> Array | None:
    """Covariance by drawn forces.

    Parameters
    ----------
    records : Sequence[Run]
        The records, u a force.
    best : End
        Where the search ended.
    used : ndarray of int, shape (p,)
        Columns of its slopes that move anything.
    lag : float
        Time by which the force acts late, s.
    speed : bool
        Whether the output is the speed.

    Returns
    -------
    ndarray, shape (p, p), or None
        Of these columns; None where noise of the sensor explains the residuals.
    """
    means = blocks(records, best, used)
    noise = [sensed(r.x) for r in records]
    power = _spectra(records, means, best.axis, noise, speed)
    if power is None:
        return None
    random = np.random.default_rng(0)  # the same data give the same errors
    free = [
        simulate(best.axis, r.u, r.dt, float(s[0]), float(s[1]), lag)[int(speed)]
        for r, s in zip(records, best.starts, strict=True)
    ]
    slopes = best.slopes[:, used]
    size = np.linalg.norm(slopes, axis=0)
    back = np.linalg.pinv(slopes / size)
    asked = []
    for _ in range(_DRAWS):
        errors = []
        for r, s, m, spread, y in zip(records, best.starts, means, noise, free, strict=True):
            drawn = np.repeat(_drawn(power, len(m.residual), random), m.many)
            push = r.u + np.resize(drawn, len(r.u))
            x, v = s.tolist()
            moved = simulate(best.axis, push, r.dt, x, v, lag)[int(speed)] - y
            errors.append(moved + spread * random.standard_normal(len(y)))
        asked.append((back @ np.concatenate(errors)) / size)
    scatter = np.array(asked)
    count = sum(len(m.residual) for m in means)
    return np.asarray(scatter.T @ scatter / _DRAWS * count / max(count - len(used), 1))


def _spectra(
    records: Sequence[Run], means: list[Means], p: Sprung, noise: list[float], speed: bool
) -> Array | None:
    """Autocovariances of the disturbing force from block to block, less the sensor's part; None
    where there is next to nothing beyond it."""
    last = max(int(_LAGS * min(len(m.residual) for m in means)), 3)
    total, sensor, count = np.zeros(last + 1), np.zeros(last + 1), 0
    for r, m, spread in zip(records, means, noise, strict=True):
        h, e = m.many * r.dt, m.residual
        if speed:
            taps = np.array([-0.5 * p.mass / h, p.viscous, 0.5 * p.mass / h])
            drift = p.spring * h * np.cumsum(e)[1:-1]
        else:
            bend, slope = p.mass / (h * h), 0.5 * p.viscous / h
            taps = np.array([bend - slope, p.spring - 2.0 * bend, bend + slope])
            drift = np.zeros(len(e) - 2)
        w = taps[0] * e[:-2] + taps[1] * e[1:-1] + taps[2] * e[2:] + drift
        w -= w.mean() if speed else 0.0
        total += [float(w[k:] @ w[: len(w) - k]) for k in range(last + 1)]
        own = np.correlate(taps, taps, "full")[2:] * spread**2 / m.many * len(w)
        sensor[:3] += own
        count += len(w)
    force = (total - sensor) / count
    return force if force[0] > _FORCED * total[0] / count else None


def _drawn(covariance: Array, many: int, random: np.random.Generator) -> Array:
    """Forces of these autocovariances, each for one block.

    What was fitted took up what forces did near the swing's own frequency, so there the residuals
    show too little of them. The spectrum is taken as the larger of a fine one, which shows slow
    forces, and of one so coarse that what is beside the swing stands for it.
    """
    last = len(covariance) - 1
    size = 2 * max(many, last + 1)
    power = np.zeros(size // 2 + 1)
    for lags in (last, min(_COARSE, last)):
        kept = covariance[: lags + 1] * (1.0 - np.arange(lags + 1) / (lags + 1.0))  # Bartlett
        ring = np.zeros(size)
        ring[: lags + 1] = kept
        ring[-lags:] = kept[:0:-1]
        power = np.maximum(power, np.fft.rfft(ring).real)
    draw = np.fft.rfft(random.standard_normal(size)) * np.sqrt(power)
    return np.asarray(np.fft.irfft(draw, size)[:many])
