"""The search of output error: damped steps and the filter of coloured noise."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify._refined import instrumental, steiglitz_mcbride
from macromicro.identify.regression import (
    MAX_ITERATIONS,
    Solution,
    Task,
    free_runs,
    plain,
    regressors,
    settled,
    stable,
    whitened,
)

End = tuple[Solution, int, bool]  # of a search: where, its steps, whether they settled

WHITE: Array = np.zeros(0)  # D of noise that is white


def begins(task: Task) -> dict[str, Array]:
    """Starting points: results of other methods."""
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


def descended(task: Task, begin: Array, noise: Array = WHITE) -> End:
    """The minimum next to a starting point, by Levenberg-Marquardt with exact gradients."""
    theta = begin.copy()
    theta[: task.na] = stable(theta[: task.na])
    roots = task.roots
    best = linearised(task, theta, noise)
    least = cost(best, roots)
    damping, done, count = 1e-6, False, 0
    while not done and count < MAX_ITERATIONS:
        count += 1
        trial = best.theta + _step(best, roots, damping)
        trial[: task.na] = stable(trial[: task.na])
        new = linearised(task, trial, noise)
        if (now := cost(new, roots)) <= least:
            done = settled(task, trial, best.theta, new)
            best, least, damping = new, now, damping * 0.1
        else:
            # A step within the tolerance that is no better: rounding; this is the minimum.
            done = settled(task, trial, best.theta, best) or damping > 1e8
            damping = max(damping * 10.0, 1e-6)
    return best, count, done


def searched(
    task: Task, tried: Mapping[str, Array], noise: Array = WHITE
) -> tuple[End, dict[str, End]]:
    ends = {name: descended(task, theta, noise) for name, theta in tried.items()}
    roots = task.roots
    return min(ends.values(), key=lambda end: cost(end[0], roots)), ends


def linearised(task: Task, theta: Array, noise: Array = WHITE) -> Solution:
    """Errors and gradient of the free simulation, both through D."""
    # Of A x = B u: dx/da_i = -z^-i x / A and dx/db_j = z^-j u / A. That is the matrix of
    # regressors with the free run x in place of the measured y, all through 1 / A.
    runs = free_runs(task, theta)
    psi = regressors(task, [r.u for r in task.data], runs, theta[: task.na])
    missed = np.concatenate([r.y for r in task.data]) - np.concatenate(runs)
    if len(noise):
        psi, missed = whitened(task, noise, psi), whitened(task, noise, missed)
    return Solution(theta, psi, missed)


def cost(solution: Solution, roots: Array) -> float:
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
