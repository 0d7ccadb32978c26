"""Disturbing force and position noise of an axis, from residuals of inverse dynamics."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.identify import _slow_levels
from macromicro.identify._axis_cogging import beside, repeating
from macromicro.identify._restored import restored
from macromicro.identify._ripple import Ripple
from macromicro.identify._slow_levels import Level, block_means
from macromicro.identify._spread import autoregression
from macromicro.identify.axis_inverse import Estimate, Rows, force_residuals, regressors

_BLOCK = 0.1  # of the time constant: over which forces are averaged
_POINTS = 60  # blocks wanted


class Noise(NamedTuple):
    block: int  # samples over which a disturbing force is held
    filter: Array  # autoregression D(z) w = white noise of block means
    power: float  # variance of that white noise, force squared
    sensor: float  # standard deviation of the position's own noise, white
    # where the force is as slow as the record: what it may be, by samples as measured; else none
    slow: Sequence[Level] = ()
    repeats: Ripple | None = None  # A force that repeats along the way, beside the noise


def sensed(x: Array) -> float:
    """Standard deviation of position noise, by fourth differences (variance 70 times its own)."""
    return float(np.sqrt(np.mean(np.diff(x, 4) ** 2) / 70.0))


def sensor(rows: Sequence[Rows]) -> float:
    return float(np.sqrt(np.mean([sensed(r.run.x) ** 2 for r in rows])))


def disturbance(rows: list[Rows], start: Estimate) -> Noise:
    """Noise and cogging, from residuals of inverse dynamics with rigid friction."""
    missed, taken = force_residuals(rows, start), regressors(rows, start)
    every = np.concatenate(taken), np.concatenate(missed)
    if start.searched:
        found = None if start.repeats is None else beside(rows, *every, start.repeats)
    else:
        found = repeating(rows, *every)
    if found is None:
        return noise(rows, start.axis, missed, taken)
    rest = np.split(found.rest, found.ends[:-1])
    return noise(rows, start.axis, rest, taken)._replace(repeats=found.force)


def noise(rows: list[Rows], axis: Any, disturbed: list[Array], taken: list[Array]) -> Noise:
    """Noise of force and position in the residuals of inverse dynamics."""
    # A free simulation responds to slow forces only, so residuals are averaged over blocks, in
    # which position noise has a small, known part. A force as slow as the record is stronger and
    # slower than its residuals (`slow_levels`).
    dt, factor = rows[0].run.dt, rows[0].factor
    total = sum(len(d) for d in disturbed)
    constant = axis.mass / axis.viscous if axis.mass > 0.0 and axis.viscous > 0.0 else 0.0
    many = min(round(_BLOCK * constant / (factor * dt)), total // _POINTS)
    many = max(many, 1)
    still = sensor(rows)
    means = [block_means(d, many) for d in disturbed if len(d) >= many]
    d, power = autoregression(means)
    block = many * factor
    seen = float(np.mean(np.concatenate(means) ** 2))
    own = (axis.mass * still / dt**2) ** 2
    left = max(1.0 - own * _differentiated(block, factor) / seen, 0.0) if seen > 0.0 else 0.0
    slow: list[Level] = []
    if not _slow_levels.is_slow(sum(map(len, means)), (d, power)):
        d, power = _given_back((d, power), taken, many)
    else:
        coarse = max(total // _slow_levels.BLOCKS, 1) * factor
        felt = own * _differentiated(coarse, factor) * coarse  # the position's part of the white
        slow = [
            Level(one.weight, one.time * factor, one.slow, max(one.white * factor - felt, 0.0))
            for one in _slow_levels.levels(disturbed, np.concatenate(taken))
        ]
    return Noise(block, d, power * left, still, slow)


def _given_back(noise: tuple[Array, float], taken: list[Array], many: int) -> tuple[Array, float]:
    """Noise of block means, corrected for what the parameters absorb (`restored`)."""
    kept = [t for t in taken if len(t) >= many]
    size = np.linalg.norm(np.concatenate(kept), axis=0)
    even = [t / np.where(size > 0.0, size, 1.0) for t in kept]
    inverse = np.linalg.pinv(np.sum([t.T @ t for t in even], axis=0))
    means = [block_means(t, many) for t in even]
    return restored(noise, means, [many * inverse @ mean.T for mean in means])


def _differentiated(block: int, factor: int) -> float:
    """Variance of the block mean of white noise's second difference behind the low-pass."""
    f = np.linspace(0.0, min(0.08, 0.4 / factor), 501)[1:]
    one = np.sin(np.pi * f)
    mean = np.sin(np.pi * f * block) / (block * one)
    return float(2.0 * np.sum((2.0 * one) ** 4 * mean**2) * (f[1] - f[0]))
