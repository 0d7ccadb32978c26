"""Records in counts: resolution, and the effect of rounding on a fit."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.identify.coverage import Drawn

_MOST = 1e7  # counts in a record's range
_WHOLE = 0.01  # of a count: as near to a whole one every value is
_FEWEST = 3  # different values
_OWN = 1.5  # times the variance of rounding: noise that rounding explains
_ENOUGH = 20_000  # samples whose counts are compared
_BY_CHANCE, _FURTHER = 3, 1.5  # counts that differ anyway; times those that are expected to
_PLACES = (np.arange(200) + 0.5) / 200  # of counts, in counts
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


def noise(clean: Array, variance: float, step: float | None, random: np.random.Generator) -> Array:
    """Sensor noise: white, or rounding with a random zero if that is no less than the variance."""
    if step is None or variance > _OWN * step * step / 12.0:
        return np.asarray(np.sqrt(variance) * random.standard_normal(len(clean)))
    return off(clean, step, random.uniform())


def off(clean: Array, step: float, at: float) -> Array:
    """Rounding error of a curve; `at` in counts."""
    return np.asarray((np.round(clean / step + at) - at) * step - clean)


def places(records: int, draws: int) -> Array:
    """Offsets of the zeros within a count: evenly spread in each record, random together."""
    random = np.random.Generator(np.random.PCG64(0))  # the same data give the same errors
    even = (np.arange(draws) + 0.5) / draws
    return np.stack([random.permutation(even) for _ in range(records)], axis=1)


def redrawn(
    asked: Callable[[Array], Array],
    slopes: Array,
    clean: Sequence[Array],
    steps: Sequence[float],
    *,
    zeroed: bool = False,
) -> Drawn:
    """Errors of a fit due to rounding alone."""
    # Rounding of a smooth curve is correlated within a count and depends on where the curve lies,
    # and the fit has chosen the best such curve. So errors are drawn twice, the second time about
    # curves that are off by the first.
    whole, cuts = np.concatenate(clean), np.cumsum([len(x) for x in clean])[:-1]
    random = np.random.Generator(np.random.PCG64(1))
    zeros = places(len(clean), len(_PLACES))
    draws = np.zeros((len(zeros), slopes.shape[1]))
    for _ in range(_ROUNDS):
        found = []
        # An error goes with a place of the zeros that it does not stem from.
        for error, row in zip(random.permutation(draws), zeros, strict=True):
            curves = np.split(whole - slopes @ error, cuts)
            found.append(asked(np.concatenate([
                (np.floor(x / step + at) - (at - 0.5 if zeroed else 0.0)) * step - x
                for x, step, at in zip(curves, steps, row, strict=True)
            ])))  # fmt: skip
        draws = np.array(found)
    return Drawn(draws.T @ draws / len(draws), draws)


def alone(
    slopes: Array,
    spread: Array,
    outputs: Sequence[Array],
    clean: Sequence[Array],
    steps: Sequence[float],
    *,
    zeroed: bool = False,
) -> bool:
    """Whether rounding alone moved the parameters."""
    # Free simulations of the true parameters reproduce every count, those off by rounding nearly
    # every one. Many different counts show another disturbance; with an unknown zero less of it
    # shows.
    off = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", slopes, spread, slopes), 0.0))
    cuts = np.cumsum([len(x) for x in clean])[:-1]
    expected, seen = 0.0, 0
    for y, x, far, step in zip(outputs, clean, np.split(off, cuts), steps, strict=True):
        kept = np.flatnonzero(np.isfinite(y) & np.isfinite(x))
        kept = kept[:: max(len(kept) // _ENOUGH, 1)]
        whole = np.round((y[kept] - y[kept[0]]) / step)
        exact = (x[kept] - y[kept[0]]) / step
        expected += float(np.minimum(np.sqrt(2.0 / np.pi) * far[kept] / step, 1.0).sum())
        places = [0.5] if zeroed else _PLACES
        seen += min(int(np.count_nonzero(np.floor(exact + at) != whole)) for at in places)
    # A zero that is unknown is anywhere within a count, and at most twice as far off as on average.
    further = _FURTHER if zeroed else 2.0 * _FURTHER
    return bool(seen <= _BY_CHANCE + further * expected)


def explains(residual: Array, step: float) -> bool:
    spread, mean = np.nanvar(residual), abs(np.nanmean(residual))
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
