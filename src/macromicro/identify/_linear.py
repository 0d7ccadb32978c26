"""Numerics of the linear methods: A(z) y = B(z) u + C(z) d, d an impulse at the first sample."""

# C carries the initial state (start="free"); it is empty for a record that starts at rest. Two ways
# lead to all methods: `iterated` solves a linear problem again and again, with instruments or
# without, and `searched` minimises the free-run error, through a noise filter or not.

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from types import MappingProxyType
from typing import Literal, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.identify._disturbances import autoregression
from macromicro.identify.clusters import Spread, by_scores
from macromicro.identify.records import Record, Signals, records
from macromicro.identify.search import least_squares, triangle

Start = Literal["rest", "free"]

MAX_ITERATIONS = 100
WHITE: Array = np.zeros(0)  # noise filter D of white noise
_TOLERANCE = 1e-4  # an iteration has settled when no parameter moves by this part of its error
_FINEST = 1e-12  # relative steps at which a search ends
_ROUNDS, _PART = 20, 0.01  # of Box-Jenkins; they have settled at this part of a standard error
_STRETCHES, _LENGTHS = 10, 5  # stretches that errors are judged by; samples a parameter in each
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
    def roots(self) -> Array:
        return np.asarray(np.sqrt(np.concatenate([r.w for r in self.data])))

    @property
    def inputs(self) -> list[Array]:
        return [r.u for r in self.data]

    @property
    def outputs(self) -> list[Array]:
        return [r.y for r in self.data]


class Solution(NamedTuple):
    theta: Array  # a, b, then initial states
    psi: Array  # regressors, instruments or slopes of the free run
    residual: Array  # errors of the method, records in a row
    iterations: int = 1
    converged: bool = True
    noise: Array = WHITE  # d1, d2, ... of the noise filter
    # fit of the free run from each start of a search, percent
    starts: Mapping[str, float] = MappingProxyType({})


def prepare_task(
    u: Signals,
    y: Signals,
    na: int,
    nb: int,
    dt: float,
    delay: int = 1,
    weights: Signals | None = None,
    *,
    start: Start = "rest",
) -> Task:
    """What a method fits to; its parameters are those of every method.

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
    """
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
        remedy = 'Record one that changes, or use start="rest" for a step from rest.'
        raise ProblemError("u", "the input is constant", remedy)
    return Task(data, int(na), int(nb), float(dt), int(delay), int(starts))


def delay(x: Array, k: int) -> Array:
    """A signal delayed by samples, zeros before it."""
    return x if k == 0 else np.concatenate([np.zeros(min(k, len(x))), x[:-k]])


def filter_by(a: Array, x: Array) -> Array:
    """x / A(z) from a zero state."""
    from scipy.signal import lfilter

    return np.asarray(lfilter([1.0], np.r_[1.0, a], x))


def regressors(task: Task, outputs: Sequence[Array], a: Array) -> Array:
    """Matrix of -y[k-i], u[k-j] and d[k-l], all through 1/A; initial-state columns per record."""
    matrix = np.zeros((sum(map(len, outputs)), task.size + task.starts * len(task.data)))
    row = 0
    for i, (u, y) in enumerate(zip(task.inputs, outputs, strict=True)):
        rows = slice(row, row + len(u))
        row += len(u)
        past, drive = filter_by(a, y), filter_by(a, u)
        for j in range(task.na):
            matrix[rows, j] = -delay(past, j + 1)
        for j in range(task.nb):
            matrix[rows, task.na + j] = delay(drive, j + task.delay)
        if task.starts:
            impulse = filter_by(a, np.eye(1, len(u))[0])
            for j in range(task.starts):
                matrix[rows, task.size + i * task.starts + j] = delay(impulse, j)
    return matrix


def solve(psi: Array, phi: Array, target: Array, roots: Array) -> Array:
    """theta of psi' W (target - phi theta) = 0, columns scaled; psi is phi for least squares."""
    scale = np.sqrt(np.einsum("ij,ij->j", phi, phi))
    if (scale == 0.0).any():
        remedy = "Record an input and an output that change."
        raise ProblemError("record", "a signal is zero throughout", remedy)
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
        remedy = "Record an input that changes more often, or choose a lower order."
        raise ProblemError("record", "input and output do not determine all parameters", remedy)
    return np.asarray(theta / scale)


def stable(a: Array) -> Array:
    """Coefficients with roots outside the unit circle reflected into it."""
    if not len(a):
        return a
    roots = np.roots(np.r_[1.0, a])
    outside = np.abs(roots) > 1.0
    if not outside.any():
        return a
    roots[outside] = 1.0 / roots[outside].conj()
    return np.asarray(np.poly(roots)[1:].real)


def free_runs(task: Task, theta: Array) -> list[Array]:
    """(B u + C d) / A of every record."""
    from scipy.signal import lfilter

    a = np.r_[1.0, theta[: task.na]]
    b = np.r_[np.zeros(task.delay), theta[task.na : task.size]]
    runs = []
    for i, u in enumerate(task.inputs):
        drive = lfilter(b, [1.0], u)
        at = task.size + i * task.starts
        drive[: task.starts] += theta[at : at + task.starts]
        with np.errstate(over="ignore", invalid="ignore"):
            runs.append(np.asarray(lfilter([1.0], a, drive)))
    return runs


def per_record(task: Task, stacked: Array) -> tuple[Array, ...]:
    return tuple(np.split(stacked, np.cumsum([len(u) for u in task.inputs])[:-1]))


def whiten(task: Task, d: Array, stacked: Array) -> Array:
    """D(z) x of every record; 0 where D reaches samples before a record or without weight."""
    from scipy.signal import lfilter

    if not len(d):
        return stacked
    top, parts = np.r_[1.0, d], []
    for record, x in zip(task.data, per_record(task, stacked), strict=True):
        part = np.asarray(lfilter(top, [1.0], x.T.copy())).T  # as rows, which is faster
        part[: len(d)] = 0.0
        if not record.w.all():
            part[np.convolve(record.w == 0.0, np.ones(len(top)))[: len(part)] > 0.5] = 0.0
        parts.append(part)
    return np.concatenate(parts)


def is_settled(
    task: Task, new: Array, old: Array, solution: Solution, part: float = _TOLERANCE
) -> bool:
    """Whether the model moved by a small part of its standard errors."""
    change = np.abs(new - old)[: task.size]
    power = float(solution.residual @ solution.residual) / len(solution.residual)
    output = sum(float(y @ y) for y in task.outputs)
    scale = np.sqrt(np.einsum("ij,ij->j", solution.psi, solution.psi))[: task.size]
    # The error of one parameter alone, the others known, is the smaller one. Without
    # noise: no parameter may matter to the output by more than rounding.
    least = part * np.sqrt(power) + 1e-9 * np.sqrt(output)
    return bool((change * scale <= least).all())


def equation_error(task: Task) -> Solution:
    """Least squares of the one-step errors."""
    phi = regressors(task, task.outputs, WHITE)
    target = np.concatenate(task.outputs)
    theta = solve(phi, phi, target, task.roots)
    return Solution(theta, phi, target - phi @ theta)


def iterate(task: Task, *, instruments: bool) -> Solution:
    """Steiglitz-McBride; with instruments the simplified refined method, which starts there."""
    # The output error y - (B / A) u is (A y - B u) / A: not linear in A, but it is once the A of
    # the division is held at its last value A', as the one-step error of the filtered signals,
    # A (y / A') - B (u / A'). Where the iteration settles A' = A, and that is the output error.
    # A root of A' outside the unit circle is reflected, or the filter would blow up.
    # Least squares solves phi' (target - phi theta) = 0, and is biased because phi holds the
    # measured y, whose noise is also in the residual. The instruments psi are the same regressors
    # made of the model's own output (B' / A') u, which is free of noise.
    solution = iterate(task, instruments=False) if instruments else equation_error(task)
    done, count = False, 0
    while not done and count < MAX_ITERATIONS:
        count += 1
        a = stable(solution.theta[: task.na])
        phi = regressors(task, task.outputs, a)
        target = np.concatenate([filter_by(a, y) for y in task.outputs])
        psi = phi
        if instruments:
            psi = regressors(task, free_runs(task, np.r_[a, solution.theta[task.na :]]), a)
        theta = solve(psi, phi, target, task.roots)
        new = Solution(theta, psi, target - phi @ theta)
        done = is_settled(task, theta, solution.theta, new)
        solution = new
    return solution._replace(iterations=count, converged=done)


def generalise(task: Task, order: int) -> Solution:
    """Least squares through D, an autoregression of the one-step errors, until both settle."""
    first = solution = equation_error(task)
    target, d = np.concatenate(task.outputs), np.zeros(order)
    errors = per_record(task, solution.residual)
    done, count = False, 0
    while not done and count < MAX_ITERATIONS:
        count += 1
        past = np.concatenate([_lags(e, order)[order:] for e in errors])
        d = np.linalg.lstsq(past, np.concatenate([e[order:] for e in errors]), rcond=None)[0]
        phi, through = whiten(task, d, first.psi), whiten(task, d, target)
        theta = solve(phi, phi, through, task.roots)
        new = Solution(theta, phi, through - phi @ theta)
        done = is_settled(task, theta, solution.theta, new)
        solution = new
        errors = per_record(task, target - first.psi @ theta)
    # Past outputs hold past noise, so an error of D correlates with that of A: slopes are of both.
    psi = np.hstack([solution.psi, np.concatenate([_lags(e, order) for e in errors])])
    return solution._replace(psi=psi, iterations=count, converged=done, noise=np.asarray(d))


def _lags(e: Array, order: int) -> Array:
    """Residuals of 1 to `order` samples before, negative; zero where D cannot judge, (n, order)."""
    rows = np.column_stack([-delay(e, i + 1) for i in range(order)])
    rows[:order] = 0.0
    return rows


def linearise(task: Task, theta: Array, noise: Array = WHITE) -> Solution:
    """Errors and slopes of the free simulation, both through D."""
    # Of A x = B u: dx/da_i = -z^-i x / A and dx/db_j = z^-j u / A. That is the matrix of
    # regressors with the free run x in place of the measured y, all through 1 / A.
    runs = free_runs(task, theta)
    psi = regressors(task, runs, theta[: task.na])
    missed = np.concatenate(task.outputs) - np.concatenate(runs)
    psi, missed = whiten(task, noise, psi), whiten(task, noise, missed)
    return Solution(theta, psi, missed, noise=noise)


def begins(task: Task) -> dict[str, Array]:
    """Starting points of the search: results of the other methods."""
    found = {"mls": iterate(task, instruments=False).theta}
    with suppress(InputError):
        found["sriv"] = iterate(task, instruments=True).theta
    with suppress(InputError):
        found["least_squares"] = equation_error(task).theta
    if task.na > 1:
        with suppress(InputError):
            low = iterate(task._replace(na=1, nb=1), instruments=False).theta
            theta = np.zeros(len(found["mls"]))
            theta[[0, task.na]] = low[:2]
            found["first order"] = theta
    return {n: t for n, t in found.items() if np.isfinite(t).all()}


def search_minima(
    task: Task, tried: Mapping[str, Array], noise: Array = WHITE
) -> dict[str, Solution]:
    """Minima of the free-run error through D next to each starting point, the best one first."""
    ends = {name: _descend(task, theta, noise) for name, theta in tried.items()}
    roots = task.roots
    costs = {name: float(((end.residual * roots) ** 2).sum()) for name, end in ends.items()}
    best = min(costs, key=lambda name: costs[name] if np.isfinite(costs[name]) else np.inf)
    return {best: ends[best], **ends}


def _descend(task: Task, begin: Array, noise: Array) -> Solution:
    roots = task.roots

    def missed(theta: Array) -> Array:
        a = theta[: task.na]
        if stable(a) is not a:  # a step out of the stable region is taken back
            return np.full(len(roots), np.inf)
        error = np.concatenate(task.outputs) - np.concatenate(free_runs(task, theta))
        return np.asarray(whiten(task, noise, error) * roots)

    def slopes(theta: Array) -> Array:
        return np.asarray(-linearise(task, theta, noise).psi * roots[:, None])

    first = np.r_[stable(begin[: task.na]), begin[task.na :]]
    if not np.isfinite(missed(first)).all():
        return linearise(task, first, noise)._replace(converged=False)
    found = least_squares(
        missed, first, slopes, x_scale="jac", max_nfev=MAX_ITERATIONS,
        ftol=_FINEST, xtol=_FINEST, gtol=_FINEST,
    )  # fmt: skip
    end = linearise(task, np.asarray(found.x), noise)
    return end._replace(iterations=int(found.nfev), converged=bool(found.status > 0))


def box_jenkins(task: Task) -> Solution:
    """Output error through D, an autoregression of the output noise, until both settle."""
    solution = next(iter(search_minima(task, begins(task)).values()))
    done, count = False, 0
    while not done and count < _ROUNDS:
        count += 1
        errors = per_record(task, linearise(task, solution.theta).residual)
        d = autoregression([e * (r.w > 0.0) for e, r in zip(errors, task.data, strict=True)])[0]
        u, y = (
            per_record(task, whiten(task, d, np.concatenate(each)))
            for each in (task.inputs, task.outputs)
        )
        through = [Record(a, b, r.w) for a, b, r in zip(u, y, task.data, strict=True)]
        tried = {"last": solution.theta, **begins(task._replace(data=through))}
        new = next(iter(search_minima(task, tried, d).values()))
        done = new.converged and is_settled(task, new.theta, solution.theta, new, _PART)
        solution = new
    return solution._replace(iterations=count, converged=done)


def spread(task: Task, solution: Solution) -> Spread:
    """Errors of the parameters by the scatter of stretches of the records."""
    roots = task.roots
    slopes, left = solution.psi * roots[:, None], solution.residual * roots
    # Few stretches are long ones: a slow disturbance and the rounding of an output that stands must
    # not reach from one into the next.
    size = slopes.shape[1]
    count = int(np.clip(len(left) // (_LENGTHS * size), 2, max(_STRETCHES, 2 * size)))
    cuts, row = [], 0
    for u in task.inputs:
        many = max(round(count * len(u) / len(left)), 1)
        cuts += [row + k * len(u) // many for k in range(many)]
        row += len(u)
    parts = np.split(slopes, cuts[1:])
    information = np.stack([part.T @ part for part in parts])
    return by_scores(information, np.add.reduceat(slopes * left[:, None], cuts, axis=0))
