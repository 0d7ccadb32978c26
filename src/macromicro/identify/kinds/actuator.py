"""`identify actuator`: the model of the law `inverse`, from heatings in open loop."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from macromicro.columns import Column
from macromicro.identify import _report
from macromicro.identify._report import Curves, Pair
from macromicro.identify.kinds import model_file, unheated
from macromicro.identify.kinds.loading import Picking, loaded
from macromicro.identify.picking import RUN, Picked, Role, T, runs
from macromicro.identify.result import Line, Result
from macromicro.recording import Recording

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from macromicro.identify.heated import HeatedFit

LAW = "inverse"
U = Role("u", "heating voltage", ("u", "ctrl", "voltage", "volts", "input"), ("V",))
DRIVE = Role(
    U.name, "voltage, current or power that heats", (*U.names, "current", "power"), ("V", "A", "W")
)
X = Role("x", "contraction by a laser", ("x", "laser", "position", "pos"), ("mm",))
Y = Role("y", "the position's sensor", ("y", "hall_voltage", "hall"), ("V",), optional=True)
C = Role("c", "whether CONTRACT cuts the current", ("c", "contract"), optional=True)
ROLES = (T, U, X, Y, C, RUN)
_COLUMNS = {
    "t": Column("t", "s", ""),
    "u": Column("ctrl", "V", ""),
    "x": Column("laser", "um", ""),
    "y": Column("hall_voltage", "V", ""),
    "c": Column("contract", "1", ""),
}
_MEANS = {
    "c1": ("s", "heat capacity of the wires"),
    "r1": ("", "resistance wires to plates"),
    "c2": ("s", "heat capacity of the plates"),
    "r2": ("", "resistance plates to body"),
    "c3": ("s", "heat capacity of the body"),
    "latent": ("K", "latent heat over the wires' capacity"),
    "shift": ("K", "rise of the thresholds from the kiln to the stage"),
    "stiffening": ("K/mm", "rise of the thresholds with the contraction"),
}


class Options(NamedTuple):
    # the kiln's table, as `identify hysteresis` writes it; None: from drive and position alone
    table: Path | None = None
    ambient: float | None = None  # room temperature, deg C; None: 25
    tests: tuple[str, ...] = ()  # files with records that are not fitted
    # without a table: median temperature of contraction without load, deg C; None: 80
    austenite: float | None = None


def identify(picking: Picking, options: Options) -> Result:
    unheated.refused(options.table, options.austenite)
    if options.table is None:
        roles = (T, DRIVE, X, C)
        return unheated.identify(picking, roles, options.ambient, options.austenite, options.tests)
    from macromicro.hysteresis.table_files import load_table
    from macromicro.identify import heated
    from macromicro.identify.heating import AMBIENT

    table = load_table(options.table)
    tables = loaded(picking, ROLES)
    others = _report.unseen(options.tests, picking, ROLES, tables[0])
    records = [one for file in tables for one in _records(file)]
    room = AMBIENT if options.ambient is None else options.ambient
    found = heated.found(table, records, room)
    fit = found.fit
    lines = [Line(n, fit.values[n], fit.std[n], *_MEANS[n]) for n in _MEANS]
    lines += [
        Line(name, value, fit.std[name], "K", "final warming of the wires")
        for name, value in fit.values.items()
        if name.startswith("heat ")
    ]
    lines.append(Line("lag", fit.model.lag, math.nan, "s", "of the driver"))
    tests = [_free(found, one, file.file) for file in others for one in _records(file)]
    remarks = [("fit", f"{1e3 * fit.rms:.2g} um RMS over {len(records)} records")]
    if math.isfinite(found.sensor):
        lines.append(Line("sensor", found.sensor, math.nan, "s", "lag of the position's sensor"))
    else:
        remarks.append(("sensor's lag", "unknown without a column y; taken as 0"))
    head = f"An actuator under the law `{LAW}`: macromicro run --config model.toml"
    toml = model_file.gains(head, "fine", found.gains, LAW)
    data = {"rms_um": 1e3 * fit.rms, "iterations": fit.iterations}
    title = "c1 T' = heat(u) - (T - plates) / r1, less latent heat; relays at T, less stress"

    def draw() -> dict[str, Figure]:
        return {"heat": unheated.heat_map(fit.model.volts, fit.model.heat, "CTRL [V]")}

    def curves() -> Curves:
        free = [_free(found, record, "") for record in records]
        return Curves(free, "contraction [mm]", records[0].dt)

    parts = Result("actuator", title, found.gains, lines, remarks, toml, draw, data)
    return _report.completed(parts, "mm", tests, curves)


def _records(file: Picked) -> list[Recording]:
    made = []
    for run in runs(file):
        t = run["t"]
        if len(t) < 2:
            continue
        dt = float(np.median(np.diff(t)))
        names = [n for n in _COLUMNS if n in run]
        values = {**run, "t": t - t[0], "x": 1e3 * run["x"]}
        made.append(
            Recording.from_arrays([_COLUMNS[n] for n in names], [values[n] for n in names], dt, {})
        )
    return made


def _free(found: HeatedFit, record: Recording, file: str) -> Pair:
    """Contraction over a record from cold, mm: by the laser and by the model."""
    from macromicro.models import stressed

    cut = record["contract"] if "contract" in record else np.nan  # noqa: SIM401 -- no dictionary
    model = stressed.simulate(found.fit.model, record["ctrl"], record.dt, cut)[0]
    measured = 1e-3 * np.asarray(record["laser"])
    return Pair(file, np.asarray(record["t"]), measured, np.asarray(model))
