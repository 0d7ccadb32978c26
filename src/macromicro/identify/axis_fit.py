"""Physical parameters of a motor-driven axis from a recording: `drive`."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.identify import _axis_hints, _moved_mass, clusters
from macromicro.identify._moved_mass import Model
from macromicro.identify.axis_inverse import (
    STRUCTURES,
    Estimate,
    Rows,
    differences,
    fit_structure,
    plausible,
    under,
    with_instruments,
    with_lag,
)
from macromicro.identify.engine import Judged, turn
from macromicro.identify.notices import DataWarning, notice
from macromicro.identify.records import fit_percent, flag_saturation, rms
from macromicro.identify.runs import Run, checked
from macromicro.identify.sprung_fit import FIT, Load, SprungFit, conclude
from macromicro.models.mass import Axis, late, motion, simulate

_LEAST = 200
_SHARE = 0.05  # of the time: an axis that goes back for less shows no friction in that direction
_MANY = 3  # with so many records, whole ones are held out
_BLOCKS = 12  # of a record whose last part shows what the rest does not
_HELD = 0.3  # of each record, at its end: held out
_LATER = 60  # samples by which a delay may be later than where its search begins
_FLOOR = 1e-2  # of a negative mass or friction: where the search begins
_REST = 0.02  # of the greatest speed
CUTOFF = _moved_mass.CORNER  # of positions, in the samples' rate, where none is asked for


class Filtering(NamedTuple):
    """How positions are differentiated for inverse dynamics.

    Examples
    --------
    >>> from macromicro.identify import Filtering
    >>> Filtering(cutoff=40.0)  # Hz
    Filtering(cutoff=40.0, decimate=None)
    """

    #: cut-off of the zero-phase low-pass on positions, Hz; by default 0.08 / dt
    cutoff: float | None = None
    #: every how many samples remain, after a low-pass on force and regressors alike; by default 10,
    #: fewer for short records
    decimate: int | None = None


USUAL = Filtering()


class Driven(NamedTuple):
    gain: float = 1.0  # force per unit of u
    limit: float | None = None  # u saturates there
    delay: int = 0  # samples by which u acts late
    eccentric: bool = False  # eccentric load under gravity
    filtering: Filtering = USUAL

    def force(self, u: Array) -> Array:
        within = u if self.limit is None else np.clip(u, -self.limit, self.limit)
        pull = late(within, self.delay)
        return pull if self.gain == 1.0 else self.gain * pull  # no copy: records may be long


@dataclass(frozen=True)
class DriveFit:
    """What `drive` found; x is the unit of position, and force is `gain` times u."""

    structure: str  #: the chosen one of "viscous", "coulomb", "asymmetric", "stribeck", "full"
    inverse: Estimate  #: the estimate by inverse dynamics
    refined: Estimate  #: the estimate by output error
    #: RMS force error of each structure tried on data that it was not fitted to, in a typical
    #: block; empty when one was asked for
    holdout: dict[str, float]
    #: position RMS of the free run over the last 30 % of each record (of three or more: over every
    #: third one) by the output-error fit to the rest
    holdout_rms: float
    #: position and speed at the start of each record, as its free run asks for
    starts: tuple[tuple[float, float], ...]
    #: positions of the axis over each whole record, from `starts`
    free_run: tuple[Array, ...]
    residuals: tuple[Array, ...]  #: measured position less free run, an array per record
    gain: float  #: force per unit of u
    delay: int  #: samples by which u acts late
    #: why each other structure was not chosen, in words
    reasons: dict[str, str] = field(default_factory=dict)
    limit: float | None = None  #: u saturates there

    @property
    def surest(self) -> Estimate:
        """The estimate with the smaller standard errors; the others of this result are by it."""
        return self.inverse if is_surer(self.inverse, self.refined) else self.refined

    @property
    def rms(self) -> float:
        """RMS error of the free run over all records, in the unit of x."""
        return rms(self.residuals)

    @property
    def fit(self) -> float:
        """Free-run fit in percent; 100 is perfect."""
        runs = zip(self.free_run, self.residuals, strict=True)
        return fit_percent([free + left for free, left in runs], self.free_run)

    @property
    def axis(self) -> Axis:
        """The parameters of the surest estimate."""
        return self.surest.axis

    def simulate(self, u: npt.ArrayLike, dt: float, x: float = 0.0, v: float = 0.0) -> Array:
        """Free run of the axis.

        Parameters
        ----------
        u : array_like, shape (n,)
            Input; `limit`, `gain` and `delay` are applied.
        dt : float
            Sample time, s.
        x : float, optional
            Position at the start, unit of position.
        v : float, optional
            Speed at the start, unit of position per s.

        Returns
        -------
        ndarray, shape (n,)
            Positions.
        """
        driven = Driven(self.gain, self.limit, self.delay)
        return simulate(self.axis, driven.force(np.asarray(u, np.float64)), dt, x, v)


def drive(
    t: Any,
    u: Any,
    x: Any,
    *,
    gain: float = 1.0,
    structure: str = "auto",
    filtering: Filtering = USUAL,
    limit: float | None = None,
    delay: int | str = 0,
    eccentric: bool | None = False,
) -> DriveFit:
    """Parameters of M dv/dt = gain u - friction(v) - offset (`macromicro.identify.axis`).

    First inverse dynamics: linear regression of the force on filtered differences of the position
    (A. Janot, M. Gautier, M. Brunot, EMPS benchmark, 2019). Then output error: the parameters whose
    free simulation is nearest to x. Warns (`DataWarning`) of doubtful data.

    Parameters
    ----------
    t, u, x : array_like
        Times, s, drive voltage (or force with gain 1), and position: arrays of shape (n,), or lists
        of such arrays, one per record.
    gain : float, optional
        Force per unit of u, N/V; with gain 1 the parameters are in units of u (V s2/count, V
        s/count, V).
    structure : str, optional
        Friction, or "auto": each structure is fitted to two thirds of the blocks of the records and
        judged by the others, in turn; a richer one is chosen only if it predicts their force at
        least 2 % better, and by more than the blocks scatter.
    filtering : Filtering, optional
        Filter of the position and decimation.
    limit : float | None, optional
        Saturation of the drive: u is clipped to +-limit, with a warning.
    delay : int | str, optional
        Delay of u in samples; "fit": identified, with the fraction of a sample as the axis' `lag`.
    eccentric : bool | None, optional
        Eccentric load, x in rad: `sine` and `cosine` of the axis are identified, too. None: x in
        rad without such a load, with a warning if one shows.

    Returns
    -------
    DriveFit
        Parameters by both methods, with standard errors.

    Raises
    ------
    InputError
        An option is not accepted, or the data are unusable.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.identify import Axis, drive, simulate
    >>> t = 2e-3 * np.arange(600)
    >>> u = 2.0 * np.sign(np.sin(2.0 * np.pi * 1.7 * t)) + np.sin(2.0 * np.pi * 0.6 * t)  # V
    >>> x = simulate(Axis(mass=1.2, viscous=14.0, coulomb=3.0), 4.0 * u, dt=2e-3)  # m
    >>> found = drive(t, u, x, gain=4.0, structure="coulomb")  # 4 N/V
    >>> found.refined.values[:3].round(2)  # kg, N s/m, N
    array([ 1.2, 14. ,  3. ])
    """
    _check(gain, structure, delay)
    runs = runs_of(t, u, x)
    whole = 0 if isinstance(delay, str) else int(delay)
    driven = Driven(gain, limit, whole, bool(eccentric), filtering)
    as_sent = rows = rows_of(_parts(runs), driven)
    lag = error = 0.0
    if delay == FIT:
        lag, error = _axis_hints.lag(as_sent)
        rows = _axis_hints.lag_force(as_sent, lag)
    else:
        _axis_hints.warn_of_hints(rows, gain)
    judged = Judged(structure, {}, {})
    if structure == "auto":
        judged = _axis_hints.choose_structure(rows)
    if eccentric is None:
        _axis_hints.warned_of_load(rows, judged.structure)
    inverse = with_instruments(rows, fit_structure(rows, judged.structure))
    _axis_hints.against(inverse)
    if not plausible(inverse):
        notice(
            DataWarning,
            f"inverse dynamics gives a negative mass or friction: {inverse}; "
            "output error keeps them above zero",
        )
    records = [run._replace(u=driven.force(run.u)) for run in runs]
    kept = _moved_mass.shorten(records, inverse.axis)
    load = Load(eccentric=bool(eccentric), lag=FIT if delay == FIT else 0.0)
    model = load.model(judged.structure)
    lead = math.ceil(2.0 * lag / min(r.dt for r in kept)) + _LATER if delay == FIT else 0
    begin = _begin(model, inverse.axis._replace(lag=lag))
    missed = _held_out(kept, model, begin, lead)
    ends = _moved_mass.fit_starts(kept, model, [begin], lead)
    with warnings.catch_warnings(record=True) as doubts:
        warnings.simplefilter("always")
        fit = conclude(kept, load, judged, ends, lead, whole=records, gain=gain)
    inverse = under(rows, inverse, fit.repeats)
    if delay == FIT:
        later = _axis_hints.lag_force(as_sent, lag + error)
        other = with_instruments(later, fit_structure(later, judged.structure))
        inverse = with_lag(inverse, lag, error, other.values - inverse.values)
    refined = _refine(fit, runs)
    starts, free, residuals = fit.starts, fit.free_run, fit.residuals
    if not is_surer(inverse, refined):
        for doubt in doubts:
            warnings.warn(doubt.message, doubt.category, stacklevel=2)
    else:
        clusters.warn_of_mixture(inverse.spread, inverse.names, inverse.values)
        starts, free = _free_runs(records, model, inverse.axis, fit.starts)
        residuals = tuple(r.x - run for r, run in zip(runs, free, strict=True))
    _axis_hints.apart(inverse, refined)
    _axis_hints.warn_of_mixture(inverse.names, rows)
    _axis_hints.coarse((inverse.axis, fit.axis), runs[0].dt)
    return DriveFit(
        judged.structure,
        inverse,
        refined,
        judged.scores,
        missed,
        starts,
        free,
        residuals,
        float(gain),
        driven.delay,
        judged.reasons,
        limit,
    )


def _parts(runs: list[Run]) -> list[Run]:
    """Records for inverse dynamics: all, or evenly spread parts of long ones."""
    if not _moved_mass.is_long(runs):
        return runs
    for k, run in enumerate(runs):
        _axis_hints.jumps(run, f"record[{k}].x")
    return _moved_mass.stretches(runs)


def _begin(model: Model, axis: Axis) -> Axis:
    """Where output error begins: inverse dynamics' estimate, with no negative mass or friction."""
    values = model.values(axis)
    least = np.array([-np.inf if n in _moved_mass.SIGNED else _FLOOR for n in model.names])
    return model.axis(np.maximum(values, least * np.abs(values)))


def is_surer(inverse: Estimate, refined: Estimate) -> bool:
    """Whether inverse dynamics is surer of the parameters than output error, by their errors."""
    at = [refined.names.index(name) for name in inverse.names]
    known = np.isfinite(inverse.std) & np.isfinite(refined.std[at])
    with np.errstate(divide="ignore"):
        ratio = np.log(inverse.std[known]) - np.log(refined.std[at][known])
    return plausible(inverse) and len(ratio) > 0 and float(np.mean(ratio)) < 0.0


def _free_runs(
    records: list[Run], model: Model, axis: Axis, near: Sequence[tuple[float, float]]
) -> tuple[tuple[tuple[float, float], ...], tuple[Array, ...]]:
    starts = tuple(
        _moved_mass.initial_state(r, model, axis, at) for r, at in zip(records, near, strict=True)
    )
    free = (motion(axis, r.u, r.dt, *at)[0] for r, at in zip(records, starts, strict=True))
    return starts, tuple(free)


def _refine(fit: SprungFit, runs: list[Run]) -> Estimate:
    percent = 100.0 - fit_percent([r.x for r in runs], fit.free_run)
    return Estimate(
        fit.axis, fit.names, fit.covariance, fit.rms, percent, fit.spread.shares, fit.repeats
    )


def _check(gain: float, structure: str, delay: int | str) -> None:
    if not (np.isfinite(gain) and gain != 0.0):
        raise InputError("gain", gain, "a finite number other than zero")
    if structure != "auto" and structure not in STRUCTURES:
        raise InputError("structure", structure, ", ".join(["auto", *STRUCTURES]))
    whole = isinstance(delay, int | np.integer) and 0 <= int(delay) <= _axis_hints.LATEST
    if delay != FIT and not whole:
        accepted = f'a whole number of samples from 0 to {_axis_hints.LATEST}, or "{FIT}"'
        raise InputError("delay", delay, accepted)


def runs_of(t: Any, u: Any, x: Any) -> list[Run]:
    for name, values in (("t", t), ("u", u), ("x", x)):
        if not hasattr(values, "__len__") or len(values) == 0:
            remedy = "Give an array of numbers."
            raise ProblemError(f"drive: {name}", "the array is missing or empty", remedy)
    if np.ndim(next(iter(t))) == 0:
        return [checked(t, u, x, "record", _LEAST)]
    if not len(t) == len(u) == len(x):
        found = f"t, u and x hold {len(t)}, {len(u)} and {len(x)} arrays"
        raise ProblemError("records", found, "Give as many of each.")
    return [
        checked(*one, f"record[{i}]", _LEAST) for i, one in enumerate(zip(t, u, x, strict=True))
    ]


def rows_of(runs: list[Run], driven: Driven) -> list[Rows]:
    if all(np.ptp(r.u) == 0.0 and r.u[0] == runs[0].u[0] for r in runs):
        remedy = "Record an input that changes."
        raise ProblemError("u", f"the input is constant at {runs[0].u[0]:g}", remedy)
    # The part held out must be longer than the low-pass of the decimation, 21 factors.
    filtering = driven.filtering
    shortest = min(len(r.u) for r in runs) * (1.0 if len(runs) >= _MANY else _HELD)
    most = int(shortest) // 30
    factor = min(10, most) if filtering.decimate is None else filtering.decimate
    if not isinstance(factor, int | np.integer) or not 1 <= factor <= most:
        raise InputError("decimate", factor, f"a whole number from 1 to {most}")
    rows = []
    for i, run in enumerate(runs):
        if np.ptp(run.x) == 0.0:
            problem = f"the position is constant at {run.x[0]:g}"
            raise ProblemError(f"record[{i}].x", problem, "Record a motion.")
        _axis_hints.jumps(run, f"record[{i}].x")
        corner = CUTOFF / run.dt if filtering.cutoff is None else filtering.cutoff
        if not 0.0 < corner < 0.5 / run.dt:
            raise InputError("cutoff", corner, f"between 0 and {0.5 / run.dt:g} Hz")
        push = driven.force(flag_saturation(run.u, f"record[{i}].u", driven.limit))
        rows.append(differences(run, push, corner, int(factor), eccentric=driven.eccentric))
    return rows


def start(run: Run, gain: float, delay: int) -> tuple[float, float]:
    """Measured position and speed at the start of a record; slow motion is rest."""
    rows = differences(run, late(run.u, delay) * gain, CUTOFF / run.dt, 1)
    v = float(rows.v[0])
    moves = abs(v) > _REST * float(np.abs(rows.v).max())
    return float(run.x[0]), v if moves else 0.0


def _held_out(records: list[Run], model: Model, begin: Axis, lead: int) -> float:
    """RMS of free runs over parts of the records by a fit to the others."""
    train, test = split(records)
    if _directions(test) > _directions(train):
        blocks = [block for record in records for block in _blocks(record)]
        held = turn(np.arange(len(blocks))) == 0
        train = [block for block, out in zip(blocks, held, strict=True) if not out]
        test = [block for block, out in zip(blocks, held, strict=True) if out]
    axis = model.axis(_moved_mass.fit_starts(train, model, [begin], lead)[0].values)
    missed = [
        r.x - motion(axis, r.u, r.dt, *_moved_mass.initial_state(r, model, axis))[0] for r in test
    ]
    return rms(missed)


def split(records: list[Run]) -> tuple[list[Run], list[Run]]:
    """Records to fit and records to judge by: tails, or every third of three or more."""
    if len(records) >= _MANY:
        kept = [r for i, r in enumerate(records) if i % _MANY != _MANY - 1]
        return kept, records[_MANY - 1 :: _MANY]
    cuts = [round(len(r.x) * (1.0 - _HELD)) for r in records]
    parts = list(zip(records, cuts, strict=True))
    return [r.part(0, at) for r, at in parts], [r.part(at, None) for r, at in parts]


def _blocks(run: Run) -> list[Run]:
    count = max(min(_BLOCKS, len(run.x) // _LEAST), 1)
    ends = np.linspace(0, len(run.x), count + 1).round().astype(int)
    return [run.part(a, b) for a, b in pairwise(ends.tolist())]


def _directions(records: list[Run]) -> set[float]:
    speeds = np.concatenate([_moved_mass.locate(r, False)[1] for r in records])
    return _axis_hints.directions(speeds, _SHARE)
