"""Output error: the model whose free simulation is nearest to the record."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from macromicro.identify._descent import begins, searched
from macromicro.identify.linear_fit import LinearFit, percent
from macromicro.identify.noise_model import compared
from macromicro.identify.records import Signals
from macromicro.identify.regression import Start, finished, free_runs, prepared


def output_error(
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
    """Minimiser of sum w (y - (B / A) u)^2, by Levenberg-Marquardt with exact gradients.

    Consistent for noise independent of the input, and of least variance if it is white (Ljung,
    System Identification, chapter 7). Searches start at the results of `mls`, `sriv`,
    `least_squares` and a first-order model; the best end is taken, and `starts` lists them all.
    Errors are drawn under cogging and in counts, and withheld where `box_jenkins` disagrees or they
    are too large for first order.

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
    >>> from macromicro.identify import output_error
    >>> u, noise = np.random.default_rng(0).standard_normal((2, 2000))
    >>> y = lfilter([0.0, 0.2], [1.0, -0.9], u) + 0.1 * noise  # white noise of the sensor
    >>> fit = output_error(u, y, na=1, nb=1, dt=0.01)
    >>> fit.a.round(2), fit.b.round(2)
    (array([-0.9]), array([0.2]))
    """
    task = prepared(u, y, (na, nb, delay), dt, weights, start)
    (solution, count, done), ends = searched(task, begins(task))
    fit = finished("output_error", task, solution, count, converged=done)
    outputs = [r.y for r in task.data]
    with np.errstate(over="ignore", invalid="ignore"):
        fits = {n: percent(outputs, tuple(free_runs(task, e[0].theta))) for n, e in ends.items()}
    return compared(task, solution, replace(fit, starts=fits))
