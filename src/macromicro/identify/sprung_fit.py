"""A sprung, coasting or dead-zoned drive from its records, by output error: `sprung_drive`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify import coverage, sprung_doubts, sprung_start
from macromicro.identify.ripple import Ripple
from macromicro.identify.runs import Run
from macromicro.identify.sprung import Sprung, simulate
from macromicro.identify.sprung_search import FRICTIONS, Model, first, judged, moving, searched

_HELD_OUT = 0.3
_BETTER = 0.02  # a richer friction must lower the held-out error by this part
_BACK = 0.05  # of a record's travel: more is a motion that turns
_SAME = 1e-3  # of the least error: searches that end so near are at one minimum


@dataclass(frozen=True)
class SprungFit:
    """What `sprung_drive` found.

    Attributes
    ----------
    model : Model
        What was asked, with the friction that was chosen.
    axis : Sprung
        Parameters; of a free motion per mass, whose `mass` is 1.
    names : tuple[str, ...]
        The free ones.
    covariance : ndarray, shape (p, p)
        Covariance of these.
    starts : tuple[tuple[float, float], ...]
        Position and speed at the start of each record, found with the parameters.
    free_run : tuple[Array, ...]
        The output by the model, an array per record.
    residuals : tuple[Array, ...]
        Measured less free run.
    holdout : dict[str, float]
        RMS of each friction over the last parts, by a fit to the first ones; empty where one was
        asked for.
    ends : tuple[float, ...]
        RMS where each search ended, least first.
    gain : float
        Force per unit of u.
    lag : float
        Time by which u acts late, s.
    draws : ndarray, shape (n, p), or None
        Errors of the parameters as drawn, where a force that repeats along the way or rounding to
        counts makes them other than normal.
    repeats : Ripple or None
        A force that repeats along the way and is not in the model, where the residuals show one.
    """

    model: Model
    axis: Sprung
    names: tuple[str, ...]
    covariance: Array
    starts: tuple[tuple[float, float], ...]
    free_run: tuple[Array, ...]
    residuals: tuple[Array, ...]
    holdout: dict[str, float]
    ends: tuple[float, ...]
    gain: float
    lag: float
    draws: Array | None = None
    repeats: Ripple | None = None

    @property
    def values(self) -> Array:
        """The free parameters, in the order of `names`."""
        return np.array([getattr(self.axis, name) for name in self.names])

    @property
    def std(self) -> Array:
        """Standard errors, in the order of `names`."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def rms(self) -> float:
        """RMS error of the free run over all records."""
        return float(np.sqrt(np.mean(np.concatenate(self.residuals) ** 2)))

    @property
    def factors(self) -> Array:
        """Coverage factors (`coverage.factors`) of these, shape (2, p)."""
        return coverage.factors(self.draws, np.eye(len(self.names)))

    def derived(self, of: str) -> tuple[float, float, Array]:
        """A property of `Sprung` and its error, by its slopes.

        Parameters
        ----------
        of : str
            "frequency" or "damping".

        Returns
        -------
        value : float
            As there.
        error : float
            Standard error, NaN where none is known.
        factors : ndarray, shape (2,)
            Its coverage factors.
        """
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
        """Free run of the output.

        Parameters
        ----------
        u : array_like, shape (n,)
            Input; `gain` and `lag` are applied. Zeros for a free motion.
        dt : float
            Sample time, s.
        x, v : float, optional
            Position and speed at the start.

        Returns
        -------
        ndarray, shape (n,)
            Positions, or speeds where the output is the speed.
        """
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
    """Parameters of M dv/dt = D(gain u) - k x - friction(v) - F0 (`macromicro.identify.sprung`).

    Position and speed at the start of each record are found with the parameters; what a free motion
    holds after it is over is not fitted. Standard errors allow for disturbing forces and for
    coloured residuals. Warns (`DataWarning`) of searches that end apart and of parameters
    that the records do not tell apart.

    Parameters
    ----------
    records : Sequence[Run]
        Time, input and output, each evenly sampled; where nothing drives, u is not looked at.
    driven : bool, optional
        Whether u drives; else parameters come per mass.
    speed : bool, optional
        Whether `x` of the records holds speeds.
    spring : bool, optional
        Whether there is a spring.
    dead_zone : bool, optional
        Whether the drive has a dead zone.
    friction : str, optional
        A key of `FRICTIONS`, or "auto": the poorest from which a richer one is not 2 % better on
        the last parts of the records, fitted to the first ones.
    gain : float, optional
        Force per unit of u.
    lag : float, optional
        Time by which u acts late, s.

    Returns
    -------
    SprungFit
        With standard errors.

    Raises
    ------
    InputError
        An option is not accepted, or the records do not determine the parameters.
    """
    if friction != "auto" and friction not in FRICTIONS:
        raise InputError("structure", friction, f"auto or one of {', '.join(FRICTIONS)}")
    if dead_zone and not driven:
        raise InputError("dead zone", "no column u", "a drive that can have one")
    if not spring and not speed and not driven and _turns(records):
        raise InputError(
            "record", "a free motion that turns back", "a spring (--spring), or a drive's u"
        )
    whole = [r._replace(u=gain * r.u if driven else np.zeros_like(r.x)) for r in records]
    names = list(FRICTIONS) if friction == "auto" else [friction]
    models = [Model(n, spring, dead_zone, driven, speed) for n in names]
    holding = [m for m in models if "coulomb" in m.names]
    kept = whole if driven or not holding else moving(whole, holding[0], lag)
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
            raise InputError("record", "no friction could be fitted", "a motion that shows it")
        chosen = fair[0]
    ends = searched(kept, chosen, lag)
    best = ends[0]
    sure = sprung_doubts.covariance(kept, best, chosen.names, lag, speed=speed)
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


def _turns(records: Sequence[Run]) -> bool:
    """Whether a position goes back by more than it shakes."""
    for r in records:
        x = r.x
        back = np.maximum.accumulate(x) - x if x[-1] >= x[0] else x - np.minimum.accumulate(x)
        if back.max() > _BACK * np.ptp(x):
            return True
    return False


def same(ends: Sequence[float]) -> int:
    """How many searches ended at the least error.

    Parameters
    ----------
    ends : Sequence[float]
        RMS of each, least first.

    Returns
    -------
    int
        1 or more.
    """
    return sum(e <= ends[0] * (1.0 + _SAME) for e in ends)


def started(fit: SprungFit, run: Run) -> tuple[float, float]:
    """Position and speed from which the model's free run is nearest to the first part of a record.

    Parameters
    ----------
    fit : SprungFit
        What was found.
    run : Run
        A record, its input in units of u.

    Returns
    -------
    x : float
        Position.
    v : float
        Speed.
    """
    from scipy.optimize import least_squares

    many = len(run.t) // 10
    if fit.model.spring:
        many = int(1.0 / (fit.axis.frequency * run.dt))
    part = Run(*(column[: min(max(many, 20), len(run.t))] for column in run))
    speed = fit.model.speed
    begin = sprung_start.start(part, speed)
    size = np.array(sprung_start.scales([part], speed, 1.0))

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
