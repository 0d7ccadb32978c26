"""Strength and correlation time of a noise that is slow against the record.

    e = s + w,  E s(i) s(j) = S exp(-|i - j| / T),  w white, of variance W

Restricted likelihood (H. Patterson, R. Thompson, Biometrika 58, 1971, p. 545) of block means for
many T and W / S; size integrated out, flat in its logarithm (D. Harville, Biometrika 61, 1974, p.
383); prior 1 / sqrt(T) (H. Jeffreys, Proc. Royal Society A 186, 1946, p. 453).
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
    weight: float  # probability; the sum is 1
    time: float  # T, samples
    slow: float  # S
    white: float  # W


def is_slow(n: int, noise: tuple[Array, float]) -> bool:
    """Whether a noise is too slow for its residuals to show it fully."""
    response = _response(noise[0])
    seldom = int(np.argmin(response)) * n <= _TURNS * _POINTS
    return noise[1] > 0.0 and seldom and _SLOW * n < _alike(response) < np.inf


def together(noise: tuple[Array, float]) -> float:
    """Correlation length in samples: the spectrum at rest over its mean."""
    return _alike(_response(noise[0]))


def _alike(response: Array) -> float:
    """`together` by `_response`."""
    if not response.min() > 0.0:
        return float(np.inf)
    # Every frequency but rest and the highest stands for its negative, too.
    mean = (2.0 * np.sum(1.0 / response[1:-1]) + 1.0 / response[0] + 1.0 / response[-1]) / _POINTS
    return float(1.0 / (response[0] * mean))


def _response(d: Array) -> Array:
    """|D|^2 from 0 to half the sampling frequency."""
    return np.asarray(np.abs(np.fft.rfft(np.r_[1.0, d], _POINTS)) ** 2)


def block_means(rows: Array, many: int) -> Array:
    blocks = rows[: len(rows) // many * many].reshape(-1, many, *rows.shape[1:])
    return np.asarray(blocks.mean(axis=1))


def levels(residuals: Sequence[Array], taken: Array) -> list[Level]:
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
    """Covariance of linear functions of a noise, each standard error as wide as its intervals."""
    # A mean of variances would be dominated by the least likely noises; an interval that holds 68
    # or 95 % of all possible errors is narrower.
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
    """Half-widths of 68 % and (over 1.96) 95 % intervals of a normal mixture, mean, (p,)."""
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
    """Covariance under slow noise of variance 1: its first value and its later innovations."""
    from scipy.signal import lfilter

    back = lfilter([1.0], [1.0, -keep], solve[:, ::-1])[:, ::-1]
    later = back[:, 1:]
    return np.asarray(np.outer(back[:, 0], back[:, 0]) + (1.0 - keep * keep) * later @ later.T)


def _together(blocks: Sequence[int], time: float) -> Array:
    """Covariance of block means of slow noise of variance 1; time in blocks."""
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
