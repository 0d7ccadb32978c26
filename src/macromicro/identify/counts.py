"""Records in counts: the step of a converter, and what rounding to it does to a fit."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array

_MOST = 1e7  # counts in a record's range
_WHOLE = 0.01  # of a count: as near to a whole one every value is
_FEWEST = 3  # different values
_OWN = 1.5  # times the variance of rounding: noise that rounding explains
_PHASES = 200


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


def noise(clean: Array, variance: float, step: float | None, random: np.random.Generator) -> Array:
    """Noise of a sensor: white, or that of rounding where the variance is no more than this makes.

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
        return np.sqrt(variance) * random.standard_normal(len(clean))
    at = random.uniform()
    return np.asarray((np.round(clean / step + at) - at) * step - clean)


def covariance(slopes: Array, clean: Array, step: float) -> Array:
    """Covariance of least squares by rounding alone, its zero unknown within a count.

    Rounding of a smooth curve is no noise: it goes together for as long as the curve stays within
    a count. It is drawn for each place that the counts may have.

    Parameters
    ----------
    slopes : ndarray, shape (n, p)
        J, of the residuals by the parameters.
    clean : ndarray, shape (n,)
        The curve, in the unit of the residuals.
    step : float
        A count, likewise.

    Returns
    -------
    ndarray, shape (p, p)
        Covariance of the parameters.
    """
    back = np.linalg.pinv(slopes)
    phases = (np.arange(_PHASES) + 0.5) / _PHASES
    off = np.floor(clean / step + phases[:, None]) * step - clean
    moved = off @ back.T
    return np.asarray(moved.T @ moved / _PHASES)


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
    return bool(np.nanmean(residual**2) <= _OWN * step * step / 12.0)
