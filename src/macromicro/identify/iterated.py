"""Steiglitz-McBride ("modified least squares" of Figure 4.2) and SRIV."""

from __future__ import annotations

from macromicro.identify._refined import instrumental, steiglitz_mcbride
from macromicro.identify.linear_fit import LinearFit, exact, withheld
from macromicro.identify.noise_model import compared
from macromicro.identify.records import Signals
from macromicro.identify.regression import Start, finished, prepared


def mls(
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
    """Modified least squares (Section 4.1.1, Figure 4.2), read as Steiglitz-McBride (1965).

    Least squares with input and output filtered by 1 / A until the parameters settle; the residual
    is y - (B / A) u, the output noise. The flow chart is lost; this reading fits its text ("an
    additional loop filters bias noise"). Exact for white output noise. Errors are withheld for
    coloured noise, and above order 1, where the result is not the minimum of its residuals (Stoica
    and Soderstrom, 1981).

    Parameters
    ----------
    u, y, na, nb, dt, delay, weights, start
        As for `least_squares`.

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
    >>> import numpy as np
    >>> from scipy.signal import lfilter
    >>> from macromicro.identify import mls
    >>> u, noise = np.random.default_rng(0).standard_normal((2, 2000))
    >>> y = lfilter([0.0, 0.2], [1.0, -0.9], u) + 0.1 * noise  # white noise of the sensor
    >>> fit = mls(u, y, na=1, nb=1, dt=0.01)
    >>> fit.a.round(2), fit.b.round(2)
    (array([-0.9]), array([0.2]))
    """
    task = prepared(u, y, (na, nb, delay), dt, weights, start)
    solution, count, done = steiglitz_mcbride(task)
    fit = finished("mls", task, solution, count, converged=done)
    if na > 1 and not exact(fit):
        # Stoica and Soderstrom, 1981: it is not the minimum of its residuals' sum of squares.
        return withheld(fit, "the errors of mls of an order above 1 are not known; see box_jenkins")
    return compared(task, solution, fit)


def sriv(
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
    """Simplified refined instrumental variables (Young and Jakeman, 1979), starting from `mls`.

    The instruments are the regressors of the model's noise-free output, which removes the bias
    under any noise that is independent of the input. Errors as for `output_error`.

    Parameters
    ----------
    u, y, na, nb, dt, delay, weights, start
        As for `least_squares`.

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
    >>> import numpy as np
    >>> from scipy.signal import lfilter
    >>> from macromicro.identify import sriv
    >>> u, e = np.random.default_rng(0).standard_normal((2, 2000))
    >>> y = lfilter([0.0, 0.2], [1.0, -0.9], u) + lfilter([0.1], [1.0, -0.5], e)  # coloured noise
    >>> fit = sriv(u, y, na=1, nb=1, dt=0.01)
    >>> fit.a.round(2), fit.b.round(2)
    (array([-0.9]), array([0.2]))
    """
    task = prepared(u, y, (na, nb, delay), dt, weights, start)
    solution, count, done = instrumental(task)
    fit = finished("sriv", task, solution, count, converged=done)
    return compared(task, solution, fit)
