"""Output-error search for a sprung drive from several starting points."""

# From the first part of each record to the whole: the longer an oscillation is compared, the better
# its frequency must be known.

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import ProblemError
from macromicro.identify import _sprung_start
from macromicro.identify.runs import Run
from macromicro.identify.search import least_squares
from macromicro.identify.sprung import Sprung, simulate

FRICTIONS: dict[str, tuple[str, ...]] = {
    "viscous": ("viscous",),
    "coulomb": ("viscous", "coulomb"),
    "asymmetric": ("viscous", "coulomb", "asymmetry"),
}
SIGNED = ("offset", "asymmetry")
_ABOVE = ("mass", "spring")  # never 0
_PARTS = (0.15, 0.4, 1.0)  # of each record, one after the other
_WHOLE = (1.0,)
_NUDGE = 1e-4  # of a parameter: over which slopes are taken
_LEAST = 1e-4  # of a parameter's usual size: none
_CUTS = 3
_TAIL = 0.05  # of a motion without a spring


class Model(NamedTuple):
    friction: str  # A key of `FRICTIONS`
    spring: bool
    dead_zone: bool  # of the drive
    driven: bool  # without a drive parameters are per mass
    speed: bool  # the output is the speed

    @property
    def names(self) -> tuple[str, ...]:
        names = ("mass",) * self.driven + FRICTIONS[self.friction]
        # The place of a spring's rest does not show in speeds.
        names += ("offset",) * (not (self.spring and self.speed))
        return names + ("spring",) * self.spring + ("dead_zone",) * self.dead_zone


def first(run: Run, samples: int) -> Run:
    n = max(samples, 20)
    return Run(run.t[:n], run.u[:n], run.x[:n])


class End(NamedTuple):
    axis: Sprung  # parameters
    starts: Array  # position and speed at the start of each record
    residual: Array  # measured less free run, records stacked
    slopes: Array  # by the free parameters and the initial states
    settled: bool  # converged

    @property
    def rms(self) -> float:
        return float(np.sqrt(np.mean(self.residual**2)))


def searched(records: list[Run], model: Model, lag: float) -> list[End]:
    """Ends of the searches from all starting points."""
    begins = _sprung_start.begins(records, model.names, model.driven, model.speed)
    ends = []
    # Where a force disturbs the motion, a short part may tell next to nothing: also the whole.
    for begin, parts in [(b, _PARTS) for b in begins] + [(begins[0], _WHOLE)]:
        at = begin
        for part in parts:
            end = _descended([first(r, int(part * len(r.t))) for r in records], model, lag, *at)
            at = end.axis, end.starts
        if np.isfinite(end.rms):
            ends.append(end)
    if not ends:
        raise ProblemError(
            "record", "no search converged", "Record a motion that the model can follow."
        )
    return sorted(ends, key=lambda e: e.rms)


def _descended(records: list[Run], model: Model, lag: float, axis: Sprung, starts: Array) -> End:
    """The minimum next to a starting point."""
    names = model.names
    count, many = len(names), len(records)
    sizes = _sprung_start.sizes(records, axis, names, model.speed)
    own = np.concatenate([r.x for r in records])
    extent = float(np.std(own)) or 1.0
    # Without a spring the place does not show in speeds.
    placed = not (model.speed and not model.spring)
    at = np.array(_sprung_start.scales(records, model.speed, extent))
    low = np.full(count + 2 * many, -np.inf)
    low[:count] = [-np.inf if n in SIGNED else 0.0 for n in names]
    for k, n in enumerate(names):
        if n in _ABOVE:
            low[k] = 1e-6
    first = np.array([getattr(axis, n) for n in names]) / sizes
    begin = np.concatenate([first, (starts / at).ravel()])
    begin = np.maximum(begin, low + 1e-9 * (low > -np.inf))

    def parts(values: Array) -> tuple[Sprung, Array]:
        free = dict(zip(names, (values[:count] * sizes).tolist(), strict=True))
        return Sprung(**({"mass": 1.0} | free)), values[count:].reshape(many, 2) * at

    def run(values: Array, k: int) -> Array:
        p, begun = parts(values)
        r = records[k]
        x, v = begun[k]
        return simulate(p, r.u, r.dt, float(x), float(v), lag)[int(model.speed)]

    def missed(values: Array) -> Array:
        runs = [run(values, k) for k in range(many)]
        error = np.concatenate([r.x - y for r, y in zip(records, runs, strict=True)]) / extent
        return np.nan_to_num(error, nan=1e6, posinf=1e6, neginf=-1e6)

    def slopes(values: Array) -> Array:
        rows = np.cumsum([0, *(len(r.x) for r in records)])
        table = np.zeros((rows[-1], len(values)))
        for j in range(len(values)):
            nudge = _NUDGE * max(abs(values[j]), 1e-2)
            up, down = values.copy(), values.copy()
            up[j] += nudge
            down[j] = max(values[j] - nudge, low[j])
            which = range(many) if j < count else [(j - count) // 2]
            if j >= count and not placed and (j - count) % 2 == 0:
                continue
            for k in which:
                change = run(down, k) - run(up, k)
                table[rows[k] : rows[k + 1], j] = change / (up[j] - down[j])
        return table / extent

    found = least_squares(
        missed, begin, slopes, bounds=(low, np.inf), xtol=1e-10, ftol=1e-10, max_nfev=60
    )
    # A search within bounds ends next to one, never on it.
    ended = (found.x[:count] < _LEAST) & (low[:count] == 0.0)
    p, begun = parts(np.concatenate([np.where(ended, 0.0, found.x[:count]), found.x[count:]]))
    back = np.concatenate([sizes, np.tile(at, many)])
    return End(p, begun, found.fun * extent, found.jac * extent / back, found.status != 0)


def judged(records: list[Run], cut: list[Run], end: End, model: Model, lag: float) -> float:
    errors = []
    for r, c, (x, v) in zip(records, cut, end.starts, strict=True):
        run = simulate(end.axis, r.u, r.dt, float(x), float(v), lag)[int(model.speed)]
        errors.append((r.x - run)[len(c.x) :])
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))


def moving(records: list[Run], model: Model, lag: float) -> tuple[list[Run], End]:
    """Free motions up to shortly before their end, and the fit to them."""
    # Where friction stops the mass is chance within a band, and fitting it would bias the model; so
    # the last swing, or twentieth part, is left out as well.
    for _ in range(_CUTS):
        end = searched(records, model, lag)[0]
        kept = [
            first(r, _moves(end.axis, r, x, v))
            for r, (x, v) in zip(records, end.starts.tolist(), strict=True)
        ]
        same = all(len(k.x) == len(r.x) for k, r in zip(kept, records, strict=True))
        records = kept
        if same:
            return records, end
    return records, searched(records, model, lag)[0]


def _moves(axis: Sprung, r: Run, x: float, v: float) -> int:
    """Samples of a record until shortly before the model comes to rest."""
    moved = np.flatnonzero(simulate(axis, r.u, r.dt, x, v)[1])
    n = len(r.x)
    last = int(moved[-1]) + 1 if len(moved) else n
    if last == n:
        return n
    swing = 1.0 / (axis.frequency * r.dt) if axis.frequency > 0.0 else _TAIL * last
    return max(last - int(swing), 1)
