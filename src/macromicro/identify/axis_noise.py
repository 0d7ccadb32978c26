"""What disturbs an axis: its force and noise of its position, by residuals of inverse dynamics."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.identify import slow_levels
from macromicro.identify.axis_cogging import beside, repeating
from macromicro.identify.axis_inverse import Estimate, Rows, force_residuals, regressors
from macromicro.identify.restored import restored
from macromicro.identify.ripple import Ripple
from macromicro.identify.slow_levels import Level, block_means
from macromicro.identify.spread import autoregression

_BLOCK = 0.1  # of the time constant: over which forces are averaged
_POINTS = 60  # blocks wanted


class Noise(NamedTuple):
    """What disturbs records.

    Attributes
    ----------
    block : int
        Samples over which a disturbing force is held.
    filter : ndarray, shape (order,)
        Its autoregression D(z) w = white noise, from block to block.
    power : float
        Variance of that white noise, force squared.
    sensor : float
        Standard deviation of the position's own noise, white.
    slow : Sequence[Level]
        Where the force is as slow as the record: what it may be, by samples as measured; else none.
    repeats : Ripple or None
        A force that repeats along the way, beside the noise.
    """

    block: int
    filter: Array
    power: float
    sensor: float
    slow: Sequence[Level] = ()
    repeats: Ripple | None = None


def sensed(x: Array) -> float:
    """Standard deviation of the noise of a position, by its fourth differences.

    Motion of a mass has next to none, of white noise their variance is 70 times its own.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Positions.

    Returns
    -------
    float
        Unit of x.
    """
    return float(np.sqrt(np.mean(np.diff(x, 4) ** 2) / 70.0))


def sensor(rows: Sequence[Rows]) -> float:
    """Standard deviation of the noise of all records' positions.

    Parameters
    ----------
    rows : Sequence[Rows]
        The records.

    Returns
    -------
    float
        Unit of their x.
    """
    return float(np.sqrt(np.mean([sensed(r.run.x) ** 2 for r in rows])))


def disturbance(rows: list[Rows], start: Estimate) -> Noise:
    """What the residuals of inverse dynamics with rigid friction show: noise, and cogging.

    Parameters
    ----------
    rows : list[Rows]
        The records.
    start : Estimate
        By inverse dynamics.

    Returns
    -------
    Noise
        Of all records.
    """
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
    """The noise of force and position that the residuals of inverse dynamics show.

    A free run answers to slow forces alone, so residuals are averaged over blocks. There noise of
    the position, which inverse dynamics differentiates twice, has next to no part, and its part is
    taken off. A force as slow as the record is stronger and slower than residuals show it
    (`slow_levels`).

    Parameters
    ----------
    rows : list[Rows]
        The records.
    axis : Any
        With `mass` and `viscous`.
    disturbed : list[ndarray]
        Measured less predicted force of each record, decimated, shape (m,).
    taken : list[ndarray]
        What each parameter adds to that force, shape (m, p).

    Returns
    -------
    Noise
        Of all records.
    """
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
    if not slow_levels.is_slow(sum(map(len, means)), (d, power)):
        d, power = _given_back((d, power), taken, many)
    else:
        coarse = max(total // slow_levels.BLOCKS, 1) * factor
        felt = own * _differentiated(coarse, factor) * coarse  # the position's part of the white
        slow = [
            Level(one.weight, one.time * factor, one.slow, max(one.white * factor - felt, 0.0))
            for one in slow_levels.levels(disturbed, np.concatenate(taken))
        ]
    return Noise(block, d, power * left, still, slow)


def _given_back(noise: tuple[Array, float], taken: list[Array], many: int) -> tuple[Array, float]:
    """The noise of means over blocks with what the parameters have taken of it (`restored`)."""
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
