"""Least squares (Section 4.1.1) and generalised least squares: one-step prediction errors."""

from __future__ import annotations

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify.linear_fit import LinearFit
from macromicro.identify.noise_model import compared
from macromicro.identify.records import Signals
from macromicro.identify.regression import (
    MAX_ITERATIONS,
    Solution,
    Start,
    delayed,
    finished,
    per_record,
    plain,
    prepared,
    settled,
    solved,
    whitened,
)


def least_squares(
    u: Signals,
    y: Signals,
    na: int,
    nb: int,
    dt: float,
    delay: int = 1,
    weights: Signals | None = None,
    *,
    start: Start = "rest",
) -> LinearFit:
    """B = (U'U)^-1 U'Y (Section 4.1.1): y[k] = -a1 y[k-1] - ... + b1 u[k-delay] + ... + e[k].

    Consistent only for white e; otherwise its errors are withheld. Output noise biases it: on
    speeds from differentiated encoder counts b is several times too large (`mls` avoids this).

    Parameters
    ----------
    u, y : array_like
        Input and output, shape (n,), or lists of such arrays, one per record.
    na, nb : int
        Numbers of coefficients a and b.
    dt : float
        Sample time, s.
    delay : int, optional
        Samples from u to y.
    weights : Signals | None, optional
        As `y`: zero or more, on squared residuals; None: 1.
    start : Start, optional
        "rest" (zero before the record) or "free" (initial state estimated, per record).

    Returns
    -------
    LinearFit
        Coefficients with their covariance.

    Raises
    ------
    InputError
        An option is not accepted, or the data are unusable.

    Examples
    --------
    >>> from scipy.signal import lfilter
    >>> from macromicro.identify import least_squares
    >>> u = [1.0, -1.0, 1.0, 1.0] * 20  # V, every 10 ms
    >>> y = lfilter([0.0, 0.2], [1.0, -0.9], u)  # y[k] = 0.9 y[k-1] + 0.2 u[k-1]
    >>> fit = least_squares(u, y, na=1, nb=1, dt=0.01)
    >>> fit.a.round(6), fit.b.round(6)
    (array([-0.9]), array([0.2]))
    """
    task = prepared(u, y, (na, nb, delay), dt, weights, start)
    solution = plain(task)
    return compared(task, solution, finished("least_squares", task, solution))


def gls(
    u: Signals,
    y: Signals,
    na: int,
    nb: int,
    dt: float,
    delay: int = 1,
    weights: Signals | None = None,
    *,
    noise_order: int = 4,
    start: Start = "rest",
) -> LinearFit:
    """Generalised least squares (Clarke, 1967): A y = B u + e / D, D of order `noise_order`.

    Least squares with D as an autoregression of the residuals, by which input and output are
    filtered, until the parameters settle. Output noise is e A, not e / D: a high order approximates
    it, and `box_jenkins` treats it exactly. Samples before `noise_order` are not judged. Errors are
    withheld where e is not white.

    Parameters
    ----------
    u, y, na, nb, dt, delay, weights
        As for `least_squares`.
    noise_order : int, optional
        Order of D, 1 to 50.
    start : Start, optional
        As for `least_squares`.

    Returns
    -------
    LinearFit
        Its `noise` holds d1, d2, ... of D.

    Raises
    ------
    InputError
        An option is not accepted, or the data are unusable.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.signal import lfilter
    >>> from macromicro.identify import gls
    >>> u, e = np.sign(np.random.default_rng(0).standard_normal((2, 2000)))
    >>> y = lfilter([0.0, 0.2], [1.0, -0.9], u) + lfilter([0.01], [1.0, -1.4, 0.45], e)
    >>> fit = gls(u, y, na=1, nb=1, dt=0.01, noise_order=1)  # noise e / (A D), D = 1 - 0.5 z^-1
    >>> fit.a.round(2), fit.b.round(2), fit.noise.round(1)
    (array([-0.9]), array([0.2]), array([-0.5]))
    """
    if not isinstance(noise_order, int) or not 1 <= noise_order <= 50:
        raise InputError("noise_order", noise_order, "a whole number from 1 to 50")
    task = prepared(u, y, (na, nb, delay), dt, weights, start)
    solution = plain(task)
    phi0, target0 = solution.psi, np.concatenate([r.y for r in task.data])
    d = np.zeros(noise_order)
    done, count = False, 0
    while not done and count < MAX_ITERATIONS:
        count += 1
        raw = target0 - phi0 @ solution.theta
        d = _autoregression(per_record(task, raw), noise_order)
        phi, target = whitened(task, d, phi0), whitened(task, d, target0)
        theta = solved(phi, phi, target, task.roots)
        new = Solution(theta, phi, target - phi @ theta)
        done = settled(task, theta, solution.theta, new)
        solution = new
    # Past outputs hold past noise, so what D is off goes with what a is off: errors are those of
    # both together.
    past = [_lags(e, noise_order) for e in per_record(task, target0 - phi0 @ solution.theta)]
    joint = solution._replace(psi=np.hstack([solution.psi, np.concatenate(past)]))
    fit = finished("gls", task, joint, count, converged=done, noise=d)
    return compared(task, solution, fit)


def _autoregression(residuals: tuple[Array, ...], order: int) -> Array:
    """d1 ... of D(z) e = white, by least squares over all records."""
    left = np.concatenate([_lags(e, order)[order:] for e in residuals])
    right = np.concatenate([e[order:] for e in residuals])
    return np.asarray(np.linalg.lstsq(left, right, rcond=None)[0])


def _lags(e: Array, order: int) -> Array:
    """Residuals of 1 to `order` samples before, negative; zero where D cannot judge, (n, order)."""
    rows = np.column_stack([-delayed(e, i + 1) for i in range(order)])
    rows[:order] = 0.0
    return rows
