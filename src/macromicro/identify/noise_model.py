"""Box-Jenkins: output error whose noise has a colour of its own, found beside the model."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

from macromicro.arrays import Array
from macromicro.identify import linear_draws
from macromicro.identify.coverage import Drawn
from macromicro.identify.descent import WHITE, begins, linearised, searched
from macromicro.identify.linear_fit import LinearFit, exact, withheld
from macromicro.identify.notices import DataWarning
from macromicro.identify.records import Record, Signals
from macromicro.identify.regression import (
    Solution,
    Start,
    Task,
    covariance,
    finished,
    free_runs,
    per_record,
    prepared,
    settled,
    whitened,
)
from macromicro.identify.spread import autoregression, by_chance, clustered, covering

_ROUNDS = 20
_PART = 0.01  # of a standard error: rounds have settled when no parameter moves by more
_STRETCHES = 30  # that a covariance is judged by
_LONG = 20  # the order of D from which on noise is no autoregression
_FREE = ("sriv", "output_error")  # unbiased whatever the colour of the noise
# Standard errors, one in a thousand by chance: from there on two methods do not agree. With two of
# them what is far off by chance would not be told, and intervals of the rest would hold all.
_APART = 3.3
_BENT = 0.125  # at the ends of a 95 % interval runs are then off by a quarter of what moves them
_NO_NOISE = "what the model leaves, such as cogging, is no noise"


def box_jenkins(
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
    """y = (B / A) u + e / D with e white: a model of the machine and one of the noise.

    D is fitted to what the free run misses, as an autoregression of the order, at most 30, that
    Akaike's criterion prefers; then A and B minimise the sum of squares of D (y - (B / A) u); and
    so on until they settle. That is the prediction-error method for Box-Jenkins models whose noise
    is autoregressive (Ljung, System Identification, sections 4.2 and 7.2; Young and Jakeman, 1979,
    by instruments), and of least variance for any noise that the input did not cause. Errors are
    those by the model, or where stretches of the record scatter by more than chance, by these;
    where rounding to counts is all that is left, they are drawn. They are withheld under cogging.

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
        Its `noise` holds d1, d2, ... of D; its residuals are e.

    Raises
    ------
    InputError
        An option is not accepted, or the data are unusable.
    """
    task = prepared(u, y, (na, nb, delay), dt, weights, start)
    (first, _, _), _ = searched(task, begins(task))
    fit, theta = fitted(task, first)
    if exact(fit):
        return fit
    rounded = linear_draws.rounding(task, theta, coloured=True)
    if rounded is not None:
        return _drawn(task, fit, rounded)
    # Where little of what it leaves repeats, output error may show it.
    if not fit.doubt and any(linear_draws.cogging(task, at) for at in (theta, first.theta)):
        return withheld(fit, f"{_NO_NOISE}: a force that repeats along the way")
    return fit


def fitted(task: Task, first: Solution) -> tuple[LinearFit, Array]:
    """The fit of `box_jenkins` from a solution of output error on, what it leaves taken for noise.

    Parameters
    ----------
    task : Task
        Records and orders.
    first : Solution
        Where it begins; other methods' results are tried as well.

    Returns
    -------
    fit : LinearFit
        With errors, or without where what is left is no autoregression.
    theta : ndarray, shape (p,)
        Its parameters and initial states.

    Raises
    ------
    InputError
        The data do not determine the parameters.
    """
    solution, noise, count, done = first, WHITE, 0, False
    while not done and count < _ROUNDS:
        count += 1
        noise = coloured(task, solution.theta)
        tried = {"the last round": solution.theta, **begins(_through(task, noise))}
        (new, _, stopped), _ = searched(task, tried, noise)
        done = stopped and settled(task, new.theta, solution.theta, new, _PART)
        solution = new
    fit = finished("box_jenkins", task, solution, count, converged=done, noise=noise)
    if len(noise) > _LONG:
        found = f"an autoregression of {len(noise)} terms"
        return withheld(fit, f"{_NO_NOISE}: {found}"), solution.theta
    return _widened(task, solution, fit), solution.theta


def _drawn(task: Task, fit: LinearFit, told: Drawn) -> LinearFit:
    """A fit with the errors of draws."""
    size = task.size
    return replace(fit, covariance=told.covariance[:size, :size], draws=told.draws[:, :size])


def coloured(task: Task, theta: Array) -> Array:
    """d1, d2, ... of the noise that a model leaves in the output.

    Parameters
    ----------
    task : Task
        Records and orders.
    theta : ndarray, shape (p,)
        The model.

    Returns
    -------
    ndarray, shape (m,)
        Empty for white noise.
    """
    runs = free_runs(task, theta)
    left = [(r.y - run) * (r.w > 0.0) for r, run in zip(task.data, runs, strict=True)]
    return autoregression(left)[0]


def _through(task: Task, noise: Array) -> Task:
    """The task with inputs and outputs through D, to begin searches by."""
    u = per_record(task, whitened(task, noise, np.concatenate([r.u for r in task.data])))
    y = per_record(task, whitened(task, noise, np.concatenate([r.y for r in task.data])))
    parts = zip(u, y, task.data, strict=True)
    return task._replace(data=[Record(x, z, r.w) for x, z, r in parts])


def _widened(task: Task, solution: Solution, fit: LinearFit) -> LinearFit:
    """Errors by stretches of the record where they are larger than by chance: a disturbance that
    depends on the motion is no noise, and residuals of it may be white all the same."""
    n, p = solution.psi.shape
    length = max(n // _STRETCHES, 1)
    if n < 4 * p * length:
        return fit
    starts, row = [], 0
    for record in task.data:
        many = max(len(record.u) // length, 1)
        starts += [row + k * len(record.u) // many for k in range(many)]
        row += len(record.u)
    slopes, left = solution.psi * task.roots[:, None], solution.residual * task.roots
    other = clustered(slopes, left, starts)[: task.size, : task.size]
    found = covering(fit.covariance, other, by_chance(len(starts), task.size))
    return replace(fit, covariance=found)


def compared(task: Task, solution: Solution, fit: LinearFit) -> LinearFit:
    """A fit with its errors where they hold: what the method supposes, and `box_jenkins`, agree.

    `least_squares`, `gls` and `mls` suppose white residuals. Of the others there is no question
    where the residuals are white, or where cogging or rounding, which are drawn anew, made them;
    where noise is coloured, the nearest free run may be that of a slow pole which a zero nearly
    cancels, and which follows the noise. Errors are to first order, and told where they are small
    enough for that (`bent`).

    Parameters
    ----------
    task : Task
        Records and orders.
    solution : Solution
        What the method found.
    fit : LinearFit
        Of it, with errors.

    Returns
    -------
    LinearFit
        With errors, or without.
    """
    free, white = fit.method in _FREE, fit.whiteness.white
    if exact(fit):
        return fit
    if not (free or white):
        text = f"{fit.method} is biased where residuals are not white; see box_jenkins"
        return withheld(fit, text)
    drawn = _redrawn(task, solution.theta, white=white) if free else None
    if drawn is not None:
        fit = _drawn(task, fit, drawn)
    where, spread = solution.theta, fit.covariance
    if not (free and white) and drawn is None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DataWarning)
            other, theta = fitted(task, solution)
        apart = np.abs(np.r_[fit.a, fit.b] - np.r_[other.a, other.b])
        if not (apart <= _APART * np.fmax(fit.std, other.std)).all():
            text = "box_jenkins, which models the colour of the noise, finds another model"
            return withheld(fit, text)
        if not other.doubt:  # nearer to the machine: an error is not told for being small by chance
            where = theta
            spread = covariance(task, linearised(task, theta))[: task.size, : task.size]
    if free and bent(task, where, spread) > _BENT:
        return withheld(
            fit, "so large that free runs are not proportional to them; see box_jenkins"
        )
    return fit


def _redrawn(task: Task, theta: Array, *, white: bool) -> Drawn | None:
    """Errors by draws where what is left is no noise: white residuals show no cogging."""
    rounded = linear_draws.rounding(task, theta)
    if rounded is not None or white:
        return rounded
    cogs = linear_draws.cogging(task, theta)
    return linear_draws.cogged(task, theta, cogs) if cogs else None


def bent(task: Task, theta: Array, spread: Array) -> float:
    """How far free runs are from proportional to errors of the parameters.

    |y(+) + y(-) - 2 y| / |y(+) - y(-)|, where y(+) and y(-) are free runs of parameters that are
    off by a standard error in both senses, in the worst of the directions in which errors are
    independent (D. Bates, D. Watts, J. Royal Statistical Society B 42, 1980, p. 1).

    Parameters
    ----------
    task : Task
        Records and orders.
    theta : ndarray, shape (p,)
        What was found.
    spread : ndarray, shape (na + nb, na + nb)
        Covariance of a and b.

    Returns
    -------
    float
        0 for a model that is linear in its parameters; infinite where one of the runs overflows.
    """
    size = np.sqrt(np.diag(spread))
    size[size == 0.0] = 1.0
    power, turned = np.linalg.eigh(spread / np.outer(size, size))
    middle, most = np.concatenate(free_runs(task, theta)), 0.0
    for move in (turned * np.sqrt(np.maximum(power, 0.0))).T:
        by = np.zeros(len(theta))
        by[: task.size] = size * move
        more, less = (np.concatenate(free_runs(task, theta + s * by)) for s in (1.0, -1.0))
        with np.errstate(over="ignore", invalid="ignore"):
            first, second = np.linalg.norm(more - less), np.linalg.norm(more + less - 2.0 * middle)
        if not np.isfinite(second):
            return float(np.inf)
        most = max(most, float(second / first) if first > 0.0 else 0.0)
    return most
