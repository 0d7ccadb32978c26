"""`identify actuator`: shape-memory wires from their drive and contraction.

With a kiln's table: the model of the law `inverse`. Without one: a model for other programs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from macromicro.arrays import Array
from macromicro.columns import Column
from macromicro.errors import ProblemError
from macromicro.identify import _report, model_file
from macromicro.identify._report import Curves, Pair
from macromicro.identify.options import Actuator as Options
from macromicro.identify.picking import RUN, Picked, Picking, Role, T, runs
from macromicro.identify.result import Line, Result
from macromicro.identify.runs import checked
from macromicro.recording import Recording

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from macromicro.identify.wire import Heated, WireFit
    from macromicro.identify.wire_model import Wire
    from macromicro.models.stressed import Stressed

LAW = "inverse"
U = Role("u", "heating voltage", ("u", "ctrl", "voltage", "volts", "input"), ("V",))
DRIVE = Role(
    U.name, "voltage, current or power that heats", (*U.names, "current", "power"), ("V", "A", "W")
)
X = Role("x", "contraction by a laser", ("x", "laser", "position", "pos"), ("mm",))
Y = Role("y", "the position's sensor", ("y", "hall_voltage", "hall"), ("V",), optional=True)
C = Role("c", "whether CONTRACT cuts the current", ("c", "contract"), optional=True)
ROLES = (T, U, X, Y, C, RUN)
_LEAST = 50  # samples of a record without a table
_TITLE = "c1 T' = heat(u) - (T - plates) / r1, less latent heat; relays at T, less stress"
_COLUMNS = {
    "t": Column("t", "s", ""),
    "u": Column("ctrl", "V", ""),
    "x": Column("laser", "um", ""),
    "y": Column("hall_voltage", "V", ""),
    "c": Column("contract", "1", ""),
}
_HEAT = "final warming of the wires"
# Unit and meaning of the parameters.
MEANINGS = {
    "c1": ("s", "heat capacity of the wires"),
    "r1": ("", "resistance wires to plates"),
    "c2": ("s", "heat capacity of the plates"),
    "r2": ("", "resistance plates to body"),
    "c3": ("s", "heat capacity of the body"),
    "latent": ("K", "latent heat over the wires' capacity"),
    "shift": ("K", "rise of the thresholds from the kiln to the stage"),
    "stiffening": ("K/mm", "rise of the thresholds with the contraction"),
}
WITHOUT_TABLE = {
    **MEANINGS,
    "wire": ("s", "time constant of the wires"),
    "plates": ("s", "time constant of what is next to them"),
    "body": ("s", "heat capacity of the body"),
    "stiffening": ("", "rise of the thresholds over the range, K"),
    "expansion": ("", "thermal, of the range while they warm"),
    "rise spread": ("K", "of the thresholds of contraction"),
    "rise skew": ("", "of these; 1: symmetric"),
    "hysteresis": ("K", "between the medians of both thresholds"),
    "fall spread": ("K", "of the thresholds of extension"),
    "fall skew": ("", "of these"),
    "low": ("", "place of the cold wires, of the range, from the records' first"),
    "resistance": ("", "by which the heat changes until full contraction"),
    "growth": ("", "of the loss of heat, until the thresholds"),
    "stroke": ("", "full contraction, of the range in the records"),
}


def identify(picking: Picking, options: Options) -> Result:
    from macromicro.identify.heating import AMBIENT

    room = AMBIENT if options.ambient is None else options.ambient
    if options.table is None:
        return _without_table(picking, options, room)
    if options.austenite is not None:
        problem = "it cannot be combined with --table, whose temperatures were measured"
        raise ProblemError("--austenite", problem, "Remove one of them.")
    return _with_table(picking, options, options.table, room)


def _with_table(picking: Picking, options: Options, file: Path, room: float) -> Result:
    from macromicro.identify import wire_table
    from macromicro.identify.kiln import saved_table

    table = saved_table(file)
    tables, others = _report.records(picking, ROLES, options.tests)
    records = [one for each in tables for one in _recordings(each)]
    found = wire_table.for_law(table, records, room)
    fit, wires = found.fit, found.fit.model.wires
    lines = [*_lines(fit, MEANINGS, _HEAT), Line("lag", wires.lag, math.nan, "s", "of the driver")]
    remarks = [("fit", f"{1e3 * fit.rms:.2g} um RMS over {len(records)} records")]
    if math.isfinite(found.sensor):
        lines.append(Line("sensor", found.sensor, math.nan, "s", "lag of the position's sensor"))
    else:
        remarks.append(("sensor's lag", "unknown without a column y; taken as 0"))
    head = f"An actuator under the law `{LAW}`: macromicro run --config model.toml"
    toml = model_file.gains(head, "fine", found.gains, LAW)
    data = {"rms_um": 1e3 * fit.rms, "iterations": fit.iterations}

    def draw() -> dict[str, Figure]:
        return {"heat": _heat_map(wires, "CTRL [V]")}

    parts = Result("actuator", _TITLE, found.gains, lines, remarks, toml, draw, data)
    tests = [_by_table(wires, one, each.file) for each in others for one in _recordings(each)]
    fitted = _curves(lambda: [_by_table(wires, one) for one in records])
    return _report.complete(parts, "mm", tests, fitted)


def _without_table(picking: Picking, options: Options, room: float) -> Result:
    from macromicro.identify import wire

    roles = (T, DRIVE, X, C, RUN)
    tables, others = _report.records(picking, roles, options.tests)
    records = [one for each in tables for one in _heating_runs(each)]
    median = wire.AUSTENITE if options.austenite is None else options.austenite
    fit = wire.without_table(records, room, median)
    u = tables[0].units["u"] or "u"
    lines = _lines(fit, WITHOUT_TABLE, f"{_HEAT} by so many {u}")
    tests = [_by_drive(fit.model, one, each.file) for each in others for one in _heating_runs(each)]
    extent = float(np.ptp(np.concatenate([r.x for r in records])))
    share = 100.0 * fit.rms / extent
    remarks = [
        ("fit", f"{1e3 * fit.rms:.3g} um RMS, {share:.2f} % of the range, {len(records)} records"),
        (
            "scale of temperature",
            f"half contracted at {median:g} degC while it warms; given, not identified",
        ),
    ]
    if tests:
        worst = max(100.0 * t.rms / extent for t in tests)
        remarks.append(("test records", f"{worst:.2f} % of the range at most"))
    data = {"rms_mm": fit.rms, "range_mm": extent, "austenite": median, "ambient": room}

    def draw() -> dict[str, Figure]:
        return {"branches": _branches(fit), "heat": _heat_map(fit.model.wires, f"drive [{u}]")}

    head = "An actuator from drive and position alone, for other programs. Not for\n"
    head += "`macromicro run --config`, which takes one that was found with the kiln's table."
    values = {"range": (extent, "mm"), **_report.notes(lines, point="p")}
    toml = model_file.plain(head, {"actuator": values})
    parts = Result("actuator", _TITLE, fit.model, lines, remarks, toml, draw, data)
    fitted = _curves(lambda: [_by_drive(fit.model, one) for one in records])
    return _report.complete(parts, "mm", tests, fitted)


def _curves(free: Callable[[], list[Pair]]) -> Callable[[], Curves]:
    def curves() -> Curves:
        pairs = free()
        return Curves(pairs, "contraction [mm]", float(pairs[0].t[1] - pairs[0].t[0]))

    return curves


def _lines(fit: WireFit, meanings: Mapping[str, tuple[str, str]], heat: str) -> list[Line]:
    return [
        Line(name, value, fit.std[name], *meanings.get(name, ("K", heat)))
        for name, value in fit.values.items()
    ]


def _recordings(file: Picked) -> list[Recording]:
    made = []
    for run in runs(file):
        t = run["t"]
        if len(t) < 2:
            continue
        dt = float(np.median(np.diff(t)))
        values = {**run, "t": t - t[0], "x": 1e3 * run["x"]}
        names = [n for n in _COLUMNS if n in run]
        columns = [_COLUMNS[n] for n in names]
        made.append(Recording.from_arrays(columns, [values[n] for n in names], dt, {}))
    return made


def _heating_runs(file: Picked) -> list[Heated]:
    """Runs of a file, each from cold; the drive is 0 while a switch interrupts it."""
    from macromicro.identify.wire import Heated

    made = []
    for part in runs(file):
        run = checked(part["t"], part["u"], part["x"], file.file, _LEAST)
        u = run.u
        if "c" in part and len(part["c"]) == len(u):
            u = np.where(part["c"] > 0.5, 0.0, u)
        made.append(Heated(u, run.x, run.dt))
    return made


def _by_table(wires: Stressed, record: Recording, file: str = "") -> Pair:
    """Contraction over a record from cold, mm: by the laser and by the model."""
    from macromicro.models import stressed

    cut = record["contract"] if "contract" in record else np.nan  # noqa: SIM401 -- no dictionary
    free = stressed.simulate(wires, record["ctrl"], record.dt, cut)[0]
    measured = 1e-3 * np.asarray(record["laser"])
    return Pair(file, np.asarray(record["t"]), measured, np.asarray(free))


def _by_drive(model: Wire, record: Heated, file: str = "") -> Pair:
    from macromicro.identify.wire_model import simulate

    t = np.arange(len(record.u), dtype=np.float64) * record.dt
    return Pair(file, t, record.x, simulate(model, record.u, record.dt))


def _heat_map(wires: Stressed, label: str) -> Figure:
    from macromicro.identify.kinds import pictures

    return pictures.points(_HEAT, label, "[K]", [("heat map", wires.volts, wires.heat, "o-")])


def _branches(fit: WireFit) -> Figure:
    from macromicro.identify.kinds import pictures

    table = fit.table
    last = len(table.values) - 1
    at = table.lo + table.step * np.arange(last + 1, dtype=np.float64)
    rise: Array = table.f_low + table.values[:, 0]
    fall: Array = table.f_low + table.span - table.values[last, :]
    title = "branches without load, by the temperature that is counted in"
    series = [("while it warms", at, rise, "-"), ("while it cools", at, fall, "-")]
    return pictures.points(title, "temperature [degC]", "contraction [mm]", series)
