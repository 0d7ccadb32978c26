"""What the linear methods share: regressors, the weighted solution, the finished fit.

Every method works on A(z) y = B(z) u + C(z) d, where d is an impulse at a record's
first sample. C carries the record's initial state (start="free"); it is empty for a
record that starts at rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify.linear_fit import LinearFit, percent, whiteness
from macromicro.identify.notices import ConvergenceWarning, RestWarning, UnstableWarning, notice
from macromicro.identify.records import Record, Signals, records
from macromicro.identify.spread import robust_covariance
from macromicro.identify.triangle import triangle

Start = Literal["rest", "free"]

MAX_ITERATIONS = 100
_TOLERANCE = 1e-4  # an iteration has settled when no parameter moves by this part of its error
_SPARE = 10


class Task(NamedTuple):
    """What to fit: checked records and the orders of the model.

    Attributes
    ----------
    data : list[Record]
        The records.
    na : int
        Coefficients a.
    nb : int
        Coefficients b.
    dt : float
        Sample time, s.
    delay : int
        Samples from u to y.
    starts : int
        Initial-state terms per record, 0 for records that start at rest.
    """

    data: list[Record]
    na: int
    nb: int
    dt: float
    delay: int
    starts: int

    @property
    def size(self) -> int:
        """Number of model parameters, na + nb."""
        return self.na + self.nb

    @property
    def weights(self) -> Array:
        """All weights, records stacked."""
        return np.concatenate([r.w for r in self.data])

    @property
    def roots(self) -> Array:
        """Square roots of all weights, records stacked."""
        return np.asarray(np.sqrt(self.weights))


class Solution(NamedTuple):
    """What a linear method found, records stacked.

    Attributes
    ----------
    theta : ndarray, shape (p,)
        a, b, then initial states.
    psi : ndarray, shape (n, p)
        Regressors, or instruments.
    residual : ndarray, shape (n,)
        The method's errors.
    """

    theta: Array
    psi: Array
    residual: Array


def prepared(
    u: Signals,
    y: Signals,
    orders: tuple[int, int, int],
    dt: float,
    weights: Signals | None,
    start: Start,
) -> Task:
    """A checked task.

    Parameters
    ----------
    u, y : array_like
        Input and output, shape (n,), or lists of such.
    orders : tuple[int, int, int]
        na, nb and delay.
    dt : float
        Sample time, s.
    weights : Signals | None
        As `y`, or None.
    start : Start
        "rest" or "free".

    Returns
    -------
    Task
        Records and orders.

    Raises
    ------
    InputError
        An option is not accepted, or the data are unusable.
    """
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
        raise InputError(
            "u", "constant", 'an input that changes; start="rest" for a step from rest'
        )
    return Task(data, int(na), int(nb), float(dt), int(delay), int(starts))


def delayed(x: Array, k: int) -> Array:
    """A signal, some samples later, zeros before it.

    Parameters
    ----------
    x : ndarray, shape (n,)
        The signal.
    k : int
        Samples.

    Returns
    -------
    ndarray, shape (n,)
        z^-k x.
    """
    return x if k == 0 else np.concatenate([np.zeros(min(k, len(x))), x[:-k]])


def filtered(a: Array, x: Array) -> Array:
    """x / A(z) from a zero state.

    Parameters
    ----------
    a : ndarray, shape (na,)
        Without the leading 1.
    x : ndarray, shape (n,)
        The signal.

    Returns
    -------
    ndarray, shape (n,)
        Filtered.
    """
    from scipy.signal import lfilter

    return np.asarray(lfilter([1.0], np.concatenate([[1.0], a]), x))


def impulse(n: int) -> Array:
    """1, 0, 0, ...

    Parameters
    ----------
    n : int
        Length.

    Returns
    -------
    ndarray, shape (n,)
        The impulse.
    """
    d = np.zeros(n)
    d[0] = 1.0
    return d


def regressors(task: Task, inputs: Sequence[Array], outputs: Sequence[Array], a: Array) -> Array:
    """Matrix of -y[k-i], u[k-j] and d[k-l], all through 1/A.

    Rows of all records are stacked; each record has its own initial-state columns.

    Parameters
    ----------
    task : Task
        Orders.
    inputs, outputs : Sequence[Array]
        Shape (n,) per record.
    a : ndarray, shape (na,)
        Coefficients of the filter, without the leading 1; empty for no filter.

    Returns
    -------
    ndarray, shape (n, p)
        p = na + nb + initial states.
    """
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
    """theta of psi' W (target - phi theta) = 0; psi is phi for least squares.

    Columns are scaled first, so that units do not matter.

    Parameters
    ----------
    psi, phi : ndarray, shape (n, p)
        Instruments and regressors.
    target : ndarray, shape (n,)
        What the regressors are to give.
    roots : ndarray, shape (n,)
        Square roots of the weights W.

    Returns
    -------
    ndarray, shape (p,)
        theta.

    Raises
    ------
    InputError
        The data do not determine the parameters.
    """
    scale = np.sqrt(np.einsum("ij,ij->j", phi, phi))
    if (scale == 0.0).any():
        raise InputError("record", "a signal that is zero throughout", "input and output that move")
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
        raise InputError(
            "record",
            "input and output do not determine all parameters",
            "an input that changes more often, or a model of lower order",
        )
    return np.asarray(theta / scale)


def plain(task: Task) -> Solution:
    """The least-squares solution of a task.

    Parameters
    ----------
    task : Task
        Records and orders.

    Returns
    -------
    Solution
        Parameters, regressors and one-step errors.

    Raises
    ------
    InputError
        The data do not determine the parameters.
    """
    phi = regressors(task, [r.u for r in task.data], [r.y for r in task.data], np.zeros(0))
    target = np.concatenate([r.y for r in task.data])
    theta = solved(phi, phi, target, task.roots)
    return Solution(theta, phi, target - phi @ theta)


def stable(a: Array) -> Array:
    """Coefficients with every root outside the unit circle reflected into it.

    Parameters
    ----------
    a : ndarray, shape (na,)
        Without the leading 1.

    Returns
    -------
    ndarray, shape (na,)
        Likewise.
    """
    if not len(a):
        return a
    roots = np.roots(np.concatenate([[1.0], a]))
    outside = np.abs(roots) > 1.0
    if not outside.any():
        return a
    roots[outside] = 1.0 / roots[outside].conj()
    return np.asarray(np.poly(roots)[1:].real)


def free_runs(task: Task, theta: Array) -> list[Array]:
    """(B u + C d) / A of every record.

    Parameters
    ----------
    task : Task
        Records and orders.
    theta : ndarray, shape (p,)
        a, b, then initial states.

    Returns
    -------
    list[Array]
        Shape (n,) per record; not finite where an unstable model overflows.
    """
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
    """A stacked array as one array per record.

    Parameters
    ----------
    task : Task
        Records.
    stacked : ndarray, shape (n, ...)
        All records in a row.

    Returns
    -------
    tuple[Array, ...]
        Views.
    """
    ends = np.cumsum([len(r.u) for r in task.data])[:-1]
    return tuple(np.split(stacked, ends))


def whitened(task: Task, d: Array, stacked: Array) -> Array:
    """D(z) x of every record.

    Parameters
    ----------
    task : Task
        Records.
    d : ndarray, shape (m,)
        d1, d2, ... of D.
    stacked : ndarray, shape (n,) or (n, p)
        All records in a row.

    Returns
    -------
    ndarray
        Likewise. Zero where D reaches past the record's start, for noise does not begin there, and
        where it reaches a sample of no weight.
    """
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
    """Covariance of all parameters, initial states included (`robust_covariance`).

    Parameters
    ----------
    task : Task
        Records.
    solution : Solution
        What was found.

    Returns
    -------
    ndarray, shape (p, p)
        In the order of theta.
    """
    w = task.weights
    ends = np.cumsum([len(r.u) for r in task.data])
    return robust_covariance(solution.psi, solution.residual * w, ends, w)


def settled(
    task: Task, new: Array, old: Array, solution: Solution, part: float = _TOLERANCE
) -> bool:
    """Whether the model moved by less than a small part of its standard errors.

    Parameters
    ----------
    task : Task
        Records and orders.
    new, old : ndarray, shape (p,)
        Parameters after and before an iteration.
    solution : Solution
        Solution with the regressors of `new`.
    part : float, optional
        Of a standard error.

    Returns
    -------
    bool
        Initial states do not count.
    """
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
    """The `LinearFit` of a solution, warnings included.

    Parameters
    ----------
    method : str
        Name of the function.
    task : Task
        Records and orders.
    solution : Solution
        What was found.
    iterations : int, optional
        How many it took.
    converged : bool, optional
        Whether they settled.
    noise : Array | None, optional
        d1, d2, ... of `gls`.

    Returns
    -------
    LinearFit
        With covariance, free runs and test of the residuals.
    """
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
    """Warn of records whose first output is far from zero, the state at rest."""
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
