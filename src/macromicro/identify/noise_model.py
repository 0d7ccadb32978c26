"""Box-Jenkins: output error with a noise model."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

from macromicro.arrays import Array
from macromicro.identify import _linear_draws
from macromicro.identify._descent import WHITE, begins, linearised, searched
from macromicro.identify._spread import autoregression, by_chance, clustered, covering
from macromicro.identify.coverage import Drawn
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

_ROUNDS = 20
_PART = 0.01  # of a standard error: rounds have settled when no parameter moves by more
_STRETCHES = 30  # that a covariance is judged by
_LONG = 20  # the order of D from which on noise is no autoregression
_FREE = ("sriv", "output_error")  # unbiased whatever the colour of the noise
# Standard errors, one in a thousand by chance: from there on two methods do not agree. With two of
# them what is far off by chance would not be told, and intervals of the rest would hold all.
_APART = 3.3
_BENT = 0.125  # at the ends of a 95 % interval runs are then off by a quarter of what moves them
_NO_NOISE = "the residual, such as cogging, is no noise"


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

    D is an autoregression of the residual, of the order (at most 30) that Akaike's criterion
    prefers; A and B minimise D (y - (B / A) u); repeated until they settle. This is the prediction-
    error method for Box-Jenkins models with autoregressive noise (Ljung, System Identification,
    sections 4.2 and 7.2; Young and Jakeman, 1979), of least variance for noise independent of the
    input. Errors are those by the model, or by the scatter of stretches of the record if that is
    larger; drawn where rounding to counts is the only residual; withheld under cogging.

    Parameters
    ----------
    u, y, na, nb, dt, delay, weights, start
        As for `least_squares`.

    Returns
    -------
    LinearFit
        Its `noise` holds d1, d2, ... of D; its residuals are e.

    Raises
    ------
    InputError
        An option is not accepted, or the data are unusable.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.signal import lfilter
    >>> from macromicro.identify import box_jenkins
    >>> u, e = np.random.default_rng(0).standard_normal((2, 2000))
    >>> y = lfilter([0.0, 0.2], [1.0, -0.9], u) + lfilter([0.1], [1.0, -0.5], e)  # D = 1 - 0.5 z^-1
    >>> fit = box_jenkins(u, y, na=1, nb=1, dt=0.01)
    >>> fit.a.round(2), fit.b.round(2), fit.noise.round(1)
    (array([-0.9]), array([0.2]), array([-0.5]))
    """
    task = prepared(u, y, (na, nb, delay), dt, weights, start)
    (first, _, _), _ = searched(task, begins(task))
    fit, theta = fitted(task, first)
    if exact(fit):
        return fit
    rounded = _linear_draws.rounding(task, theta, coloured=True)
    if rounded is not None:
        return _drawn(task, fit, rounded)
    # Where little of what it leaves repeats, output error may show it.
    if not fit.doubt and any(_linear_draws.cogging(task, at) for at in (theta, first.theta)):
        return withheld(fit, f"{_NO_NOISE}: a force that repeats along the way")
    return fit


def fitted(task: Task, first: Solution) -> tuple[LinearFit, Array]:
    """The fit of `box_jenkins` from a solution of output error, its residual treated as noise."""
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
    size = task.size
    return replace(fit, covariance=told.covariance[:size, :size], draws=told.draws[:, :size])


def coloured(task: Task, theta: Array) -> Array:
    """d1, d2, ... of a model's output noise."""
    runs = free_runs(task, theta)
    left = [(r.y - run) * (r.w > 0.0) for r, run in zip(task.data, runs, strict=True)]
    return autoregression(left)[0]


def _through(task: Task, noise: Array) -> Task:
    u = per_record(task, whitened(task, noise, np.concatenate([r.u for r in task.data])))
    y = per_record(task, whitened(task, noise, np.concatenate([r.y for r in task.data])))
    parts = zip(u, y, task.data, strict=True)
    return task._replace(data=[Record(x, z, r.w) for x, z, r in parts])


def _widened(task: Task, solution: Solution, fit: LinearFit) -> LinearFit:
    """Errors by stretches of the record where these are larger than by chance."""
    # A disturbance that depends on the motion is no noise, even if its residuals are white.
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
    """A fit with its errors where they are valid: the method and `box_jenkins` agree."""
    # `least_squares`, `gls` and `mls` assume white residuals. The others are valid with white
    # residuals, or with redrawn cogging or rounding; with coloured noise a slow pole nearly
    # cancelled by a zero may follow the noise. Errors are to first order, so they must be small
    # enough (`bent`).
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
    """Errors by draws where the residual is no noise; white residuals show no cogging."""
    rounded = _linear_draws.rounding(task, theta)
    if rounded is not None or white:
        return rounded
    cogs = _linear_draws.cogging(task, theta)
    return _linear_draws.cogged(task, theta, cogs) if cogs else None


def bent(task: Task, theta: Array, spread: Array) -> float:
    """Nonlinearity of free simulations within one standard error.

    |y(+) + y(-) - 2 y| / |y(+) - y(-)| in the worst independent direction (D. Bates, D. Watts, J.
    Royal Statistical Society B 42, 1980, p. 1).
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
