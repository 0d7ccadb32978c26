"""`identify stress`: strain over temperature at several loads, as one map."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import ProblemError
from macromicro.hysteresis.diagnostics import reversals
from macromicro.identify import _report, model_file
from macromicro.identify._report import Pair
from macromicro.identify.notices import DataWarning, notice
from macromicro.identify.options import Stress as Options
from macromicro.identify.picking import Picked, Picking, Role
from macromicro.identify.result import Line, Result
from macromicro.units import quotient

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Cold and hot level are linear between neighbouring loads, or one is and the stroke saturates, a +
# b (1 - exp(-s / c)) (D. C. Lagoudas, Shape Memory Alloys, 2008, section 3.3.1). The way that
# predicts left-out loads best is used.


BRANCHES = ("heating", "cooling")
_SATURATING = 3  # loads, for three unknowns
SHARES = np.linspace(0.01, 0.99, 50)
_WHOLE = 0.8  # of a load's range of temperatures: a shorter branch is a minor one
_ENDS = 0.03  # of that range: over which the levels are taken
_BINS = 400
_SWING = 0.1  # of the range: a smaller turn is noise


class Way(NamedTuple):
    common: bool  # one slope for all shares of a branch
    saturating: bool  # stroke that saturates with the load
    # whether it is then measured from the hot level, which goes linearly, and not from the cold
    from_hot: bool = False


class Side(NamedTuple):
    loads: Array  # rising
    # low, high: levels at these
    low: Array
    high: Array
    at_zero: Array  # a_q, degC
    slopes: Array  # b_q, K per unit of load
    spread: Array  # standard errors of these slopes, NaN of two loads
    rms: float  # RMS of the temperatures about their lines, K
    curve: tuple[float, ...] = ()  # a, b, c of the stroke; empty where it goes linearly
    from_hot: bool = False  # stroke measured from the hot level

    def levels(self, load: float) -> tuple[float, float]:
        low, high = (_between(load, self.loads, each) for each in (self.low, self.high))
        if not self.curve:
            return low, high
        stroke = _saturation(load, *self.curve)
        return (high - stroke, high) if self.from_hot else (low, low + stroke)

    def temperatures(self, load: float) -> Array:
        """Temperatures of the shares at a load, rising, degC."""
        return np.maximum.accumulate(self.at_zero + self.slopes * load)

    def output(self, load: float, t: npt.ArrayLike) -> Array:
        """Output on this branch; `t` in degC."""
        low, high = self.levels(load)
        share = np.interp(np.asarray(t, np.float64), self.temperatures(load), SHARES)
        # The first and last hundredth are the levels' own.
        share = (share - SHARES[0]) / (SHARES[-1] - SHARES[0])
        return np.asarray(low + (high - low) * share)


class StressMap(NamedTuple):
    # heating, cooling: the branches
    heating: Side
    cooling: Side
    way: Way
    # RMS at each load by a map of the others, as a share of the output's range there
    left_out: dict[float, float]
    inside: tuple[float, ...]  # loads of these that lie between others
    cycles: tuple[Cycle, ...]  # by rising load

    def within(self, load: float) -> bool:
        return bool(self.heating.loads[0] <= load <= self.heating.loads[-1])

    def predict(self, load: float, t: npt.ArrayLike) -> Array:
        """Output along whole branches; `t` in degC."""
        way = np.asarray(t, np.float64)
        found = np.empty(len(way))
        for start, end, rising in pieces(way):
            side = self.heating if rising else self.cooling
            found[start:end] = side.output(load, way[start:end])
        return found


def _between(load: float, loads: Array, values: Array) -> float:
    """Linear between loads, and extrapolated beyond the last ones."""
    if len(loads) == 1:
        return float(values[0])
    k = int(np.clip(np.searchsorted(loads, load) - 1, 0, len(loads) - 2))
    part = (load - loads[k]) / (loads[k + 1] - loads[k])
    return float(values[k] + part * (values[k + 1] - values[k]))


def _saturation(load: float, a: float, b: float, c: float) -> float:
    return float(a - b * np.expm1(-load / c))


def _curve(loads: Array, values: Array) -> tuple[float, ...]:
    """a, b and c nearest to the levels: linear in a and b, c by search."""
    from scipy.optimize import minimize_scalar

    def solved(log: float) -> tuple[Array, float]:
        table = np.stack([np.ones_like(loads), -np.expm1(-loads / np.exp(log))], axis=1)
        theta = np.linalg.lstsq(table, values, rcond=None)[0]
        return theta, float(np.sum((values - table @ theta) ** 2))

    size = np.log(np.abs(loads).max())
    found = minimize_scalar(lambda log: solved(log)[1], bounds=(size - 4, size + 3))
    a, b = solved(found.x)[0].tolist()
    return a, b, float(np.exp(found.x))


def _side(cycles: Sequence[Cycle], name: str, way: Way) -> Side:
    own = [getattr(c, name) for c in cycles]
    loads = np.array([c.load for c in cycles])
    table = np.stack([b.temperatures for b in own])
    about = loads - loads.mean()
    slopes = about @ table / (about @ about)
    free = len(loads) - 2
    if way.common:
        slopes = np.full(len(SHARES), slopes.mean())
    at_zero = table.mean(axis=0) - slopes * loads.mean()
    missed = table - at_zero - np.outer(loads, slopes)
    with np.errstate(divide="ignore", invalid="ignore"):
        variance = (missed**2).sum(axis=0) / free
        if way.common:  # shares of one load miss together: each load is one witness
            variance = np.full(len(SHARES), variance.mean())
        spread = np.sqrt(variance / (about @ about))
    if free == 0:
        spread = np.full(len(SHARES), np.nan)
    rms = float(np.sqrt(np.mean(missed**2)))
    low, high = (np.array([getattr(b, each) for b in own]) for each in ("low", "high"))
    curve = _curve(loads, high - low) if way.saturating else ()
    return Side(loads, low, high, at_zero, slopes, spread, rms, curve, way.from_hot)


def _map(cycles: Sequence[Cycle], way: Way) -> StressMap:
    heating, cooling = (_side(cycles, name, way) for name in BRANCHES)
    return StressMap(heating, cooling, way, {}, (), tuple(cycles))


def relative_error(found: StressMap, one: Cycle) -> float:
    """RMS error over a record, as a share of its output range."""
    error = found.predict(one.load, one.t) - one.y
    return float(np.sqrt(np.mean(error**2)) / np.ptp(one.y))


def fit(cycles: Sequence[Cycle]) -> StressMap:
    """The map of some loads, judged by leave-one-out."""
    ordered = sorted(cycles, key=lambda c: c.load)
    loads = [c.load for c in ordered]
    if len(set(loads)) != len(loads) or len(loads) < 2:
        shown = ", ".join(f"{each:g}" for each in loads)
        raise ProblemError("loads", f"they are {shown or 'none'}", "Give two or more, each once.")
    inside = tuple(loads[1:-1])
    strokes = ((False, False), (True, False), (True, True))
    ways = [Way(common, *stroke) for common in (True, False) for stroke in strokes]
    tried = {way: _left_out(ordered, way) for way in ways}

    def score(way: Way) -> float:
        if not inside or not all(each in tried[way] for each in inside):
            return np.inf
        return float(np.mean(np.square([tried[way][each] for each in inside])))

    best = min(ways, key=score)
    return _map(ordered, best)._replace(left_out=tried[best], inside=inside)


def _left_out(cycles: Sequence[Cycle], way: Way) -> dict[float, float]:
    """RMS at each load by a map of the others; empty if these are too few."""
    others = len(cycles) - 1
    least = max(1 + (not way.common), 2, _SATURATING if way.saturating else 2)
    if others < least:
        return {}
    return {
        one.load: relative_error(_map([*cycles[:k], *cycles[k + 1 :]], way), one)
        for k, one in enumerate(cycles)
    }


class Branch(NamedTuple):
    # low, high: cold and hot level, unit of the output
    low: float
    high: float
    temperatures: Array  # at the shares `SHARES` of the way from low to high, degC


class Cycle(NamedTuple):
    load: float  # stress or force, held
    # heating, cooling: the mean of its whole branches
    heating: Branch
    cooling: Branch
    # t, y: temperature and output as measured
    t: Array
    y: Array


def cycle(load: float, t: npt.ArrayLike, y: npt.ArrayLike, where: str = "record") -> Cycle:
    """Branches of a record under one load; `t` in degC."""
    tt, yy = np.asarray(t, np.float64), np.asarray(y, np.float64)
    extent = float(np.ptp(tt))
    kept: dict[bool, list[tuple[Array, Array]]] = {True: [], False: []}
    for start, end, rising in pieces(tt):
        part = slice(start, end)
        if np.ptp(tt[part]) >= _WHOLE * extent > 0.0:
            kept[rising].append((tt[part], yy[part]))
    for rising, name in ((True, "heating"), (False, "cooling")):
        if not kept[rising]:
            remedy = "Record whole heating and cooling cycles at each load."
            raise ProblemError(where, f"there is no complete {name} at a load of {load:g}", remedy)
    lowest, highest = float(tt.min()), float(tt.max())
    whole = [*kept[True], *kept[False]]
    own, output = (np.concatenate([part[k] for part in whole]) for k in (0, 1))
    ends = [float(np.mean(output[np.abs(own - at) <= _ENDS * extent])) for at in (lowest, highest)]
    if ends[0] == ends[1]:
        remedy = "Record an output that changes with temperature."
        raise ProblemError(where, f"the output is {ends[0]:g} both cold and hot", remedy)
    sides = [_branch(kept[rising], ends, lowest, highest) for rising in (True, False)]
    return Cycle(float(load), sides[0], sides[1], tt, yy)


def pieces(t: Array) -> list[tuple[int, int, bool]]:
    """Monotone branches of a temperature record, degC."""
    turns = [0, *(int(k) for k in reversals(t, _SWING * float(np.ptp(t)))), len(t) - 1]
    found = []
    for a, b in pairwise(turns):
        if b > a:
            found.append((a, b + 1 if b == len(t) - 1 else b, bool(t[b] > t[a])))
    return found


def _branch(
    parts: Sequence[tuple[Array, Array]], ends: Sequence[float], lowest: float, highest: float
) -> Branch:
    """Mean of branches, as temperatures of its shares."""
    from scipy.optimize import isotonic_regression

    low, high = ends
    grid = np.linspace(lowest, highest, _BINS + 1)
    t, y = (np.concatenate([p[k] for p in parts]) for k in (0, 1))
    which = np.clip(np.digitize(t, grid) - 1, 0, _BINS - 1)
    count = np.bincount(which, minlength=_BINS)
    there = count > 0
    mean = np.bincount(which, y, minlength=_BINS)[there] / count[there]
    own = np.bincount(which, t, minlength=_BINS)[there] / count[there]
    share = (mean - low) / (high - low)
    rising = np.asarray(isotonic_regression(share, weights=count[there]).x, np.float64)
    # Of equal shares the middle temperature: np.interp wants them to rise.
    steps = np.flatnonzero(np.diff(rising) > 0.0) + 1
    groups = np.split(np.arange(len(rising)), steps)
    shares = np.array([rising[g[0]] for g in groups])
    places = np.array([own[g].mean() for g in groups])
    if len(shares) < 2:
        remedy = "Record an output that changes with temperature."
        raise ProblemError("branch", "the output has only one level", remedy)
    return Branch(low, high, np.interp(SHARES, shares, places))


SHEET = "stress_map.csv"
T = Role("T", "temperature", ("temperature", "thermocouple", "temp", "T"), ("degC",))
X = Role("x", "strain or position", ("x", "strain", "contraction", "position", "y", "laser"))
LOAD = Role("load", "load, held", ("load", "stress", "force", "weight", "s"), ("MPa", "N"))
ROLES = (T, X, LOAD)
_APART, _WIDE = 0.01, 0.1  # of the greatest load: between two loads, and how one may scatter
_DIGITS = 4  # of a load that was measured
_SCATTERS = 0.5  # of the scatter of both: mean loads that are nearer are one load
_STARTED, _HALF, _ENDED = (int(np.abs(SHARES - q).argmin()) for q in (0.1, 0.5, 0.9))


Rows = npt.NDArray[np.int64]


def identify(picking: Picking, options: Options) -> Result:
    """Transformation temperatures, linear in the load by branch, and the levels."""
    tables, others = _report.records(picking, ROLES, options.tests)
    found = fit(_cycles(tables))
    load, out = tables[0].units["load"] or "load", tables[0].units["x"] or "x"
    middle = float(np.mean(found.heating.loads))
    lines = _sides(found, load, middle)
    for at in (found.heating.loads[0], found.heating.loads[-1]):
        low, high = found.heating.levels(float(at))
        lines.append(Line(f"stroke at {at:g}", high - low, unit=out, note=f"{load}, cold to hot"))
    for at in found.inside:
        if at in found.left_out:
            note = "of its range, RMS, by a map of the other loads"
            lines.append(Line(f"left out {at:g}", 100.0 * found.left_out[at], unit="%", note=note))
    tests = [_predict(found, one, table.file) for table in others for one in _cycles([table])]
    first, last = (float(found.heating.loads[k]) for k in (0, -1))
    remarks = [
        ("loads", ", ".join(f"{each:g}" for each in found.heating.loads) + f" {load}"),
        *_scatter(tables, load),
        ("map", _words(found)),
        ("fit", f"{100.0 * _own_error(found):.2f} % of range, RMS over what was fitted"),
        ("valid", f"from {first:g} to {last:g} {load}; beyond these it extrapolates"),
    ]
    ends = [100.0 * found.left_out[each] for each in (first, last) if each in found.left_out]
    if ends:
        told = " and ".join(f"{each:.2f} %" for each in ends)
        remarks.append(("extrapolated", f"the lowest and highest load by the others: {told}"))

    def draw() -> dict[str, Figure]:
        return draw_figures(found, load, out)

    data = {
        "loads": found.heating.loads.tolist(),
        "common_slope": found.way.common,
        "saturating": found.way.saturating,
        "left_out": {f"{k:g}": v for k, v in found.left_out.items()},
    }
    files = {SHEET: lambda path: _sheet(found, path)}
    title = "T_q = a_q + b_q load, where a share q of the stroke is done, by branch"
    parts = Result("stress", title, found, lines, remarks, _toml(lines), draw, data, files)
    return _report.complete(parts, out, tests)


def _cycles(tables: list[Picked]) -> list[Cycle]:
    kept: dict[float, list[tuple[str, Array, Array]]] = {}
    for table, own in zip(tables, levels(tables), strict=True):
        cuts = np.flatnonzero(np.diff(own)) + 1
        parts = (np.split(table.values[name], cuts) for name in ("T", "x"))
        for value, t, y in zip(np.split(own, cuts), *parts, strict=True):
            kept.setdefault(float(value[0]), []).append((table.file, t, y))
    cycles = []
    for value, each in kept.items():
        t, y = (np.concatenate([one[k] for one in each]) for k in (1, 2))
        cycles.append(cycle(value, t, y, each[0][0]))
    return cycles


def levels(tables: list[Picked]) -> list[Array]:
    """The load of each row: that held, or the mean over records if a load cell scatters."""
    loads = np.concatenate([table.values["load"] for table in tables])
    most = float(np.abs(loads).max())
    groups = _clusters(loads, most)
    if all(np.ptp(loads[group]) <= _WIDE * most for group in groups):
        typical = [np.median(loads[group]) for group in groups]
    else:
        records = _records(tables, most)
        means = np.array([loads[record].mean() for record in records])
        groups = [np.concatenate([records[k] for k in same]) for same in _clusters(means, most)]
        typical = [np.mean(loads[group]) for group in groups]
    made = np.empty(len(loads))
    for group, value in zip(groups, typical, strict=True):
        made[group] = float(f"{value:.{_DIGITS}g}")
    return np.split(made, np.cumsum([len(table.values["load"]) for table in tables])[:-1])


def _clusters(values: Array, most: float) -> list[Rows]:
    """Numbers of values that are alike, by rising value."""
    order = np.argsort(values, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(values[order]) > _APART * most) + 1)


def _records(tables: list[Picked], most: float) -> list[Rows]:
    """Rows of each record: a file, cut between cycles whose mean loads differ by their scatter."""
    found, begin = [], 0
    for table in tables:
        load = table.values["load"]
        begins = [first for first, _, _ in pieces(table.values["T"])][::2]
        parts = pairwise(np.split(load, begins[1:]))
        cuts = [
            row
            for row, (before, after) in zip(begins[1:], parts, strict=True)
            if abs(float(before.mean() - after.mean()))
            > max(_SCATTERS * float(before.std() + after.std()), _APART * most)
        ]
        found += [begin + rows for rows in np.split(np.arange(len(load)), cuts)]
        begin += len(load)
    return found


def _scatter(tables: list[Picked], unit: str) -> list[tuple[str, str]]:
    """What to say of loads that were measured and scatter."""
    own = np.concatenate(levels(tables))
    loads = np.concatenate([table.values["load"] for table in tables])
    stds = {value: float(loads[own == value].std()) for value in np.unique(own).tolist()}
    if max(stds.values()) <= _APART * float(np.abs(own).max()):
        return []
    text = ", ".join(f"{value:g} +- {std:.2g}" for value, std in stds.items())
    return [("load cell", f"mean and scatter of each load: {text} {unit}")]


def _sides(found: StressMap, load: str, middle: float) -> list[Line]:
    """Slopes, and temperatures of 10, 50 and 90 % at the mean load."""
    lines = []
    for name, side in (("heating", found.heating), ("cooling", found.cooling)):
        slope, spread = side.slopes[_HALF], side.spread[_HALF]
        note = "rise of the transformation with the load" + (
            "" if found.way.common else ", half done"
        )
        lines.append(Line(f"{name}, slope", slope, spread, quotient("K", load), note))
        at = side.temperatures(middle)
        for k, q in ((_STARTED, 10), (_HALF, 50), (_ENDED, 90)):
            note = f"{q} % contracted at {middle:g} {load}"
            value = float(at[k])
            line = Line(f"{name}, {q} %", value, unit="degC", note=note)
            lines.append(line._replace(extra=side.rms, extra_name="misfit"))
    return lines


def _words(found: StressMap) -> str:
    slopes = "one slope for each branch" if found.way.common else "a slope for each share"
    stroke = "levels linear between loads"
    if found.way.saturating:
        level = "hot" if found.way.from_hot else "cold"
        stroke = f"a stroke that saturates, from the {level} level"
    why = "; chosen by the prediction of left-out loads" if found.inside else ""
    return f"{slopes}, {stroke}{why}"


def _own_error(found: StressMap) -> float:
    return float(np.sqrt(np.mean([relative_error(found, one) ** 2 for one in found.cycles])))


def _predict(found: StressMap, one: Cycle, file: str) -> Pair:
    if not found.within(one.load):
        first, last = (float(found.heating.loads[k]) for k in (0, -1))
        notice(
            DataWarning,
            f"{file}: a load of {one.load:g} is beyond those measured, {first:g} to {last:g}: "
            "the map extrapolates",
        )
    index = np.arange(len(one.t), dtype=np.float64)
    return Pair(file, index, one.y, found.predict(one.load, one.t))


def draw_figures(found: StressMap, load: str, out: str) -> dict[str, Figure]:
    from macromicro.identify.kinds import pictures

    loops = []
    for one in found.cycles:
        loops.append((f"{one.load:g} {load}", one.t, one.y, "-"))
        loops.append((f"{one.load:g} {load}, map", one.t, found.predict(one.load, one.t), ":"))
    lines = []
    for name in ("heating", "cooling"):
        side = getattr(found, name)
        for k, q in ((_STARTED, 10), (_HALF, 50), (_ENDED, 90)):
            own = np.array([getattr(c, name).temperatures[k] for c in found.cycles])
            lines.append((f"{name}, {q} %", side.loads, own, "o"))
            lines.append(("", side.loads, side.at_zero[k] + side.slopes[k] * side.loads, "-"))
    temperature = "temperature [degC]"
    title = "transformation temperatures"
    return {
        "curves": pictures.points("loops by load", temperature, f"output [{out}]", loops),
        "thresholds": pictures.points(title, f"load [{load}]", temperature, lines),
    }


def _toml(lines: list[Line]) -> str:
    head = (
        "Transformation temperatures by load, for other programs; the map is in stress_map.csv.\n"
    )
    head += "Not for `macromicro run --config`: no setting holds a map."
    kept = [line for line in lines if not line.name.startswith("left out")]
    return model_file.plain(head, {"stress": _report.notes(kept)})


def _sheet(found: StressMap, path: Path) -> None:
    sides = (found.heating, found.cooling)
    table = np.column_stack([SHARES, *(c for s in sides for c in (s.at_zero, s.slopes, s.spread))])
    names = ("at_zero_degC", "slope_K_per_load", "slope_error")
    head = ",".join(["share", *(f"{n}_{each}" for n in ("heating", "cooling") for each in names)])
    np.savetxt(path, table, delimiter=",", header=head, comments="", fmt="%.9g")
