"""Output error: the model whose free run is nearest to the measured output."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from macromicro.identify.descent import begins, searched
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

    Consistent under any noise that the input did not cause, and of least variance when that noise
    is white (Ljung, System Identification, chapter 7). The sum has other minima, so the search is
    made from the results of `mls`, `sriv` and `least_squares`, and from the model of first order;
    the least of their ends is taken, and `starts` tells them all. Errors under cogging and in
    counts are drawn; they are withheld where `box_jenkins` does not agree, or where they are too
    large to be told to first order.

    Parameters
    ----------
    u, y : array_like
        Input and output, as for `least_squares`.
    na, nb : int
        Numbers of coefficients a and b.
    dt : float
        Sample time, s.
    delay : int, optional
        Samples from u to y.
    weights : Signals | None, optional
        As for `least_squares`.
    start : Start, optional
        As for `least_squares`.

    Returns
    -------
    LinearFit
        Coefficients with their covariance.

    Raises
    ------
    InputError
        An option is not accepted, or the data are unusable.
    """
    task = prepared(u, y, (na, nb, delay), dt, weights, start)
    (solution, count, done), ends = searched(task, begins(task))
    fit = finished("output_error", task, solution, count, converged=done)
    outputs = [r.y for r in task.data]
    with np.errstate(over="ignore", invalid="ignore"):
        fits = {n: percent(outputs, tuple(free_runs(task, e[0].theta))) for n, e in ends.items()}
    return compared(task, solution, replace(fit, starts=fits))
