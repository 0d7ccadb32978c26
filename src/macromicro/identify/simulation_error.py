"""Output error: the model whose free run is nearest to the measured output."""

from __future__ import annotations

import numpy as np

from macromicro.arrays import Array
from macromicro.identify.linear_fit import LinearFit
from macromicro.identify.records import Signals
from macromicro.identify.refined import steiglitz_mcbride
from macromicro.identify.regression import (
    MAX_ITERATIONS,
    Solution,
    Start,
    Task,
    finished,
    free_runs,
    prepared,
    regressors,
    settled,
    stable,
)


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
    """Minimiser of sum w (y - (B / A) u)^2, by Levenberg-Marquardt with exact gradients from `mls`.

    Consistent under any noise that the input did not cause, and of least variance when that noise
    is white (Ljung, System Identification, chapter 7).

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
    first, _, _ = steiglitz_mcbride(task)
    theta = first.theta.copy()
    theta[: task.na] = stable(theta[: task.na])
    roots = task.roots
    best = _linearised(task, theta)
    cost = _cost(best, roots)
    damping, done, count = 1e-6, False, 0
    while not done and count < MAX_ITERATIONS:
        count += 1
        trial = best.theta + _step(best, roots, damping)
        trial[: task.na] = stable(trial[: task.na])
        new = _linearised(task, trial)
        if (now := _cost(new, roots)) <= cost:
            done = settled(task, trial, best.theta, new)
            best, cost, damping = new, now, damping * 0.1
        else:
            # A step within the tolerance that is no better: rounding; this is the minimum.
            done = settled(task, trial, best.theta, best) or damping > 1e8
            damping = max(damping * 10.0, 1e-6)
    return finished("output_error", task, best, count, converged=done)


def _linearised(task: Task, theta: Array) -> Solution:
    """Free-run errors at `theta` and the gradient of the free run."""
    # Of A x = B u: dx/da_i = -z^-i x / A and dx/db_j = z^-j u / A. That is the matrix of
    # regressors with the free run x in place of the measured y, all through 1 / A.
    runs = free_runs(task, theta)
    psi = regressors(task, [r.u for r in task.data], runs, theta[: task.na])
    return Solution(theta, psi, np.concatenate([r.y for r in task.data]) - np.concatenate(runs))


def _cost(solution: Solution, roots: Array) -> float:
    """Weighted sum of squares; infinite for a run that overflowed."""
    value = float(((solution.residual * roots) ** 2).sum())
    return value if np.isfinite(value) else float("inf")


def _step(solution: Solution, roots: Array, damping: float) -> Array:
    """The damped Gauss-Newton step, columns scaled to length one."""
    psi = solution.psi * roots[:, None]
    scale = np.sqrt(np.einsum("ij,ij->j", psi, psi))
    scale[scale == 0.0] = 1.0
    normal = (psi / scale).T @ (psi / scale)
    right = (psi / scale).T @ (solution.residual * roots)
    damped = normal + damping * np.eye(len(scale))
    return np.asarray(np.linalg.solve(damped, right) / scale)
