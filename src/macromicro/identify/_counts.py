"""Records in counts: resolution, and the effect of rounding on a fit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array

_MOST = 1e7  # counts in a record's range
_WHOLE = 0.01  # of a count: as near to a whole one every value is
_FEWEST = 3  # different values
_OWN = 1.5  # times the variance of rounding: noise that rounding explains
_ENOUGH = 20_000  # samples whose counts are compared
_BY_CHANCE, _FURTHER = 3, 1.5  # counts that differ anyway; times those that are expected to
_DRAWS = 200
_ROUNDS = 2  # of draws: about what was found, then about what its errors leave open


def pitch(x: npt.ArrayLike) -> float | None:
    values = np.unique(np.asarray(x, np.float64))
    if len(values) < _FEWEST:
        return None
    extent = float(values[-1] - values[0])
    steps = np.diff(values)
    steps = steps[steps > extent / _MOST]
    least = float(steps.min())
    # The least step is known to a few digits only where values are large.
    step = extent / round(extent / least)
    at = (values - values[0]) / step
    return step if np.abs(at - np.round(at)).max() < _WHOLE else None


def felt(x: Array, variance: float) -> float | None:
    """The step of a record whose only noise is rounding."""
    step = pitch(x)
    return step if step is not None and variance <= _OWN * step * step / 12.0 else None


def places(records: int, draws: int) -> Array:
    """Offsets of the zeros within a count: evenly spread in each record, random together."""
    random = np.random.Generator(np.random.PCG64(0))  # the same data give the same errors
    even = (np.arange(draws) + 0.5) / draws
    return np.stack([random.permutation(even) for _ in range(records)], axis=1)


def covariance(slopes: Array, clean: Sequence[Array], steps: Sequence[float]) -> Array:
    """Covariance of a linear fit due to rounding alone, to counts whose zero is known."""
    # Rounding of a smooth curve is correlated within a count and depends on where the curve lies,
    # and the fit has chosen the best such curve. So errors are drawn twice, the second time about
    # curves that are off by the first.
    whole, cuts = np.concatenate(clean), np.cumsum([len(x) for x in clean])[:-1]
    random = np.random.Generator(np.random.PCG64(1))
    zeros, solve = places(len(clean), _DRAWS), np.linalg.pinv(slopes)
    draws = np.zeros((_DRAWS, slopes.shape[1]))
    for _ in range(_ROUNDS):
        found = []
        # An error correlates with a place of the zeros that it does not stem from.
        for error, row in zip(random.permutation(draws), zeros, strict=True):
            curves = np.split(whole - slopes @ error, cuts)
            found.append(solve @ np.concatenate([
                (np.floor(x / step + at) - at + 0.5) * step - x
                for x, step, at in zip(curves, steps, row, strict=True)
            ]))  # fmt: skip
        draws = np.array(found)
    return np.asarray(draws.T @ draws / len(draws))


def alone(
    slopes: Array,
    spread: Array,
    outputs: Sequence[Array],
    clean: Sequence[Array],
    steps: Sequence[float],
) -> bool:
    """Whether rounding alone moved the parameters."""
    # Free simulations of the true parameters reproduce every count, those off by rounding nearly
    # every one. Many different counts show another disturbance.
    off = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", slopes, spread, slopes), 0.0))
    cuts = np.cumsum([len(x) for x in clean])[:-1]
    expected, seen = 0.0, 0
    for y, x, far, step in zip(outputs, clean, np.split(off, cuts), steps, strict=True):
        kept = slice(None, None, max(len(y) // _ENOUGH, 1))
        whole = np.round((y[kept] - y[0]) / step)
        exact = (x[kept] - y[0]) / step
        expected += float(np.minimum(np.sqrt(2.0 / np.pi) * far[kept] / step, 1.0).sum())
        seen += int(np.count_nonzero(np.floor(exact + 0.5) != whole))
    return bool(seen <= _BY_CHANCE + _FURTHER * expected)


def explains(residual: Array, step: float) -> bool:
    spread, mean = np.var(residual), abs(np.mean(residual))
    return bool(spread <= _OWN * step * step / 12.0 and mean <= 0.5 * _OWN * step)


def steps(outputs: Sequence[Array], residuals: Sequence[Array]) -> list[float] | None:
    """Step of each record, if rounding is the residual of every one."""
    found = []
    for y, left in zip(outputs, residuals, strict=True):
        step = pitch(y)
        if step is None or not explains(left, step):
            return None
        found.append(step)
    return found
