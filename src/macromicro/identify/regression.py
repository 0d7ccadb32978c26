"""Common parts of the linear methods, all for A(z) y = B(z) u + C(z) d, d an impulse at the first
sample.

C carries the initial state (start="free"); it is empty for a record that starts at rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.identify._spread import robust_covariance
from macromicro.identify._triangle import triangle
from macromicro.identify.linear_fit import LinearFit, percent, whiteness
from macromicro.identify.notices import ConvergenceWarning, RestWarning, UnstableWarning, notice
from macromicro.identify.records import Record, Signals, records

Start = Literal["rest", "free"]

MAX_ITERATIONS = 100
_TOLERANCE = 1e-4  # an iteration has settled when no parameter moves by this part of its error
_SPARE = 10


class Task(NamedTuple):
    """Checked records and the orders of the model."""

    data: list[Record]
    na: int  # coefficients a
    nb: int  # coefficients b
    dt: float  # sample time, s
    delay: int  # samples from u to y
    starts: int  # initial-state terms per record, 0 for records that start at rest

    @property
    def size(self) -> int:
        return self.na + self.nb

    @property
    def weights(self) -> Array:
        return np.concatenate([r.w for r in self.data])

    @property
    def roots(self) -> Array:
        return np.asarray(np.sqrt(self.weights))


class Solution(NamedTuple):
    theta: Array  # a, b, then initial states
    psi: Array  # regressors, or instruments
    residual: Array  # the method's errors


def prepared(
    u: Signals,
    y: Signals,
    orders: tuple[int, int, int],
    dt: float,
    weights: Signals | None,
    start: Start,
) -> Task:
    na, nb, delay = orders
    for name, value, least in (("na", na, 0), ("nb", nb, 1), ("delay", delay, 0)):
        if not isinstance(value, int | np.integer) or not least <= value <= 50:
            raise InputError(name, value, f"a whole number from {least} to 50")
    if not (dt > 0.0 and np.isfinite(dt)):
        raise InputError("dt", dt, "a finite number of seconds above zero")
    if start not in ("rest", "free"):
        raise InputError("start", start, '"rest" or "free"')
    data = records(u, y, weights, least=2 * (na + nb) + delay + _SPARE)
    starts = max(na, nb + delay - 1) if start == "free" else 0
    if starts and not any(np.ptp(r.u) for r in data):
        raise ProblemError(
            "u",
            "the input is constant",
            'Record one that changes, or use start="rest" for a step from rest.',
        )
    return Task(data, int(na), int(nb), float(dt), int(delay), int(starts))


def delayed(x: Array, k: int) -> Array:
    """A signal delayed by samples, zeros before it."""
    return x if k == 0 else np.concatenate([np.zeros(min(k, len(x))), x[:-k]])


def filtered(a: Array, x: Array) -> Array:
    """x / A(z) from a zero state."""
    from scipy.signal import lfilter

    return np.asarray(lfilter([1.0], np.concatenate([[1.0], a]), x))


def impulse(n: int) -> Array:
    d = np.zeros(n)
    d[0] = 1.0
    return d


def regressors(task: Task, inputs: Sequence[Array], outputs: Sequence[Array], a: Array) -> Array:
    """Matrix of -y[k-i], u[k-j] and d[k-l], all through 1/A; initial-state columns per record."""
    total = sum(len(x) for x in inputs)
    matrix = np.zeros((total, task.size + task.starts * len(inputs)))
    row = 0
    for i, (u, y) in enumerate(zip(inputs, outputs, strict=True)):
        rows = slice(row, row + len(u))
        uf, yf = filtered(a, u), filtered(a, y)
        for j in range(task.na):
            matrix[rows, j] = -delayed(yf, j + 1)
        for j in range(task.nb):
            matrix[rows, task.na + j] = delayed(uf, j + task.delay)
        if task.starts:
            df = filtered(a, impulse(len(u)))
            for j in range(task.starts):
                matrix[rows, task.size + i * task.starts + j] = delayed(df, j)
        row += len(u)
    return matrix


def solved(psi: Array, phi: Array, target: Array, roots: Array) -> Array:
    """theta of psi' W (target - phi theta) = 0, columns scaled; psi is phi for least squares."""
    scale = np.sqrt(np.einsum("ij,ij->j", phi, phi))
    if (scale == 0.0).any():
        raise ProblemError(
            "record", "a signal is zero throughout", "Record an input and an output that change."
        )
    left, right = psi / scale * roots[:, None], phi / scale * roots[:, None]
    if psi is phi:
        # The triangle of a QR decomposition holds all that the small solution needs.
        r = triangle([np.column_stack([right, target * roots])])
        n = phi.shape[1]
        theta, _, rank, _ = np.linalg.lstsq(r[:, :n], r[:, n], rcond=1e-12)
        poor = rank < n
    else:
        square, moments = left.T @ right, left.T @ (target * roots)
        poor = not np.linalg.cond(square) < 1e13
        theta = np.zeros_like(moments) if poor else np.linalg.solve(square, moments)
    if poor:
        raise ProblemError(
            "record",
            "input and output do not determine all parameters",
            "Record an input that changes more often, or choose a lower order.",
        )
    return np.asarray(theta / scale)


def plain(task: Task) -> Solution:
    phi = regressors(task, [r.u for r in task.data], [r.y for r in task.data], np.zeros(0))
    target = np.concatenate([r.y for r in task.data])
    theta = solved(phi, phi, target, task.roots)
    return Solution(theta, phi, target - phi @ theta)


def stable(a: Array) -> Array:
    """Coefficients with roots outside the unit circle reflected into it."""
    if not len(a):
        return a
    roots = np.roots(np.concatenate([[1.0], a]))
    outside = np.abs(roots) > 1.0
    if not outside.any():
        return a
    roots[outside] = 1.0 / roots[outside].conj()
    return np.asarray(np.poly(roots)[1:].real)


def free_runs(task: Task, theta: Array) -> list[Array]:
    """(B u + C d) / A of every record."""
    from scipy.signal import lfilter

    a = np.concatenate([[1.0], theta[: task.na]])
    b = np.concatenate([np.zeros(task.delay), theta[task.na : task.size]])
    runs = []
    for i, record in enumerate(task.data):
        drive = lfilter(b, [1.0], record.u)
        if task.starts:
            at = task.size + i * task.starts
            drive[: task.starts] += theta[at : at + task.starts]
        with np.errstate(over="ignore", invalid="ignore"):
            runs.append(np.asarray(lfilter([1.0], a, drive)))
    return runs


def per_record(task: Task, stacked: Array) -> tuple[Array, ...]:
    ends = np.cumsum([len(r.u) for r in task.data])[:-1]
    return tuple(np.split(stacked, ends))


def whitened(task: Task, d: Array, stacked: Array) -> Array:
    """D(z) x of every record."""
    from scipy.signal import lfilter

    top, parts = np.concatenate([[1.0], d]), []
    for record, x in zip(task.data, per_record(task, stacked), strict=True):
        part = np.asarray(lfilter(top, [1.0], x.T.copy())).T  # as rows, which is faster
        part[: len(d)] = 0.0
        if not record.w.all():
            part[np.convolve(record.w == 0.0, np.ones(len(top)))[: len(part)] > 0.5] = 0.0
        parts.append(part)
    return np.concatenate(parts)


def covariance(task: Task, solution: Solution) -> Array:
    w = task.weights
    ends = np.cumsum([len(r.u) for r in task.data])
    return robust_covariance(solution.psi, solution.residual * w, ends, w)


def settled(
    task: Task, new: Array, old: Array, solution: Solution, part: float = _TOLERANCE
) -> bool:
    """Whether the model moved by a small part of its standard errors."""
    change = np.abs(new - old)[: task.size]
    power = float(solution.residual @ solution.residual) / len(solution.residual)
    output = sum(float(r.y @ r.y) for r in task.data)
    scale = np.sqrt(np.einsum("ij,ij->j", solution.psi, solution.psi))[: task.size]
    # The error of one parameter alone, the others known, is the smaller one. Without
    # noise: no parameter may matter to the output by more than rounding.
    least = part * np.sqrt(power) + 1e-9 * np.sqrt(output)
    return bool((change * scale <= least).all())


def finished(
    method: str,
    task: Task,
    solution: Solution,
    iterations: int = 1,
    *,
    converged: bool = True,
    noise: Array | None = None,
) -> LinearFit:
    theta = solution.theta
    runs = tuple(free_runs(task, theta))
    outputs = [r.y for r in task.data]
    residuals = per_record(task, solution.residual)
    a = theta[: task.na]
    if not converged:
        notice(
            ConvergenceWarning,
            f"{method}: not settled after {iterations} iterations; the last values are returned",
        )
    if task.na and np.abs(np.roots(np.concatenate([[1.0], a]))).max() > 1.0 + 1e-9:
        notice(
            UnstableWarning, f"{method}: the model is unstable; its free run grows without bound"
        )
    if not task.starts:
        _check_rest(method, task, residuals)
    with np.errstate(over="ignore", invalid="ignore"):
        fit = percent(outputs, runs)
    spread = covariance(task, solution)
    return LinearFit(
        method,
        a,
        theta[task.na : task.size],
        task.dt,
        task.delay,
        spread[: task.size, : task.size],
        residuals,
        runs,
        fit,
        whiteness(residuals, task.size),
        iterations,
        converged,
        np.zeros(0) if noise is None else noise,
    )


def _check_rest(method: str, task: Task, residuals: tuple[Array, ...]) -> None:
    """Warn of records whose first output is far from the rest state, zero."""
    for i, (record, e) in enumerate(zip(task.data, residuals, strict=True)):
        usual = float(np.sqrt(np.mean(e[1:] ** 2)))
        most = float(np.abs(record.y).max())
        # With delay 0 the input acts on the first sample already.
        if task.delay and abs(record.y[0]) > min(6.0 * usual + 1e-9 * most, 0.5 * most):
            notice(
                RestWarning,
                f"{method}: record {i} starts at {record.y[0]:g}, not at rest; taken as at rest. "
                'Use start="free" to estimate its initial state',
            )
