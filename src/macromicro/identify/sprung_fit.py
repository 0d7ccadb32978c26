"""Output error of a drive with a spring, dead zone, load or measured speed, or of a decay."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.identify import _moved_mass, clusters
from macromicro.identify._disturbances import Ripple
from macromicro.identify._moved_mass import CORNER, Model, locate
from macromicro.identify.axis_inverse import ECCENTRIC, STRUCTURES, TERMS, differences
from macromicro.identify.clusters import Spread
from macromicro.identify.engine import Fit, Judged, held_out, simplest
from macromicro.identify.notices import DataWarning, notice
from macromicro.identify.records import flag_saturation, rms
from macromicro.identify.runs import Run
from macromicro.models.mass import Axis, late, motion

FIT = "fit"  # in place of a lag: found with the parameters
_AUTO = ("viscous", "coulomb", "asymmetric")  # tried where no friction is asked for
_NONSENSE = 0.1  # misfit beyond which parameters do not describe the record
_BACK = 0.05  # of a record's travel: more is a motion that turns
_SAME = 1e-3  # of the least error: searches that end so near are at one minimum
_CUTS = 3  # rounds in which the end of a free motion is looked for
_TAIL = 0.05  # of a motion without a spring that is left out before its end
_FEW = 8.0  # samples in one period, at least
_LATEST = 60  # samples by which a force may act late
_BEGINNING = 0.1  # of a record: where its start is looked for


class Load(NamedTuple):
    """The mass, its drive and its output, apart from friction."""

    driven: bool = True  # without a drive parameters are per mass
    speed: bool = False  # the output is the speed
    spring: bool = False
    dead_zone: bool = False  # of the drive
    eccentric: bool = False  # gravity on a rotating load
    limit: float | None = None  # the drive's greatest force
    lag: float | str = 0.0  # s by which the force acts late, or "fit"

    def model(self, friction: str) -> Model:
        # The place of a spring's rest does not show in speeds.
        unseen = ("mass",) * (not self.driven) + ("offset",) * (self.spring and self.speed)
        names = tuple(n for n in STRUCTURES[friction] if n not in unseen)
        names += ("spring",) * self.spring + ("dead_zone",) * self.dead_zone
        names += ECCENTRIC * self.eccentric + ("lag",) * (self.lag == FIT)
        limit = math.inf if self.limit is None else self.limit
        late = 0.0 if isinstance(self.lag, str) else self.lag
        return Model(names, Axis(1.0, 0.0, lag=late, limit=limit, back=0.0), self.speed)


@dataclass(frozen=True)
class SprungFit:
    friction: str  # the chosen one of `STRUCTURES`
    load: Load
    axis: Axis  # parameters; of a free motion per mass, whose `mass` is 1
    names: tuple[str, ...]  # the free ones
    spread: Spread
    # position and speed at the start of each record, found with the parameters
    starts: tuple[tuple[float, float], ...]
    free_run: tuple[Array, ...]  # the output by the model, an array per record
    residuals: tuple[Array, ...]  # measured less free run
    # RMS of each friction over pieces held out, by a fit to the others; empty where one was asked
    holdout: dict[str, float]
    reasons: dict[str, str]  # why each other friction was not chosen, in words
    ends: tuple[float, ...]  # RMS where each search ended, least first
    gain: float  # force per unit of u
    # A force that repeats along the way and is not in the model, where the residuals show one
    repeats: Ripple | None = None

    @property
    def covariance(self) -> Array:
        return self.spread.covariance

    @property
    def values(self) -> Array:
        return np.array([getattr(self.axis, name) for name in self.names])

    @property
    def std(self) -> Array:
        return np.sqrt(np.diag(self.covariance))

    @property
    def rms(self) -> float:
        return rms(self.residuals)

    @property
    def factors(self) -> Array:
        """Coverage factors, shape (2, p)."""
        return self.spread.factors()

    def derived(self, of: str) -> tuple[float, float, Array]:
        """A property of `Axis` with its error and coverage factors, by its slopes."""
        value = float(getattr(self.axis, of))
        slopes = np.zeros((1, len(self.names)))
        for k, name in enumerate(self.names):
            at = float(getattr(self.axis, name))
            h = 1e-6 * max(abs(at), 1e-12)
            slopes[0, k] = (getattr(self.axis._replace(**{name: at + h}), of) - value) / h
        return value, *self.combined(slopes)

    def combined(self, slopes: Array) -> tuple[float, Array]:
        """Error and coverage factors of a function of the parameters, by its slopes (1, p)."""
        error = float(clusters.errors(self.covariance, slopes)[0])
        return error, self.spread.factors(slopes)[:, 0]

    def simulate(self, u: Any, dt: float, x: float = 0.0, v: float = 0.0) -> Array:
        push = self.gain * np.asarray(u, np.float64)
        return np.asarray(motion(self.axis, push, dt, x, v)[int(self.load.speed)])


def sprung_drive(  # noqa: PLR0913 -- one parameter per option
    records: Sequence[Run],
    *,
    driven: bool = True,
    speed: bool = False,
    spring: bool = False,
    dead_zone: bool = False,
    eccentric: bool = False,
    friction: str = "auto",
    gain: float = 1.0,
    limit: float | None = None,
    lag: float | str = 0.0,
) -> SprungFit:
    """Parameters of the mass of `macromicro.models.mass` under the force gain u."""
    # Initial states are fitted; a free motion is fitted only until it is over.
    if friction != "auto" and friction not in STRUCTURES:
        raise InputError("structure", friction, f"auto or one of {', '.join(STRUCTURES)}")
    if dead_zone and not driven:
        raise ProblemError("dead zone", "there is no column u", "Give the input of the drive.")
    if not spring and not speed and not driven and _turns(records):
        remedy = "Add --spring, or a column u of a drive."
        raise ProblemError("record", "the free motion turns back", remedy)
    most = None if limit is None else abs(gain) * limit
    load = Load(driven, speed, spring, dead_zone, eccentric, most, lag)
    whole = [r._replace(u=np.zeros_like(r.x)) for r in records]
    if driven:
        for k, r in enumerate(records):
            flag_saturation(r.u, f"record[{k}].u", limit)  # the axis itself limits the force
        whole = [r._replace(u=gain * r.u) for r in records]
    names = list(_AUTO) if friction == "auto" else [friction]
    holding = [n for n in names if n != "viscous"]
    kept = whole
    if not driven and holding:
        # Where friction stops the mass is chance within a band, so the motion alone is better
        # evidence, unless it is too short to show what stops it.
        short, axis = moving(whole, load.model(holding[0]))
        enough = sum(len(r.x) for r in short) >= _moved_mass.FEWEST
        if enough and _misses(whole, axis, speed) < _NONSENSE:
            kept = short
    judged = Judged(names[0], {}, {})
    lead = _LATEST if lag == FIT else _lead(records, lag)
    every: dict[str, list[Fit]] = {}
    poorer: Axis | None = None
    for name in names:
        model = load.model(name)
        every[name] = _ends(kept, model, lead, poorer)
        poorer = model.axis(every[name][0].values)
    if len(names) > 1:
        squares = {
            name: held_out(
                load.model(name).simulated, ends[0].space, ends[0].pieces, ends[0].values
            )
            for name, ends in every.items()
        }
        judged = simplest(squares)
    ends = every[judged.structure]
    return conclude(kept, load, judged, ends, lead, whole=whole, gain=gain)


def conclude(
    records: Sequence[Run],
    load: Load,
    judged: Judged,
    ends: Sequence[Fit],
    lead: int,
    *,
    whole: Sequence[Run],
    gain: float,
) -> SprungFit:
    """The result of searches over `records`, with free runs over the whole ones."""
    model = load.model(judged.structure)
    found = _moved_mass.floor_errors(_moved_mass.surest(records, model, ends[0], lead), records)
    axis = model.axis(found.fit.values)
    repeats = None
    if not load.speed:
        repeats = _moved_mass.find_ripple(found.fit, model.simulated, axis)
    if repeats is not None:
        found = _moved_mass.under(found, model.simulated, repeats)
    _moved_mass.warn_of_unseen(found, model.names)
    _coarse(records, axis)
    near: Sequence[tuple[float, float] | None] = [None] * len(whole)
    if len(whole) == len(records):
        near = _moved_mass.beginnings(found, records)
    starts = tuple(
        _moved_mass.initial_state(r, model, axis, at) for r, at in zip(whole, near, strict=True)
    )
    free = tuple(
        motion(axis, r.u, r.dt, x, v)[int(load.speed)]
        for r, (x, v) in zip(whole, starts, strict=True)
    )
    return SprungFit(
        judged.structure,
        load,
        axis,
        model.names,
        found.spread,
        starts,
        free,
        tuple(r.x - run for r, run in zip(whole, free, strict=True)),
        judged.scores,
        judged.reasons,
        tuple(end.rms for end in ends),
        gain,
        repeats,
    )


def moving(records: Sequence[Run], model: Model) -> tuple[list[Run], Axis]:
    """Free motions up to shortly before their end, and the axis fitted to them."""
    # Where friction stops the mass is chance within a band, and fitting it would bias the model; so
    # the last swing, or twentieth part, is left out as well.
    kept = list(records)
    for _ in range(_CUTS):
        axis = model.axis(_ends(kept, model, 0)[0].values)
        cut = [r.part(0, max(_moves(axis, r, model), 20)) for r in kept]
        same = all(len(c.x) == len(r.x) for c, r in zip(cut, kept, strict=True))
        kept = cut
        if same:
            break
    return kept, axis


def _ends(records: Sequence[Run], model: Model, lead: int, poorer: Axis | None = None) -> list[Fit]:
    starts = begins(records, model)
    if poorer is not None:  # a simpler friction is next to the richer one
        starts = [poorer, starts[0]]
    ends = _moved_mass.fit_starts(records, model, starts, lead)
    if not ends:
        remedy = "Record a motion that the model can follow."
        raise ProblemError("record", "no search converged", remedy)
    return ends


def _lead(records: Sequence[Run], lag: float | str) -> int:
    return 0 if isinstance(lag, str) else math.ceil(lag / min(r.dt for r in records))


def _moves(axis: Axis, run: Run, model: Model) -> int:
    """Samples of a record until shortly before the model comes to rest."""
    x, v = _moved_mass.initial_state(run, model, axis)
    moved = np.flatnonzero(motion(axis, run.u, run.dt, x, v)[1])
    n = len(run.x)
    last = int(moved[-1]) + 1 if len(moved) else n
    if last == n:
        return n
    swing = 1.0 / (axis.frequency * run.dt) if axis.frequency > 0.0 else _TAIL * last
    return max(last - int(swing), 1)


def _misses(records: Sequence[Run], axis: Axis, speed: bool) -> float:
    """RMS misfit of free simulations, by the scatter of the records."""
    model = Model((), axis, speed)
    missed = [
        motion(axis, r.u, r.dt, *_moved_mass.initial_state(r, model, axis))[int(speed)] - r.x
        for r in records
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


def _coarse(records: Sequence[Run], axis: Axis) -> None:
    """Warn of a sample time too long for the oscillation."""
    dt = max(r.dt for r in records)
    if axis.frequency * dt * _FEW > 1.0:
        notice(
            DataWarning,
            f"{1.0 / (axis.frequency * dt):.3g} samples in a period of {axis.frequency:.4g} Hz: a "
            "slower oscillation may fit as well; sample faster",
        )


def same(ends: Sequence[float]) -> int:
    return sum(e <= ends[0] * (1.0 + _SAME) for e in ends)


def initial_state(fit: SprungFit, run: Run) -> tuple[float, float]:
    """Initial state with the nearest free simulation over the first part."""
    many = int(_BEGINNING * len(run.t))
    if fit.axis.spring > 0.0:
        many = int(1.0 / (fit.axis.frequency * run.dt))
    part = run.part(0, min(max(many, 20), len(run.t)))
    pushed = part._replace(u=fit.gain * part.u)
    return _moved_mass.initial_state(pushed, fit.load.model(fit.friction), fit.axis)


_ZONES = np.linspace(0.0, 0.7, 15)  # dead zones tried, parts of the largest force
_LAGS = (0, 1, 2, 3, 5, 8, 12, 18, 27, 40, 60)  # delays tried, samples
_FADES = (0.01, 0.02, 0.04, 0.08, 0.15, 0.3)  # Stribeck speeds tried, parts of the top speed
_STILL = 0.02  # of the top speed
_PADDED = 8  # times the record's length: the spectrum's grid
_NO_COLUMN = ("dead_zone", "lag", "stribeck_speed")
_USUAL = 0.08  # Stribeck speed of a first fit, part of the top speed


class _Table(NamedTuple):
    columns: Array  # what a unit of each parameter adds to the force
    force: Array
    place: Array
    record: Array  # number of each row's record


def begins(records: Sequence[Run], model: Model) -> list[Axis]:
    """Starting points, the likeliest first."""
    check(records, model)
    first = _first(records, model)
    found = [first]
    if "spring" in model.names:
        tone = max((_tone(r) for r in records), key=lambda one: one[1])[0]
        found.append(first._replace(spring=first.mass * (2.0 * math.pi * tone) ** 2))
    elif "mass" in model.names:
        found.append(first._replace(mass=2.0 * first.mass, viscous=0.0))
    if "stribeck" in model.names:
        top = max(float(np.abs(locate(r, model.speed)[1]).max()) for r in records)
        late_records = [r._replace(u=late(r.u, first.lag / r.dt)) for r in records]
        tried = [_regress(_table(late_records, model, part * top), model) for part in _FADES]
        likely = sorted(zip([error for error, _ in tried], range(len(tried)), strict=True))[:2]
        found = [
            tried[k][1]._replace(stribeck_speed=_FADES[k] * top, lag=first.lag) for _, k in likely
        ]
    return found


def check(records: Sequence[Run], model: Model) -> None:
    driven = "mass" in model.names
    for k, r in enumerate(records):
        if np.ptp(r.x) == 0.0:
            remedy = "Record a motion."
            raise ProblemError(f"record[{k}]", f"the output is constant at {r.x[0]:g}", remedy)
        if driven and np.ptp(r.u) == 0.0 and r.u[0] == 0.0 and len(records) == 1:
            remedy = "Record an input, or omit the column u."
            raise ProblemError(f"record[{k}].u", "the input is 0 throughout", remedy)


def _first(records: Sequence[Run], model: Model) -> Axis:
    """Least squares for the force, at the delay and dead zone that leave least."""
    best: tuple[float, Axis] | None = None
    for lag in _LAGS if "lag" in model.names else (0,):
        pushed = [r._replace(u=late(r.u, lag)) for r in records]
        error, axis = _regress(_table(pushed, model), model)
        if best is None or error < best[0]:
            best = error, axis._replace(lag=lag * records[0].dt if lag else axis.lag)
    assert best is not None
    return best[1]


def _table(records: Sequence[Run], model: Model, fades: float | None = None) -> _Table:
    parts, limit = [], model.fixed.limit
    for number, r in enumerate(records):
        place, _ = locate(r, model.speed)
        rows = differences(r._replace(x=place), r.u, CORNER / r.dt, 1)
        moves = np.abs(rows.v) > _STILL * np.abs(rows.v).max()
        speed = fades or _USUAL * float(np.abs(rows.v).max())
        columns = [TERMS[n](rows, speed) for n in model.names if n not in _NO_COLUMN]
        force = np.clip(r.u, -limit, limit) if "mass" in model.names else -rows.a
        table = np.stack(columns, axis=1)[moves]
        record = np.full(moves.sum(), number)
        parts.append(_Table(table, force[moves], place[moves], record))
    whole = _Table(*(np.concatenate(each) for each in zip(*parts, strict=True)))
    if "spring" in model.names and "offset" not in model.names:
        # Of speeds the place is known but for a constant, each record its own.
        own = np.equal.outer(whole.record, np.arange(len(records))).astype(np.float64)
        whole = whole._replace(columns=np.hstack([whole.columns, own]))
    return whole


def _regress(table: _Table, model: Model) -> tuple[float, Axis]:
    """Error of the force, as part of it, and the parameters."""
    names = [n for n in model.names if n not in _NO_COLUMN]
    size = np.linalg.norm(table.columns, axis=0)
    even = table.columns / np.where(size > 0.0, size, 1.0)
    top = float(np.abs(table.force).max())
    best: tuple[float, Array, float] | None = None
    for zone in _ZONES * top if "dead_zone" in model.names else (0.0,):
        force = np.sign(table.force) * np.maximum(np.abs(table.force) - zone, 0.0)
        theta = np.linalg.lstsq(even, force, rcond=None)[0]
        error = float(np.mean((force - even @ theta) ** 2)) / max(float(np.var(force)), 1e-300)
        if best is None or error < best[0]:
            best = error, theta / np.where(size > 0.0, size, 1.0), float(zone)
    assert best is not None
    error, theta, zone = best
    found = dict(zip(names, theta.tolist(), strict=False))
    for name in ("mass", "viscous", "coulomb", "stribeck", "spring"):
        if name in found:
            found[name] = max(found[name], 1e-6 if name == "mass" else 0.0)
    if found.get("spring") == 0.0:
        reach = max(float(np.abs(table.place).max()), 1e-300)
        found["spring"] = 1e-3 * top / reach
    if "dead_zone" in model.names:
        found["dead_zone"] = max(zone, 0.02 * top)
    return error, model.fixed._replace(**found)


def _tone(run: Run) -> tuple[float, float]:
    """Frequency of the highest spectral peak of the output, Hz, and its size."""
    y = run.x - np.mean(run.x)
    size = np.abs(np.fft.rfft(y * np.hanning(len(y)), _PADDED * len(y)))
    size[: _PADDED // 2] = 0.0
    k = int(size.argmax())
    return k / (_PADDED * len(y) * run.dt), float(size[k]) / max(float(size.sum()), 1e-300)
