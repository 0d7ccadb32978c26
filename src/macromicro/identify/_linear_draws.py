"""Errors of a linear model where the disturbance depends on the motion and is no noise.

Cogging is a force d = A sin(k x + phi) at the input, x the running sum of a speed; rounding is
periodic in the output. Each is drawn in any phase (parametric bootstrap, B. Efron, R. Tibshirani,
An Introduction to the Bootstrap, chapter 6, with one Gauss-Newton step per refit).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from macromicro.arrays import Array
from macromicro.identify import _counts
from macromicro.identify._descent import linearised
from macromicro.identify._ripple import Ripple, ripple
from macromicro.identify._spread import autoregression
from macromicro.identify.coverage import Drawn, normal
from macromicro.identify.records import Record
from macromicro.identify.regression import (
    Solution,
    Task,
    covariance,
    delayed,
    free_runs,
    per_record,
    whitened,
)

_PHASES = 160  # drawn
_MOST = 0.5  # of the force's power: less is no matter of the way in the main


def rounding(task: Task, theta: Array, *, coloured: bool = False) -> Drawn | None:
    """Errors where rounding of the outputs is the only residual."""
    runs, outputs = free_runs(task, theta), [r.y for r in task.data]
    if not all(np.isfinite(run).all() for run in runs):
        return None
    steps = _counts.steps(outputs, [y - run for y, run in zip(outputs, runs, strict=True)])
    if steps is None:
        return None
    slopes = linearised(task, theta).psi
    solve = np.linalg.pinv(slopes * task.roots[:, None])

    def asked(error: Array) -> Array:
        return _by_colour(task, slopes, error) if coloured else solve @ (error * task.roots)

    told = _counts.redrawn(asked, slopes, runs, steps)
    return told if _counts.alone(slopes, told.covariance, outputs, runs, steps) else None


def _by_colour(task: Task, slopes: Array, error: Array) -> Array:
    """Errors of `box_jenkins` for output errors whose D is known."""
    parts = zip(per_record(task, error), task.data, strict=True)
    noise = autoregression([part * (r.w > 0.0) for part, r in parts])[0]
    rows = whitened(task, noise, np.column_stack([slopes, error])) * task.roots[:, None]
    size = np.linalg.norm(rows[:, :-1], axis=0)
    size[size == 0.0] = 1.0
    return np.asarray(np.linalg.lstsq(rows[:, :-1] / size, rows[:, -1], rcond=None)[0] / size)


def cogging(task: Task, theta: Array) -> list[Ripple]:
    """Periodic force along each record; empty if one record has none.

    It explains the residual e as A e / B; B acts on a slow force like the sum of its terms.
    """
    from scipy.signal import lfilter

    base = linearised(task, theta)
    total = float(theta[task.na : task.size].sum())
    if not (np.isfinite(base.residual).all() and total):
        return []
    found = []
    rows = per_record(task, np.column_stack([base.psi, base.residual]))
    for r, part in zip(task.data, rows, strict=True):
        force = lfilter(np.r_[1.0, theta[: task.na]], [1.0], part, axis=0)[task.delay :] / total
        place, left = _ways(task, r)[: len(force)], force[:, -1]
        one = ripple([left], [place], [force[:, :-1]])
        # Slow noise repeats in part by chance. Of a poor model's force, parameters may take all
        # that does not repeat.
        if one is None or _power(left - one.at(place)) > (1.0 - _MOST) * _power(left):
            return []
        found.append(one)
    return found


def _ways(task: Task, r: Record) -> Array:
    """Position at each sample, one earlier for a force that acts on the same sample."""
    return np.asarray(np.cumsum(delayed(r.y, int(task.delay == 0))) * task.dt)


def _power(x: Array) -> float:
    return float(x @ x)


def cogged(task: Task, theta: Array, cogs: Sequence[Ripple]) -> Drawn:
    """Errors of a fit under a periodic force."""
    from scipy.signal import lfilter

    base, roots = linearised(task, theta), task.roots
    solve = np.linalg.pinv(base.psi * roots[:, None]) * roots
    phases = 2.0 * np.pi * _counts.places(len(cogs), _PHASES)
    draws = np.zeros((_PHASES, len(theta)))
    rows = (per_record(task, each) for each in (solve.T, np.concatenate(free_runs(task, theta))))
    for i, (back, run) in enumerate(zip(*rows, strict=True)):
        draws += (pushed(task, theta, i, cogs[i], phases[:, i]) - run) @ back
    # A force in the phase that was found, taken off what is left. The fit has taken its part of
    # that force, which is no noise either.
    top = np.r_[np.zeros(task.delay), theta[task.na : task.size]]
    answers = [
        lfilter(top, np.r_[1.0, theta[: task.na]], cog.at(_ways(task, r)))
        for cog, r in zip(cogs, task.data, strict=True)
    ]
    rest = base.residual - np.concatenate(answers)
    left = covariance(task, Solution(theta, base.psi, rest - base.psi @ (solve @ rest)))
    random = np.random.Generator(np.random.PCG64(0))  # the same data give the same errors
    draws += normal(left, _PHASES, random)
    return Drawn(draws.T @ draws / _PHASES, draws)


def pushed(task: Task, theta: Array, record: int, cog: Ripple, phases: Array) -> Array:
    """Free simulations of a record under a force that is periodic along their own path."""
    from scipy.signal import lfilter

    r, (a, b) = task.data[record], (theta[: task.na], theta[task.na : task.size])
    drive = lfilter(np.r_[np.zeros(task.delay), b], [1.0], r.u)
    at = task.size + record * task.starts
    drive[: task.starts] += theta[at : at + task.starts]
    reach = max(task.na, task.nb + task.delay)
    y, d = np.zeros((2, len(drive) + reach, len(phases)))
    place, late = np.zeros(len(phases)), int(task.delay > 0)
    back, ahead = a[::-1], b[::-1]
    for k in range(reach, len(y)):
        # A force that acts on the same sample is that of the place before it.
        if k - late >= reach:
            d[k - late] = cog.at(place, phases)
        last = k - task.delay + 1
        y[k] = drive[k - reach] + ahead @ d[last - task.nb : last] - back @ y[k - task.na : k]
        place = place + y[k] * task.dt
    return np.asarray(y[reach:].T)
