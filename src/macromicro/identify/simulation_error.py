"""Output error: the model whose free run is nearest to the measured output."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify.equation_error import plain
from macromicro.identify.linear_fit import LinearFit, percent
from macromicro.identify.records import Signals
from macromicro.identify.refined import instrumental, steiglitz_mcbride
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
    """Minimiser of sum w (y - (B / A) u)^2, by Levenberg-Marquardt with exact gradients.

    Consistent under any noise that the input did not cause, and of least variance when that noise
    is white (Ljung, System Identification, chapter 7). The sum has other minima, so the search is
    made from the results of `mls`, `sriv` and `least_squares`, and from the model of first order;
    the least of their ends is taken, and `starts` tells them all.

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
    roots = task.roots
    ends = {name: _descended(task, theta) for name, theta in _begins(task).items()}
    costs = {name: _cost(end[0], roots) for name, end in ends.items()}
    least = min(costs, key=lambda name: costs[name])
    solution, count, done = ends[least]
    fit = finished("output_error", task, solution, count, converged=done)
    outputs = [r.y for r in task.data]
    with np.errstate(over="ignore", invalid="ignore"):
        fits = {n: percent(outputs, tuple(free_runs(task, e[0].theta))) for n, e in ends.items()}
    return replace(fit, starts=fits)


def _begins(task: Task) -> dict[str, Array]:
    """Where searches begin; a method that fails has none."""
    found: dict[str, Array] = {"mls": steiglitz_mcbride(task)[0].theta}
    with suppress(InputError):
        found["sriv"] = instrumental(task)[0].theta
    with suppress(InputError):
        found["least_squares"] = plain(task).theta
    if task.na > 1:
        with suppress(InputError):
            low = steiglitz_mcbride(task._replace(na=1, nb=1))[0].theta
            theta = np.zeros(len(found["mls"]))
            theta[[0, task.na]] = low[:2]
            found["first order"] = theta
    return {n: t for n, t in found.items() if np.isfinite(t).all()}


def _descended(task: Task, begin: Array) -> tuple[Solution, int, bool]:
    """The minimum next to a beginning, the number of steps, and whether they settled."""
    theta = begin.copy()
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
    return best, count, done


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
