"""How strong and how slow a noise is that goes together for much of a record.

    e = s + w,  E s(i) s(j) = S exp(-|i - j| / T),  w white, of variance W

A record of a few correlation times tells little of S and T, and what was fitted has taken part of
the noise. The restricted likelihood (H. Patterson, R. Thompson, Biometrika 58, 1971, p. 545) is
that of what no value of the parameters can take. It is found on means over blocks, for many T and
W / S; the size of both is integrated over, flat in its logarithm (D. Harville, Biometrika 61, 1974,
p. 383). As n / T independent values tell the logarithm of T, it counts as 1 / sqrt(T) beforehand
(H. Jeffreys, Proc. Royal Society A 186, 1946, p. 453); that of W / S is flat. A noise that goes
together for longer than the records is a constant.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.identify.coverage import NORMAL, SHARES

BLOCKS = 120  # in all records: as finely is it told how slow a noise is
_TIMES = 16  # tried, from half a block to the longest record
_PARTS = np.r_[0.0, np.geomspace(1e-3, 1e3, 13)]  # W / S tried, of means over blocks
_LEAST = 1e-4  # of all that is likely
# Of the samples: noise whose correlation is longer is slow. Of 33 stretches that are independent
# residuals tell the strength of a noise to an eighth, 1 / sqrt(2 * 33).
_SLOW = 0.03
_TURNS = 4.0  # in all samples, at most, of noise that is slow and no swing
_POINTS = 1 << 14  # of a spectrum
_HALVED = 50


class Level(NamedTuple):
    """What a noise may be.

    Attributes
    ----------
    weight : float
        How likely; 1 in all.
    time : float
        T, samples.
    slow : float
        S.
    white : float
        W.
    """

    weight: float
    time: float
    slow: float
    white: float


def is_slow(n: int, noise: tuple[Array, float]) -> bool:
    """Whether a noise is so slow that residuals show too little of it.

    Parameters
    ----------
    n : int
        Samples in all.
    noise : tuple[ndarray, float]
        As the residuals show it: D of D(z) e = w, and the variance of w.

    Returns
    -------
    bool
        Whether more than 3 % of the samples go together, and not as a swing does: that is
        strongest where it turns more often in the samples than slow noise would.
    """
    response = _response(noise[0])
    seldom = int(np.argmin(response)) * n <= _TURNS * _POINTS
    return noise[1] > 0.0 and seldom and _SLOW * n < _alike(response) < np.inf


def together(noise: tuple[Array, float]) -> float:
    """Samples of noise that go together: its spectrum at rest over the mean of it.

    Parameters
    ----------
    noise : tuple[ndarray, float]
        D, and the variance of what drives it.

    Returns
    -------
    float
        1 of white noise.
    """
    return _alike(_response(noise[0]))


def _alike(response: Array) -> float:
    """As `together`, by `_response`."""
    if not response.min() > 0.0:
        return float(np.inf)
    # Every frequency but rest and the highest stands for its negative, too.
    mean = (2.0 * np.sum(1.0 / response[1:-1]) + 1.0 / response[0] + 1.0 / response[-1]) / _POINTS
    return float(1.0 / (response[0] * mean))


def _response(d: Array) -> Array:
    """Size squared of D, from rest to half the sampling frequency."""
    return np.asarray(np.abs(np.fft.rfft(np.r_[1.0, d], _POINTS)) ** 2)


def block_means(rows: Array, many: int) -> Array:
    """Means over blocks of so many rows.

    Parameters
    ----------
    rows : ndarray, shape (n, ...)
        Rows that follow each other.
    many : int
        In a block; what is left at the end has no part.

    Returns
    -------
    ndarray, shape (n // many, ...)
        One row per block.
    """
    blocks = rows[: len(rows) // many * many].reshape(-1, many, *rows.shape[1:])
    return np.asarray(blocks.mean(axis=1))


def levels(residuals: Sequence[Array], taken: Array) -> list[Level]:
    """What residuals leave open of a slow noise.

    Parameters
    ----------
    residuals : Sequence[ndarray]
        Evenly sampled, shape (n,) per record.
    taken : ndarray, shape (n, p)
        What each parameter takes off them, records stacked.

    Returns
    -------
    list[Level]
        One or more.
    """
    lengths = [len(e) for e in residuals]
    many = max(sum(lengths) // BLOCKS, 1)
    cuts = np.cumsum(lengths)[:-1]
    table = np.concatenate([block_means(part, many) for part in np.split(taken, cuts)])
    seen = np.concatenate([block_means(e, many) for e in residuals])
    size = np.linalg.norm(table, axis=0)
    basis, power, _ = np.linalg.svd(table[:, size > 0.0] / size[size > 0.0])
    free = basis[:, int(np.count_nonzero(power > 1e-9 * power.max(initial=0.0))) :]
    blocks = [n // many for n in lengths]
    found = []
    for time in np.geomspace(0.5, max(lengths) / many, _TIMES):
        values, turned = np.linalg.eigh(free.T @ _together(blocks, float(time)) @ free)
        prior = -0.5 * np.log(time)
        square = ((free @ turned).T @ seen) ** 2
        for part in _PARTS:
            spectrum = np.maximum(values, 0.0) + part
            if not (spectrum > 0.0).all():
                continue
            total = float(np.sum(square / spectrum))
            likely = prior - 0.5 * (np.sum(np.log(spectrum)) + len(square) * np.log(total))
            mean = total / max(len(square) - 2.0, 1.0)
            found.append((likely, time * many, mean, mean * part * many))
    every = np.array(found)
    weights = np.exp(every[:, 0] - every[:, 0].max())
    weights /= weights.sum()
    kept = weights > _LEAST
    every[:, 0] = weights / weights[kept].sum()
    return [Level(*row) for row in every[kept].tolist()]


def covariance(solve: Array, lengths: Sequence[int], may: Sequence[Level]) -> Array:
    """Covariance of what follows from a noise, each standard error as wide as its intervals.

    A mean of variances would be that of the least likely noises; an interval that holds 68 or 95 %
    of all errors that are left open is narrower.

    Parameters
    ----------
    solve : ndarray, shape (p, n)
        From noise to errors of the parameters, records stacked.
    lengths : Sequence[int]
        Samples of each record.
    may : Sequence[Level]
        What the noise may be.

    Returns
    -------
    ndarray, shape (p, p)
        With the correlations of the mean.
    """
    by: dict[float, Array] = {}
    for time in {level.time for level in may}:
        keep = float(np.exp(-1.0 / time))
        parts = np.split(solve, np.cumsum(lengths)[:-1], axis=1)
        by[time] = np.sum([_driven(part, keep) for part in parts], axis=0)
    plain = solve @ solve.T
    each = np.array([level.slow * by[level.time] + level.white * plain for level in may])
    weights = np.array([level.weight for level in may])
    found = np.einsum("k,kij->ij", weights, each)
    mean = np.sqrt(np.diag(found))
    wide = _width(weights, np.sqrt(np.einsum("kii->ki", each))) / np.where(mean > 0.0, mean, 1.0)
    return np.asarray(found * np.outer(wide, wide))


def _width(weights: Array, sizes: Array) -> Array:
    """Half the interval that holds 68 % of normal errors of several sizes, and 95 % of them, over
    1.96, in the mean; shape (p,)."""
    from scipy.special import erf

    widths = []
    for share, times in zip(SHARES, NORMAL, strict=True):
        low, high = np.zeros(sizes.shape[1]), times * sizes.max(axis=0)
        for _ in range(_HALVED):
            middle = 0.5 * (low + high)
            with np.errstate(divide="ignore", invalid="ignore"):
                inside = weights @ np.nan_to_num(erf(middle / (np.sqrt(2.0) * sizes)), nan=1.0)
            low, high = (
                np.where(inside < share, middle, low),
                np.where(inside < share, high, middle),
            )
        widths.append(high / times)
    return np.asarray(np.mean(widths, axis=0))


def _driven(solve: Array, keep: float) -> Array:
    """Covariance by slow noise of variance 1: its first value, and all that drives it later."""
    from scipy.signal import lfilter

    back = lfilter([1.0], [1.0, -keep], solve[:, ::-1])[:, ::-1]
    later = back[:, 1:]
    return np.asarray(np.outer(back[:, 0], back[:, 0]) + (1.0 - keep * keep) * later @ later.T)


def _together(blocks: Sequence[int], time: float) -> Array:
    """Covariance of means over blocks of slow noise of variance 1; time in blocks."""
    made = np.zeros((sum(blocks),) * 2)
    x, at = 1.0 / time, 0
    for n in blocks:
        apart = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
        own = np.where(
            apart > 0,
            (2.0 * np.cosh(x) - 2.0) / x**2 * np.exp(-x * apart),
            2.0 / x - 2.0 / x**2 * (1.0 - np.exp(-x)),
        )
        made[at : at + n, at : at + n] = own
        at += n
    return made
