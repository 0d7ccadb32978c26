"""A rate-dependent loop: play operators that widen, followed by a lag.

    f = offset + sum over i of w_i y_i,   y_i a play of threshold r_i + widening |du/dt|,
    lag df'/dt + f' = f

Al Janaideh, Su and Rakheja 2009; Mayergoyz, Mathematical Models of Hysteresis, section 2.7.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.hysteresis import prandtl, prandtl_fit
from macromicro.hysteresis.prandtl_fit import PLAYS, PrandtlFit
from macromicro.kernel import compiled, kernel

_STARTS = (1e-4, 1e-3, 0.01, 0.1)  # of the largest values: the best of these begins
_ROWS = 3000  # samples by which the search is judged
_WIDEST = 0.5  # of the input's range: more than all thresholds grow by
_SMALL = 1e-3  # of a sample: no lag
_MOST = 120  # steps of a search
_BETTER = 0.02  # by this part what is held out must be predicted better


class RateFit(NamedTuple):
    fit: PrandtlFit  # the operator, with its widening, and its outputs behind the lag
    lag: float  # s
    still: PrandtlFit  # the same without rate dependence

    @property
    def better(self) -> bool:
        """Whether it predicts held-out data at least 2 % better than without."""
        return self.fit.held_rms < (1.0 - _BETTER) * self.still.held_rms


@kernel
def widened(
    u: Array, thresholds: Array, widening: float, keep: float, dt: float, out: Array
) -> None:
    """Widening plays behind the lag, along an input without past."""
    for i in range(len(thresholds)):
        y = u[0]
        late = u[0]
        for k in range(len(u)):
            wider = 0.0
            if i > 0 and k > 0:
                wider = widening * abs(u[k] - u[k - 1]) / dt
            r = thresholds[i] + wider
            y = max(u[k] - r, min(u[k] + r, y))
            late = keep * late + (1.0 - keep) * y
            out[k, i] = late


def fit(
    u: npt.ArrayLike, f: npt.ArrayLike, dt: float, plays: int = PLAYS, held_out: float = 0.3
) -> RateFit:
    """Weights, widening and lag of a recording."""
    from scipy.optimize import minimize

    if not (dt > 0.0 and math.isfinite(dt)):
        raise InputError("recording, sample time", dt, "seconds above 0")
    still = prandtl_fit.fit(u, f, plays, held_out)
    inputs = np.ascontiguousarray(u, np.float64)
    extent = float(np.ptp(inputs))
    top = float(np.abs(np.diff(inputs)).max()) / dt
    slowest = float(len(inputs)) * dt
    widest, longest = _WIDEST * extent / top, 0.05 * slowest

    thresholds = prandtl_fit.spaced(inputs, plays)
    outputs = np.ascontiguousarray(f, np.float64)
    y = np.empty((len(inputs), plays))
    thin = slice(0, still.fitted, max(still.fitted // _ROWS, 1))

    def moved(log: Array) -> tuple[float, float]:
        widening, lag = _from(log, widest, longest)
        compiled(widened)(inputs, thresholds, widening, _decay(dt, lag), dt, y)
        return widening, lag

    def missed(log: Array) -> float:
        """RMS over some of the samples, for the search."""
        moved(log)
        rows = y[thin][still.known // (thin.step or 1) + 1 :]
        left = outputs[thin][still.known // (thin.step or 1) + 1 :]
        table = np.hstack([rows, np.ones((len(rows), 1))])
        theta = np.linalg.lstsq(table, left, rcond=None)[0]
        return float(np.sqrt(np.mean((left - table @ theta) ** 2)))

    starts = [np.log([a, b]) for a in _STARTS for b in _STARTS]
    begin = min(starts, key=missed)
    options = {"maxfev": _MOST, "xatol": 1e-3, "fatol": 1e-6 * still.rms}
    end = minimize(missed, begin, method="Nelder-Mead", options=options).x
    widening, lag = moved(end)
    found = prandtl_fit.weighted(inputs, outputs, y, plays, held_out)
    best = found._replace(operator=found.operator._replace(widening=widening))
    return RateFit(best, lag, still)


def _decay(dt: float, lag: float) -> float:
    return math.exp(-dt / lag) if lag > _SMALL * dt else 0.0


def _from(log: Array, widest: float, longest: float) -> tuple[float, float]:
    """Widening and lag of a search point, none below a thousandth of its maximum."""
    found = []
    for value, most in zip(log, (widest, longest), strict=True):
        size = most * math.exp(min(float(value), 0.0))
        found.append(size if size > 1e-6 * most else 0.0)
    return found[0], found[1]


def run(p: prandtl.Prandtl, lag: float, inputs: npt.ArrayLike, dt: float) -> Array:
    """Outputs along inputs without past."""
    u = np.ascontiguousarray(inputs, np.float64)
    y = np.empty((len(u), len(p.thresholds)))
    compiled(widened)(u, p.thresholds, p.widening, _decay(dt, lag), dt, y)
    return np.asarray(p.offset + y @ p.weights)
