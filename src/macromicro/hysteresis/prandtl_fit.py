"""Weights of a Prandtl-Ishlinskii operator from a recording, by non-negative least squares."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.hysteresis.curves import recorded
from macromicro.hysteresis.prandtl import MOST_PLAYS, Prandtl, operator

PLAYS = 16
# The past before a recording began is forgotten once the input has been this near to both ends of
# its range, in steps of the thresholds.
_NEAR = 0.5


class PrandtlFit(NamedTuple):
    """An operator and how it fits."""

    operator: Prandtl  #: rate-independent
    outputs: Array  #: model output along the recording's input
    #: first sample that counts: before it the output depends on a past that was not recorded
    known: int
    fitted: int  #: first sample that was not fitted to
    rms: float  #: residual from `known` to `fitted`, unit of the output
    held_rms: float  #: residual from `fitted` on


def spaced(u: npt.ArrayLike, plays: int = PLAYS) -> Array:
    """Thresholds at equal steps from 0 to below half the input's range.

    A play of half the range or more never moves.

    Parameters
    ----------
    u : array_like, shape (n,)
        Input.
    plays : int, optional
        Number, including the one without a threshold.

    Returns
    -------
    ndarray, shape (plays,)
        Unit of the input.

    Examples
    --------
    >>> from macromicro.hysteresis.prandtl_fit import spaced
    >>> spaced([0.0, 100.0, 20.0], plays=5).tolist()  # V
    [0.0, 10.0, 20.0, 30.0, 40.0]
    """
    extent = float(np.ptp(np.asarray(u, dtype=np.float64)))
    return np.asarray(0.5 * extent * np.arange(plays) / plays, dtype=np.float64)


def moved(u: Array, thresholds: Array) -> Array:
    """Positions of plays along an input without past.

    Parameters
    ----------
    u, thresholds : ndarray, shapes (n,) and (k,)
        Input, and thresholds in its unit.

    Returns
    -------
    ndarray, shape (n, k)
        Unit of the input.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.hysteresis.prandtl_fit import moved
    >>> moved(np.array([0.0, 100.0, 50.0]), np.array([0.0, 10.0])).tolist()
    [[0.0, 0.0], [100.0, 90.0], [50.0, 60.0]]
    """
    low, high = u[:, None] - thresholds, u[:, None] + thresholds
    y = np.empty_like(low)
    now = np.full(thresholds.size, u[0])
    for k in range(u.size):
        now = np.maximum(low[k], np.minimum(high[k], now))
        y[k] = now
    return y


def fit(
    u: npt.ArrayLike, f: npt.ArrayLike, plays: int = PLAYS, held_out: float = 0.3
) -> PrandtlFit:
    """Weights and offset that fit a recording; none below 0, so the fit can be inverted.

    Parameters
    ----------
    u, f : array_like, shape (n,)
        Input and output over time.
    plays : int, optional
        How many, 2 to 200.
    held_out : float, optional
        Share of the recording, at its end, that is predicted and not fitted to; 0 for none.

    Returns
    -------
    PrandtlFit
        The operator and its residuals.

    Raises
    ------
    InputError
        An option outside its range, unequal lengths, NaN, a constant input, an input that never
        comes back from an end of its range, or an output that does not follow the input.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.hysteresis import prandtl, prandtl_fit
    >>> u = 50.0 - 50.0 * np.cos(np.linspace(0.0, 20.0, 401))  # V
    >>> made = prandtl.operator(thresholds=[0.0, 12.5, 25.0, 37.5], weights=[2.0, 0.5, 0.3, 0.2])
    >>> prandtl_fit.fit(u, prandtl.run(made, u), plays=4).operator.weights.round(3).tolist()
    [2.0, 0.5, 0.3, 0.2]
    """
    inputs, outputs = _check(u, f, plays, held_out)
    y = moved(inputs, spaced(inputs, plays))
    return weighted(inputs, outputs, y, plays, held_out)


def weighted(inputs: Array, outputs: Array, y: Array, plays: int, held_out: float) -> PrandtlFit:
    """Weights and offset for plays that stand where they stand.

    Parameters
    ----------
    inputs, outputs : ndarray, shape (n,)
        Input and output over time.
    y : ndarray, shape (n, plays)
        Where each play stands, unit of the input.
    plays : int
        How many.
    held_out : float
        Share of the recording, at its end, that is not fitted to.

    Returns
    -------
    PrandtlFit
        The operator, of the thresholds of `spaced`, and its residuals.

    Raises
    ------
    ProblemError
        An input that never returns from an end of its range, or an output that does not follow.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.hysteresis.prandtl_fit import moved, spaced, weighted
    >>> u = 50.0 - 50.0 * np.cos(np.linspace(0.0, 20.0, 401))
    >>> y = moved(u, spaced(u, plays=2))
    >>> found = weighted(u, y @ [2.0, 0.5] + 1.0, y, plays=2, held_out=0.3).operator
    >>> found.weights.round(6).tolist(), round(found.offset, 6)
    ([2.0, 0.5], 1.0)
    """
    from scipy.optimize import nnls

    n = inputs.size
    known = _first_known(inputs, plays)
    fitted = known + round((1.0 - held_out) * (n - known))
    if fitted - known < 2 * plays or float(np.ptp(inputs[known:fitted])) < 0.1 * np.ptp(inputs):
        problem = f"only {fitted - known} samples remain to fit after the first full stroke"
        remedy = f"Move the input to both ends of its range and back, {2 * plays} samples or more."
        raise ProblemError("recording, input", problem, remedy)
    thresholds = spaced(inputs, plays)
    # Two more columns, for an offset of either sign. The triangle of the orthogonal factors has
    # the same solution and a row a play instead of a row a sample.
    ones = np.ones((fitted - known, 1))
    scale = float(np.abs(inputs).max())
    columns = np.hstack([y[known:fitted] / scale, ones, -ones])
    q, r = np.linalg.qr(columns)
    found, _ = nnls(r, q.T @ outputs[known:fitted], maxiter=100 * columns.shape[1])
    weights, offset = found[:plays] / scale, float(found[plays] - found[plays + 1])
    if not weights[0] > 0.0:
        problem = "no part of the output follows the input at once"
        remedy = "Turn the sign of one of them, so that both rise together."
        raise ProblemError("recording, output", problem, remedy)
    found_operator = operator(thresholds, weights, offset)
    predicted = offset + y @ weights
    error = predicted - outputs
    held = float(np.sqrt(np.mean(error[fitted:] ** 2))) if fitted < n else float("nan")
    rms = float(np.sqrt(np.mean(error[known:fitted] ** 2)))
    return PrandtlFit(found_operator, predicted, known, fitted, rms, held)


def _first_known(u: Array, plays: int) -> int:
    """First sample at which the input has been to both ends of its range."""
    near = _NEAR * 0.5 * float(np.ptp(u)) / plays
    top = int(np.argmax(u >= u.max() - near))
    bottom = int(np.argmax(u <= u.min() + near))
    return max(top, bottom)


def _check(u: npt.ArrayLike, f: npt.ArrayLike, plays: int, held_out: float) -> tuple[Array, Array]:
    if not 2 <= plays <= MOST_PLAYS:
        raise InputError("Prandtl-Ishlinskii, plays", plays, f"2 to {MOST_PLAYS}")
    if not 0.0 <= held_out <= 0.9:
        raise InputError("Prandtl-Ishlinskii, held out", held_out, "a share of 0 to 0.9")
    return recorded(u, f, 4)
