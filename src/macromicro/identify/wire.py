"""Fit of shape-memory wires to recordings of their drive and contraction.

All parameters are fitted at once to free simulations, from several starting points. Here without a
kiln's table: a data sheet's median temperature of contraction sets the scale of temperatures.
`wire_table` has the fit by a table.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.hysteresis.table import FodTable
from macromicro.identify import clusters, search
from macromicro.identify.heating import AMBIENT
from macromicro.identify.notices import ConvergenceWarning, DataWarning, notice
from macromicro.identify.search import NUDGE, Bounds, best, minimum
from macromicro.identify.wire_model import Wire, hysteresis, median_at, relays, simulate
from macromicro.models.heating import Ladder
from macromicro.models.stressed import Stressed

Index = npt.NDArray[np.int64]
AUSTENITE = 80.0  # deg C: half contracted while it warms, without load (NiTi of 70 to 90 deg C)
BLOCKS = 40  # parts of all records that errors are judged by
ROUNDS = 40  # of the last search

_HELD, _NODES = 12, 7  # levels of the drive up to which each has its heat; else nodes of the map
_POINTS = 600  # of a record that are compared
_FINEST = 5000  # steps of a record
_LAW_ROUNDS, _KEPT = 5, 3  # of searches with heats by a power law, and how many go on
_WARM = (80.0, 140.0, 250.0, 450.0)  # K of final warming by the greatest drive: searches begin
_WIRE = (0.3, 1.0, 4.0)  # s: time constant of the wire, likewise
_LOOSE, _PULL = 2.0, 0.1  # of a heat's logarithm: most off the power law; what that costs
_OFF = 0.3  # of the same: by how much heats are off it


class WireFit(NamedTuple):
    model: Wire
    table: FodTable  # relays over temperature: as given, or as fitted
    values: dict[str, float]  # by name, heats as "heat 1.5 V" or "heat 1.5" (K)
    std: dict[str, float]  # standard errors, likewise; NaN of a parameter at its bound
    rms: float  # over the samples fitted to, mm
    iterations: int  # of the last search


class Parameter(NamedTuple):
    name: str
    begin: float
    low: float
    high: float
    log: bool = False  # searched in its logarithm
    nudge: float = 0.0  # step for slopes, in NUDGE; 0: by the value

    def searched(self, value: float) -> float:
        return math.log(value) if self.log else value


def bounds_of(parameters: Sequence[Parameter]) -> Bounds:
    rows = [(p.searched(p.low), p.searched(p.high), NUDGE * p.nudge) for p in parameters]
    return Bounds(*np.array(rows).T)


def search_values(parameters: Sequence[Parameter], values: Mapping[str, float]) -> Array:
    """Search values of these, the others where they begin."""
    return np.array([p.searched(values.get(p.name, p.begin)) for p in parameters])


def by_parameter(parameters: Sequence[Parameter], z: Array) -> dict[str, float]:
    pairs = zip(parameters, z, strict=True)
    return {p.name: math.exp(v) if p.log else float(v) for p, v in pairs}


def errors(
    parameters: Sequence[Parameter],
    end: Any,
    values: Callable[[Array], dict[str, float]],
    edges: npt.ArrayLike,
    within: Array | None = None,
) -> dict[str, float]:
    """Standard errors by clusters of the residuals; none of a parameter at its bound."""
    bounds = bounds_of(parameters)
    names = list(values(end.x))
    turn = search.slopes(lambda z: np.array(list(values(z).values())), end.x, bounds)
    covariance = clusters.spread(end.jac, end.fun, edges).covariance
    found = dict(zip(names, clusters.errors(covariance, turn).tolist(), strict=True))
    low, high = search.at_bounds(end.x, bounds, within)
    said = []
    for p, below, above in zip(parameters, low, high, strict=True):
        if below or above:
            said.append(f"{p.name} {'at least' if below else 'at most'} {p[2 if below else 3]:.4g}")
            found |= {p.name: math.nan} if p.name in found else {}
    if said:
        notice(
            DataWarning,
            f"actuator: {', '.join(said)}, a bound of the search; the records do not determine "
            "it, or need another model, and it has no standard error",
        )
    return found


class Heated(NamedTuple):
    u: Array  # drive, held for `dt` each
    x: Array  # contraction, mm
    dt: float  # sample time, s


SCALARS = (
    Parameter("wire", 1.0, 0.02, 60.0, True),
    Parameter("r1", 0.75, 0.1, 0.97),
    Parameter("plates", 30.0, 0.5, 3000.0, True),
    Parameter("r2", 0.2, 0.01, 0.6),
    Parameter("body", 600.0, 5.0, 1e5, True),
    Parameter("latent", 15.0, 0.0, 300.0),
    Parameter("stiffening", 1.0, 0.0, 60.0),
    Parameter("expansion", 0.0, -0.2, 0.2),
    Parameter("rise spread", 4.0, 0.3, 40.0, True),
    Parameter("rise skew", 1.0, 0.1, 10.0, True),
    Parameter("hysteresis", 20.0, 1.0, 60.0, True),
    Parameter("fall spread", 4.0, 0.3, 40.0, True),
    Parameter("fall skew", 1.0, 0.1, 10.0, True),
    Parameter("low", 0.0, -0.2, 0.2),
    Parameter("stroke", 1.0, 0.8, 2.5),
    Parameter("resistance", 0.0, -0.4, 0.4),
    Parameter("growth", 0.0, -0.3, 1.0),
    # Heat of the greatest drive, K, and the power of the drive with which it falls below.
    Parameter("warm", 140.0, 1.0, 3000.0, True),
    Parameter("power", 2.0, 0.3, 15.0, True),
)


class _Grid(NamedTuple):
    """A record on the model's grid; `at`: points compared with `x`."""

    u: Array
    dt: float
    at: Index
    x: Array


class _Scale(NamedTuple):
    volts: Array
    ambient: float
    austenite: float
    stroke: float
    cold: float

    @property
    def parameters(self) -> list[Parameter]:
        """The scalars, then logarithms of heats over a power law of the drive."""
        heats = (f"heat {v:.4g}" for v in self.volts[1:])
        return [*SCALARS, *(Parameter(name, 0.0, -_LOOSE, _LOOSE) for name in heats)]


def without_table(
    records: Sequence[Heated], ambient: float = AMBIENT, austenite: float = AUSTENITE
) -> WireFit:
    """The actuator with the nearest free simulations; `ambient`, `austenite` in deg C."""
    # Searches begin at several warmings and time constants with heat as the square of the drive;
    # the best continue with a heat for each level.
    if not austenite > ambient:
        raise InputError("austenite", austenite, f"above the room's {ambient:g} deg C")
    if not records:
        raise ProblemError("records", "there is no record", "Give one or more, each from cold.")
    every = np.concatenate([r.x for r in records])
    extent = float(np.ptp(every))
    drives = np.concatenate([r.u for r in records])
    if not (extent > 0.0 and float(drives.max()) > 0.0):
        found = "the drive is never above 0" if extent > 0.0 else "the position is constant"
        remedy = "Record a drive that contracts the wires and lets them cool."
        raise ProblemError("records", found, remedy)
    cold = float(np.median([r.x[0] for r in records]))
    scale = _Scale(_nodes(drives), ambient, austenite, extent, cold)
    grids = [_grid(r) for r in records]
    end = _search(scale, grids)
    if end.status == 0:
        notice(ConvergenceWarning, "actuator: search stopped before it settled")
    wire, table, values = _wire(scale, end.x)
    # Stretches of the records, then each heat's pull by what heats are usually off the law.
    count = len(scale.volts) - 1
    seen = len(end.fun) - count
    rms = extent * float(np.sqrt(np.mean(end.fun[:seen] ** 2)))
    end.fun[seen:] = _PULL * _OFF
    parts = np.linspace(0, seen, max(BLOCKS, 2 * len(values)) + 1)[:-1]
    edges = np.concatenate([np.unique(parts.astype(int)), seen + np.arange(count + 1)])
    std = errors(scale.parameters, end, lambda z: _wire(scale, z)[2], edges)
    return WireFit(wire, table, values, std, rms, int(end.nfev))


def _nodes(drives: Array) -> Array:
    """Points of the heat map: 0 and every held level, or some of many."""
    levels = np.unique(drives[drives > 0.0])
    if len(levels) > _HELD:
        levels = np.unique(np.quantile(levels, np.linspace(0.0, 1.0, _NODES)))
    return np.concatenate([[0.0], levels])


def _grid(r: Heated) -> _Grid:
    """Means of the drive over blocks, and positions at some of their starts."""
    many = max(len(r.u) // _FINEST, 1)
    n = len(r.u) // many
    u = r.u[: n * many].reshape(n, many).mean(axis=1)
    x = r.x[: n * many : many]
    # Most points where something moves: half of them evenly in time, half along the way.
    way = np.r_[0.0, np.cumsum(np.abs(np.diff(_smooth(x, n // 200 + 1))))]
    share = 0.5 * np.arange(n) / max(n - 1, 1) + 0.5 * way / max(float(way[-1]), 1e-12)
    marks = np.linspace(share[0], share[-1], _POINTS)
    at = np.unique(np.clip(np.searchsorted(share, marks), 1, n - 1)).astype(np.int64)
    return _Grid(np.ascontiguousarray(u), many * r.dt, at, x[at])


def _smooth(x: Array, many: int) -> Array:
    return np.convolve(np.pad(x, many // 2, mode="edge"), np.ones(many) / many, "valid")[: len(x)]


def _wire(known: _Scale, z: Array) -> tuple[Wire, FodTable, dict[str, float]]:
    """Wires, table and named values for search values."""
    own = by_parameter(known.parameters, z)
    names = [p.name for p in known.parameters[len(SCALARS) :]]
    law = own.pop("warm") * (known.volts[1:] / known.volts[-1]) ** own.pop("power")
    heats = np.concatenate([[0.0], law * np.exp([own[n] for n in names])])
    own |= dict(zip(names, heats[1:].tolist(), strict=True))
    stroke = own["stroke"] * known.stroke
    low = known.cold + own["low"] * known.stroke
    up = median_at(known.austenite, own["rise spread"], own["rise skew"])
    down = median_at(known.austenite - own["hysteresis"], own["fall spread"], own["fall skew"])
    table = relays(up, down, low, stroke)
    r1, r2 = own["r1"], own["r2"]
    r2 = min(r2, 0.999 - r1)
    ladder = Ladder(own["wire"] / r1, r1, own["plates"] / r2, r2, own["body"], 1.0 - r1 - r2)
    wires = Stressed(
        known.volts, heats, 0.0, ladder, own["latent"], 0.0, own["stiffening"] / known.stroke,
        math.inf, math.inf, known.ambient, hysteresis(table),
    )  # fmt: skip
    warming = known.austenite - known.ambient
    expansion = own["expansion"] * known.stroke / warming
    return Wire(wires, expansion, own["resistance"], own["growth"] / warming), table, own


def _errors(known: _Scale, grids: Sequence[_Grid], z: Array) -> Array:
    """Simulated less measured, relative to the range."""
    model = _wire(known, z)[0]
    return np.concatenate([(simulate(model, g.u, g.dt)[g.at] - g.x) / known.stroke for g in grids])


def _errors_with_priors(known: _Scale, grids: Sequence[_Grid], z: Array) -> Array:
    """`_missed` with weak priors of each heat at a power law, for levels without effect."""
    return np.concatenate([_errors(known, grids, z), _PULL * z[len(SCALARS) :]])


def _search(known: _Scale, grids: Sequence[_Grid]) -> Any:
    """The best of several searches: first by the power law, then with all heats."""
    bounds, free = bounds_of(known.parameters), np.zeros(len(known.volts) - 1)
    rough = [g._replace(at=g.at[::4], x=g.x[::4]) for g in grids]

    def by_law(z: Array) -> Array:
        return _errors(known, rough, np.concatenate([z, free]))

    def by_all(z: Array) -> Array:
        return _errors_with_priors(known, grids, z)

    begins = [search_values(SCALARS, {"warm": w, "wire": q}) for w, q in product(_WARM, _WIRE)]
    ends = best(by_law, begins, bounds_of(SCALARS), _LAW_ROUNDS, _KEPT)
    (begin,) = best(by_all, [np.concatenate([z, free]) for z in ends], bounds, ROUNDS, 1)
    return minimum(by_all, begin, bounds, ROUNDS)
