"""`identify stress`: strain over temperature at several loads, as one map."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.identify import _report
from macromicro.identify._report import Pair
from macromicro.identify._stress_map import SHARES, Cycle, StressMap, cycle, fit, missed, pieces
from macromicro.identify.kinds import model_file
from macromicro.identify.notices import DataWarning, notice
from macromicro.identify.picking import Picked, Picking, Role
from macromicro.identify.result import Line, Result
from macromicro.units import quotient

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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


class Options(NamedTuple):
    tests: tuple[str, ...] = ()  # files with loads that are not fitted


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
    tests = [_predicted(found, one, table.file) for table in others for one in _cycles([table])]
    first, last = (float(found.heating.loads[k]) for k in (0, -1))
    remarks = [
        ("loads", ", ".join(f"{each:g}" for each in found.heating.loads) + f" {load}"),
        *_scatter(tables, load),
        ("map", _words(found)),
        ("fit", f"{100.0 * _own(found):.2f} % of range, RMS over what was fitted"),
        ("valid", f"from {first:g} to {last:g} {load}; beyond these it extrapolates"),
    ]
    ends = [100.0 * found.left_out[each] for each in (first, last) if each in found.left_out]
    if ends:
        told = " and ".join(f"{each:.2f} %" for each in ends)
        remarks.append(("extrapolated", f"the lowest and highest load by the others: {told}"))

    def draw() -> dict[str, Figure]:
        return drawn(found, load, out)

    data = {
        "loads": found.heating.loads.tolist(),
        "common_slope": found.way.common,
        "saturating": found.way.saturating,
        "left_out": {f"{k:g}": v for k, v in found.left_out.items()},
    }
    files = {SHEET: lambda path: _sheet(found, path)}
    title = "T_q = a_q + b_q load, where a share q of the stroke is done, by branch"
    parts = Result("stress", title, found, lines, remarks, _toml(lines), draw, data, files)
    return _report.completed(parts, out, tests)


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


def _own(found: StressMap) -> float:
    return float(np.sqrt(np.mean([missed(found, one) ** 2 for one in found.cycles])))


def _predicted(found: StressMap, one: Cycle, file: str) -> Pair:
    if not found.within(one.load):
        first, last = (float(found.heating.loads[k]) for k in (0, -1))
        notice(
            DataWarning,
            f"{file}: a load of {one.load:g} is beyond those measured, {first:g} to {last:g}: "
            "the map extrapolates",
        )
    index = np.arange(len(one.t), dtype=np.float64)
    return Pair(file, index, one.y, found.predict(one.load, one.t))


def drawn(found: StressMap, load: str, out: str) -> dict[str, Figure]:
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
    return {
        "curves": pictures.points("loops by load", temperature, f"output [{out}]", loops),
        "thresholds": pictures.points(
            "transformation temperatures", f"load [{load}]", temperature, lines
        ),
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
