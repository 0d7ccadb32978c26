"""A sprung, coasting or dead-zoned drive by output error: `sprung_drive`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.identify import _sprung_doubts, _sprung_start, coverage
from macromicro.identify._ripple import Ripple
from macromicro.identify._sprung_search import (
    FRICTIONS,
    End,
    Model,
    first,
    judged,
    moving,
    searched,
)
from macromicro.identify.runs import Run
from macromicro.identify.search import least_squares
from macromicro.identify.sprung import Sprung, simulate

_HELD_OUT = 0.3
_BETTER = 0.02  # a richer friction must lower the held-out error by this part
_NONSENSE = 0.1  # misfit beyond which parameters do not describe the record
_BACK = 0.05  # of a record's travel: more is a motion that turns
_SAME = 1e-3  # of the least error: searches that end so near are at one minimum


@dataclass(frozen=True)
class SprungFit:
    model: Model  # with the chosen friction
    axis: Sprung  # parameters; of a free motion per mass, whose `mass` is 1
    names: tuple[str, ...]  # the free ones
    covariance: Array  # covariance of these
    # position and speed at the start of each record, found with the parameters
    starts: tuple[tuple[float, float], ...]
    free_run: tuple[Array, ...]  # the output by the model, an array per record
    residuals: tuple[Array, ...]  # measured less free run
    # RMS of each friction over the last parts, by a fit to the first ones; empty where one was
    # asked for
    holdout: dict[str, float]
    ends: tuple[float, ...]  # RMS where each search ended, least first
    gain: float  # force per unit of u
    lag: float  # time by which u acts late, s
    # errors of the parameters as drawn, where a force that repeats along the way or rounding to
    # counts makes them other than normal
    draws: Array | None = None
    # A force that repeats along the way and is not in the model, where the residuals show one
    repeats: Ripple | None = None

    @property
    def values(self) -> Array:
        return np.array([getattr(self.axis, name) for name in self.names])

    @property
    def std(self) -> Array:
        return np.sqrt(np.diag(self.covariance))

    @property
    def rms(self) -> float:
        return float(np.sqrt(np.mean(np.concatenate(self.residuals) ** 2)))

    @property
    def factors(self) -> Array:
        """Coverage factors, shape (2, p)."""
        return coverage.factors(self.draws, np.eye(len(self.names)))

    def derived(self, of: str) -> tuple[float, float, Array]:
        """A property of `Sprung` and its error, by its slopes."""
        value = float(getattr(self.axis, of))
        slopes = []
        for name, at in zip(self.names, self.values, strict=True):
            h = 1e-6 * max(abs(float(at)), 1e-12)
            up = self.axis._replace(**{name: at + h})
            slopes.append((getattr(up, of) - value) / h)
        table = np.array([slopes])
        error = float(coverage.errors(self.covariance, table)[0])
        return value, error, coverage.factors(self.draws, table)[:, 0]

    def simulate(self, u: Any, dt: float, x: float = 0.0, v: float = 0.0) -> Array:
        push = self.gain * np.asarray(u, np.float64)
        return simulate(self.axis, push, dt, x, v, self.lag)[int(self.model.speed)]


def sprung_drive(
    records: Sequence[Run],
    *,
    driven: bool = True,
    speed: bool = False,
    spring: bool = False,
    dead_zone: bool = False,
    friction: str = "auto",
    gain: float = 1.0,
    lag: float = 0.0,
) -> SprungFit:
    """Parameters of M dv/dt = D(gain u) - k x - friction(v) - F0 (`macromicro.identify.sprung`)."""
    # Initial states are fitted; a free motion is fitted only until it is over. Standard errors
    # allow for disturbing forces and coloured residuals.
    if friction != "auto" and friction not in FRICTIONS:
        raise InputError("structure", friction, f"auto or one of {', '.join(FRICTIONS)}")
    if dead_zone and not driven:
        raise ProblemError("dead zone", "there is no column u", "Give the input of the drive.")
    if not spring and not speed and not driven and _turns(records):
        raise ProblemError(
            "record", "the free motion turns back", "Add --spring, or a column u of a drive."
        )
    whole = [r._replace(u=gain * r.u if driven else np.zeros_like(r.x)) for r in records]
    names = list(FRICTIONS) if friction == "auto" else [friction]
    models = [Model(n, spring, dead_zone, driven, speed) for n in names]
    holding = [m for m in models if "coulomb" in m.names]
    kept = whole
    if not driven and holding:
        # Where friction stops the mass is chance within a band, so the motion alone is better
        # evidence, unless it is too short to show what stops it.
        short, end = moving(whole, holding[0], lag)
        if _misses(whole, end, lag, int(speed)) < _NONSENSE:
            kept = short
    scores: dict[str, float] = {}
    chosen = models[0]
    if len(models) > 1:
        cut = [first(r, int((1.0 - _HELD_OUT) * len(r.t))) for r in kept]
        for model in models:
            try:
                fit = searched(cut, model, lag)[0]
            except InputError:
                continue
            scores[model.friction] = judged(kept, cut, fit, model, lag)
        least = min(scores.values(), default=np.inf)
        fair = [m for m in models if scores.get(m.friction, np.inf) <= least * (1.0 + _BETTER)]
        if not fair:
            raise ProblemError(
                "record", "no friction could be fitted", "Record a motion that shows it."
            )
        chosen = fair[0]
    ends = searched(kept, chosen, lag)
    best = ends[0]
    sure = _sprung_doubts.covariance(kept, best, chosen.names, lag, speed=speed)
    starts = tuple((float(x), float(v)) for x, v in best.starts)
    free = tuple(
        simulate(best.axis, r.u, r.dt, x, v, lag)[int(speed)]
        for r, (x, v) in zip(whole, starts, strict=True)
    )
    residuals = tuple(r.x - run for r, run in zip(whole, free, strict=True))
    rms = tuple(e.rms for e in ends)
    return SprungFit(
        chosen,
        best.axis,
        chosen.names,
        sure.covariance,
        starts,
        free,
        residuals,
        scores,
        rms,
        gain,
        lag,
        sure.draws,
        sure.repeats,
    )


def _misses(records: Sequence[Run], end: End, lag: float, column: int) -> float:
    """RMS misfit of free simulations, by the scatter of the records."""
    missed = [
        simulate(end.axis, r.u, r.dt, x, v, lag)[column] - r.x
        for r, (x, v) in zip(records, end.starts.tolist(), strict=True)
    ]
    return float(np.std(np.concatenate(missed)) / np.std(np.concatenate([r.x for r in records])))


def _turns(records: Sequence[Run]) -> bool:
    """Whether a position reverses by more than its noise."""
    for r in records:
        x = r.x
        back = np.maximum.accumulate(x) - x if x[-1] >= x[0] else x - np.minimum.accumulate(x)
        if back.max() > _BACK * np.ptp(x):
            return True
    return False


def same(ends: Sequence[float]) -> int:
    return sum(e <= ends[0] * (1.0 + _SAME) for e in ends)


def started(fit: SprungFit, run: Run) -> tuple[float, float]:
    """Initial state with the nearest free simulation over the first part."""
    many = len(run.t) // 10
    if fit.model.spring:
        many = int(1.0 / (fit.axis.frequency * run.dt))
    part = Run(*(column[: min(max(many, 20), len(run.t))] for column in run))
    speed = fit.model.speed
    begin = _sprung_start.start(part, speed)
    size = np.array(_sprung_start.scales([part], speed, 1.0))

    def missed(at: Array) -> Array:
        x, v = at * size
        free = fit.simulate(part.u, part.dt, float(x), float(v))
        return np.asarray((part.x - free) / size[int(speed)])

    placed = fit.model.spring or not speed
    low = np.array([-np.inf if placed else -1e-12, -np.inf])
    high = np.array([np.inf if placed else 1e-12, np.inf])
    found = least_squares(missed, np.array(begin) / size, bounds=(low, high))
    x, v = (found.x * size).tolist()
    return float(x), float(v)
