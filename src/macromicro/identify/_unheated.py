"""An actuator from drive and position alone: no kiln, no thermometer, no table."""

# All parameters are fitted at once to free simulations. The temperature scale is not observable: it
# is set by a data sheet's median temperature of contraction without load (`AUSTENITE`).

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.hysteresis.table import FodTable
from macromicro.identify import clusters
from macromicro.identify._free_run_search import Span, ended, nearest, search, slopes
from macromicro.identify._transformation import Branch, quantile, relays
from macromicro.identify.heating import AMBIENT
from macromicro.identify.notices import ConvergenceWarning, DataWarning, notice
from macromicro.identify.stressed import hysteresis
from macromicro.kernel import compiled, kernel
from macromicro.models import stressed
from macromicro.models.heating import Ladder
from macromicro.models.stressed import Stressed

AUSTENITE = 80.0  # deg C: half contracted while it warms, without load (NiTi of 70 to 90 deg C)
_HELD, _NODES = 12, 7  # levels of the drive up to which each has its heat; else nodes of the map
_POINTS = 600  # of a record that are compared
_FINEST = 5000  # steps of a record
_PART = 0.15  # of the wire's time constant: the longest step
_FEW, _BEST, _ROUNDS = 5, 3, 40  # rounds of every search, how many go on, their rounds
_BLOCKS = 40  # stretches of all records that tell the errors
_WARM = (80.0, 140.0, 250.0, 450.0)  # K of final warming by the greatest drive: searches begin
_QUICK = (0.3, 1.0, 4.0)  # s: time constant of the wire, likewise
# Name, begin, least, greatest; those marked are searched in their logarithm.
_SCALARS = (
    ("wire", 1.0, 0.02, 60.0, True),
    ("r1", 0.75, 0.1, 0.97, False),
    ("plates", 30.0, 0.5, 3000.0, True),
    ("r2", 0.2, 0.01, 0.6, False),
    ("body", 600.0, 5.0, 1e5, True),
    ("latent", 15.0, 0.0, 300.0, False),
    ("stiffening", 1.0, 0.0, 60.0, False),
    ("expansion", 0.0, -0.2, 0.2, False),
    ("rise spread", 4.0, 0.3, 40.0, True),
    ("rise skew", 1.0, 0.1, 10.0, True),
    ("hysteresis", 20.0, 1.0, 60.0, True),
    ("fall spread", 4.0, 0.3, 40.0, True),
    ("fall skew", 1.0, 0.1, 10.0, True),
    ("low", 0.0, -0.2, 0.2, False),
    ("stroke", 1.0, 0.8, 2.5, False),
    ("resistance", 0.0, -0.4, 0.4, False),
    ("growth", 0.0, -0.3, 1.0, False),
    # Heat of the greatest drive, K, and the power of the drive with which it falls below.
    ("warm", 140.0, 1.0, 3000.0, True),
    ("power", 2.0, 0.3, 15.0, True),
)
_LOOSE, _PULL = 2.0, 0.1  # of a heat's logarithm: most off the power law; what that costs
_USUAL = 0.3  # of the same: by how much heats are off it
NAMES = tuple(row[0] for row in _SCALARS)


class Heated(NamedTuple):
    u: Array  # drive, held for `dt` each
    x: Array  # contraction, mm
    dt: float  # sample time, s


class Unheated(NamedTuple):
    wires: Stressed  # heat, ladder and relays; contraction before thermal expansion
    expansion: float  # thermal, mm/K
    # by which part the heat changes until full contraction, as their resistance does
    resistance: float = 0.0
    growth: float = 0.0  # relative increase of the heat loss above ambient, 1/K


class UnheatedFit(NamedTuple):
    model: Unheated  # the actuator
    table: FodTable
    values: dict[str, float]  # by name, heats as "heat 1.5"
    std: dict[str, float]  # standard errors, likewise; NaN of a parameter at its bound
    rms: float  # over the samples fitted to, mm
    range: float  # from the least to the greatest position in the records, mm
    free_run: tuple[Array, ...]  # over each record, mm


class _Grid(NamedTuple):
    """A record on the model's grid; `at`: points compared with `x`."""

    u: Array
    dt: float
    at: npt.NDArray[np.int64]
    x: Array


class _Known(NamedTuple):
    volts: Array
    ambient: float
    austenite: float
    stroke: float
    cold: float


def simulate(p: Unheated, u: npt.ArrayLike, dt: float) -> Array:
    sent = np.asarray(u, np.float64)
    most = _PART * p.wires.ladder.c1 * p.wires.ladder.r1
    parts = max(math.ceil(dt / most), 1)
    out = np.empty((2, len(sent)))
    compiled(_rollout)(p, stressed.cold(p.wires), np.ascontiguousarray(sent), parts, dt, out)
    return np.asarray(out[0] - p.expansion * out[1])


@kernel
def _rollout(
    p: Unheated, s: stressed.StressedState, drive: Array, parts: int, dt: float, out: Array
) -> None:
    """Contraction [mm] and temperature rise [K] into `out` (2, n), in `parts` substeps."""
    table = p.wires.hysteresis
    for k in range(len(drive)):
        out[0, k] = s.x
        out[1, k] = s.wire
        given = stressed.static_heat(p.wires, drive[k])
        for _ in range(parts):
            heat = given * (1.0 + p.resistance * (s.x - table.low) / table.span)
            s = stressed.exchanged(p.wires, s, heat, heat, 0.0, p.growth, dt / parts)


def unheated(
    records: Sequence[Heated], ambient: float = AMBIENT, austenite: float = AUSTENITE
) -> UnheatedFit:
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
        raise ProblemError(
            "records", found, "Record a drive that contracts the wires and lets them cool."
        )
    cold = float(np.median([r.x[0] for r in records]))
    known = _Known(_nodes(drives), ambient, austenite, extent, cold)
    grids = [_gridded(r) for r in records]
    end = _searched(known, grids)
    if end.status == 0:
        notice(ConvergenceWarning, "actuator: search stopped before it settled")
    return _told(known, records, grids, end)


def _nodes(drives: Array) -> Array:
    """Points of the heat map: 0 and every held level, or some of many."""
    levels = np.unique(drives[drives > 0.0])
    if len(levels) > _HELD:
        levels = np.unique(np.quantile(levels, np.linspace(0.0, 1.0, _NODES)))
    return np.concatenate([[0.0], levels])


def _gridded(r: Heated) -> _Grid:
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


def _model(known: _Known, z: Array) -> tuple[Unheated, FodTable, dict[str, float]]:
    """Actuator, table and named values for search values."""
    own = {
        name: math.exp(v) if log else float(v)
        for (name, _, _, _, log), v in zip(_SCALARS, z, strict=False)
    }
    law = own.pop("warm") * (known.volts[1:] / known.volts[-1]) ** own.pop("power")
    heats = np.concatenate([[0.0], law * np.exp(z[len(_SCALARS) :])])
    stroke = own["stroke"] * known.stroke
    low = known.cold + own["low"] * known.stroke
    up = Branch(known.austenite, own["rise spread"], own["rise skew"])
    up = up._replace(centre=2.0 * known.austenite - quantile(up, 0.5))
    down = Branch(known.austenite - own["hysteresis"], own["fall spread"], own["fall skew"])
    down = down._replace(centre=2.0 * down.centre - quantile(down, 0.5))
    table = relays(up, down, low, stroke)
    r1, r2 = own["r1"], own["r2"]
    r2 = min(r2, 0.999 - r1)
    ladder = Ladder(own["wire"] / r1, r1, own["plates"] / r2, r2, own["body"], 1.0 - r1 - r2)
    wires = Stressed(
        known.volts, heats, 0.0, ladder, own["latent"], 0.0, own["stiffening"] / known.stroke,
        math.inf, math.inf, known.ambient, hysteresis(table),
    )  # fmt: skip
    expansion = own["expansion"] * known.stroke / (known.austenite - known.ambient)
    for node, heat in zip(known.volts[1:], heats[1:], strict=True):
        own[f"heat {node:.4g}"] = float(heat)
    growth = own["growth"] / (known.austenite - known.ambient)
    return Unheated(wires, expansion, own["resistance"], growth), table, own


def _missed(known: _Known, grids: Sequence[_Grid], z: Array) -> Array:
    """Simulated less measured, relative to the range."""
    model = _model(known, z)[0]
    return np.concatenate([(simulate(model, g.u, g.dt)[g.at] - g.x) / known.stroke for g in grids])


def _pulled(known: _Known, grids: Sequence[_Grid], z: Array) -> Array:
    """`_missed` with weak priors of each heat at a power law, for levels without effect."""
    return np.concatenate([_missed(known, grids, z), _PULL * z[len(_SCALARS) :]])


def _span(known: _Known) -> Span:
    least = [math.log(lo) if log else lo for _, _, lo, _, log in _SCALARS]
    most = [math.log(hi) if log else hi for _, _, _, hi, log in _SCALARS]
    count = len(known.volts) - 1
    low, high = np.array([*least, *[-_LOOSE] * count]), np.array([*most, *[_LOOSE] * count])
    return Span(low, high, np.zeros(len(low)))


def _searched(known: _Known, grids: Sequence[_Grid]) -> Any:
    """The best of several searches: first by the power law, then with all heats."""
    span = _span(known)
    count, free = len(_SCALARS), np.zeros(len(known.volts) - 1)
    rough = [g._replace(at=g.at[::4], x=g.x[::4]) for g in grids]

    def by_law(z: Array) -> Array:
        return _missed(known, rough, np.concatenate([z, free]))

    def by_all(z: Array) -> Array:
        return _pulled(known, grids, z)

    begins = []
    for warm, quick in product(_WARM, _QUICK):
        begin = [math.log(v) if log else v for _, v, _, _, log in _SCALARS]
        begin[NAMES.index("warm")], begin[NAMES.index("wire")] = math.log(warm), math.log(quick)
        begins.append(np.array(begin))
    ends = nearest(by_law, begins, Span(*(row[:count] for row in span)), _FEW, _BEST)
    further = [search(by_all, np.concatenate([z, free]), span, _ROUNDS) for z in ends]
    best = min(further, key=lambda end: float(end.cost))
    return search(by_all, best.x, span, _ROUNDS)


def _told(
    known: _Known, records: Sequence[Heated], grids: Sequence[_Grid], end: Any
) -> UnheatedFit:
    """Values with errors by the scatter of stretches of the records."""
    span = _span(known)
    model, table, values = _model(known, end.x)
    names = list(values)

    def shown(z: Array) -> Array:
        return np.array(list(_model(known, z)[2].values()))

    turn = slopes(shown, end.x, span)
    # Stretches of the records, then each heat's pull by what heats are usually off the law.
    error, count = end.fun.copy(), len(known.volts) - 1
    seen = len(error) - count
    error[seen:] = _PULL * _USUAL
    parts = np.linspace(0, seen, max(_BLOCKS, 2 * len(names)) + 1)[:-1]
    edges = np.concatenate([np.unique(parts.astype(int)), seen + np.arange(count + 1)])
    covariance = np.nan_to_num(clusters.spread(end.jac, error, edges).covariance)
    std = np.sqrt(np.diag(turn @ covariance @ turn.T))
    at_end = np.logical_or(*ended(end.x, span.low, span.high))
    searched = [*NAMES, *names[len(NAMES) - 2 :]]
    bound = [searched[k] for k in np.flatnonzero(at_end)]
    if bound:
        notice(
            DataWarning,
            f"actuator: {', '.join(bound)} at a bound of the search: the records do not "
            "determine it, so it has no standard error",
        )
        std[[n in bound for n in names]] = math.nan
    free = tuple(simulate(model, r.u, r.dt) for r in records)
    return UnheatedFit(
        model,
        table,
        values,
        dict(zip(names, (float(v) for v in std), strict=True)),
        known.stroke * float(np.sqrt(np.mean(end.fun[:seen] ** 2))),
        known.stroke,
        free,
    )
