"""Iterations of Steiglitz-McBride and of refined instruments."""

from __future__ import annotations

import numpy as np

from macromicro.identify.regression import (
    MAX_ITERATIONS,
    Solution,
    Task,
    filtered,
    free_runs,
    plain,
    regressors,
    settled,
    solved,
    stable,
)


def steiglitz_mcbride(task: Task) -> tuple[Solution, int, bool]:
    inputs, outputs = [r.u for r in task.data], [r.y for r in task.data]
    solution, roots = plain(task), task.roots
    done, count = False, 0
    # The output error y - (B / A) u is (A y - B u) / A: not linear in A, but it is once the A of
    # the division is held at its last value A', as the one-step error of the filtered signals,
    # A (y / A') - B (u / A'). Where the iteration settles A' = A, and that is the output error.
    # A root of A' outside the unit circle is reflected, or the filter would blow up.
    while not done and count < MAX_ITERATIONS:
        count += 1
        a = stable(solution.theta[: task.na])
        phi = regressors(task, inputs, outputs, a)
        target = np.concatenate([filtered(a, y) for y in outputs])
        theta = solved(phi, phi, target, roots)
        new = Solution(theta, phi, target - phi @ theta)
        done = settled(task, theta, solution.theta, new)
        solution = new
    return solution, count, done


def instrumental(task: Task) -> tuple[Solution, int, bool]:
    solution, _, _ = steiglitz_mcbride(task)
    inputs, outputs = [r.u for r in task.data], [r.y for r in task.data]
    roots = task.roots
    done, count = False, 0
    # Least squares solves phi' (target - phi theta) = 0, and is biased because phi holds the
    # measured y, whose noise is also in the residual. The instruments psi are the same regressors
    # made of the model's own output (B' / A') u: as like phi as a noise-free record can be, and
    # blind to the noise, so that psi' (target - phi theta) = 0 has the right theta on average.
    while not done and count < MAX_ITERATIONS:
        count += 1
        a = stable(solution.theta[: task.na])
        held = np.concatenate([a, solution.theta[task.na :]])
        psi = regressors(task, inputs, free_runs(task, held), a)
        phi = regressors(task, inputs, outputs, a)
        target = np.concatenate([filtered(a, y) for y in outputs])
        theta = solved(psi, phi, target, roots)
        new = Solution(theta, psi, target - phi @ theta)
        done = settled(task, theta, solution.theta, new)
        solution = new
    return solution, count, done
