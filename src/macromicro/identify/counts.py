"""Records in counts: the step of a converter, and what rounding to it does to a fit."""

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
    """The step of which all values of a record are multiples, apart from one offset.

    Parameters
    ----------
    x : array_like, shape (n,)
        Values, finite.

    Returns
    -------
    float or None
        Unit of x; None where values are of no step.
    """
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
    """The step of a record, where rounding to it is all of its noise.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Values, finite.
    variance : float
        Of their noise.

    Returns
    -------
    float or None
        Unit of x; None of a record of no step, and where noise is more.
    """
    step = pitch(x)
    return step if step is not None and variance <= _OWN * step * step / 12.0 else None


def noise(clean: Array, variance: float, step: float | None, random: np.random.Generator) -> Array:
    """Noise of a sensor: white, or that of rounding where that is no less than the variance.

    The zero of the counts is anywhere within one.

    Parameters
    ----------
    clean : ndarray, shape (n,)
        What is measured.
    variance : float
        Of the noise.
    step : float or None
        To which values are rounded.
    random : np.random.Generator
        Draws.

    Returns
    -------
    ndarray, shape (n,)
        Added by the sensor.
    """
    if step is None or variance > _OWN * step * step / 12.0:
        return np.asarray(np.sqrt(variance) * random.standard_normal(len(clean)))
    return off(clean, step, random.uniform())


def off(clean: Array, step: float, at: float) -> Array:
    """What rounding adds to a curve.

    Parameters
    ----------
    clean : ndarray, shape (n,)
        What is measured.
    step : float
        To which values are rounded.
    at : float
        Where the zero is, in counts.

    Returns
    -------
    ndarray, shape (n,)
        At most half a count.
    """
    return np.asarray((np.round(clean / step + at) - at) * step - clean)


def places(records: int, draws: int) -> Array:
    """Places of the zeros within a count: evenly spread in each record, and by chance together.

    Parameters
    ----------
    records, draws : int
        How many.

    Returns
    -------
    ndarray, shape (draws, records)
        In counts.
    """
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
    """Errors of a fit by rounding alone, of the curves that these errors leave open.

    Rounding of a smooth curve is no noise: it goes together for as long as the curve stays within
    a count. What it does depends on where a curve stands between two counts, and the fit has chosen
    the curve that lies best among them: about this one alone, errors come out too small. So they
    are drawn twice, the second time about curves that are off by errors of the first.

    Parameters
    ----------
    asked : Callable
        Errors of the parameters, shape (p,), by those of all records, stacked.
    slopes : ndarray, shape (n, p)
        Of the curves by the parameters, records stacked.
    clean : Sequence[ndarray]
        The curve of each record as found, n values in all.
    steps : Sequence[float]
        A count of each, in the unit of its curve.
    zeroed : bool, optional
        Whether the zero of the counts is known, as that of an encoder at its index; else it is
        unknown within a count.

    Returns
    -------
    Drawn
        Of the parameters.
    """
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
    """Whether rounding alone moved the parameters.

    Free runs of the true parameters give every count. Those that are off by what rounding does to
    parameters give a few others. Many more show that something else moved the output, though less
    than a count, and with it the parameters. Where the zero is unknown, less of it shows: errors
    by that zero are as large.

    Parameters
    ----------
    slopes : ndarray, shape (n, p)
        Of the free runs by the parameters, records stacked.
    spread : ndarray, shape (p, p)
        Covariance of the parameters by rounding alone.
    outputs, clean : Sequence[ndarray]
        Measured and by the model, n values in all; NaN where there is none.
    steps : Sequence[float]
        A count of each.
    zeroed : bool, optional
        Whether the zero of the counts is known.

    Returns
    -------
    bool
        False where more counts differ.
    """
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
    """Whether rounding, its zero unknown within a count, is all that is left of a fit.

    Parameters
    ----------
    residual : ndarray, shape (n,)
        NaN where there is none.
    step : float
        A count.

    Returns
    -------
    bool
        False where residuals are larger.
    """
    spread, mean = np.nanvar(residual), abs(np.nanmean(residual))
    return bool(spread <= _OWN * step * step / 12.0 and mean <= 0.5 * _OWN * step)


def steps(outputs: Sequence[Array], residuals: Sequence[Array]) -> list[float] | None:
    """The step of each record, where rounding is all that a fit leaves of every one.

    Parameters
    ----------
    outputs : Sequence[ndarray]
        As measured.
    residuals : Sequence[ndarray]
        What is left of each; NaN where there is none.

    Returns
    -------
    list[float] or None
        None where more is left, or a record is of no step.
    """
    found = []
    for y, left in zip(outputs, residuals, strict=True):
        step = pitch(y)
        if step is None or not explains(left, step):
            return None
        found.append(step)
    return found
