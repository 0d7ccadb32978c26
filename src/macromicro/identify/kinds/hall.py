"""`identify hall`: the table from a sensor's volts to millimetres."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.identify import _report, model_file
from macromicro.identify._report import Pair
from macromicro.identify.notices import DataWarning, notice
from macromicro.identify.options import Hall as Options
from macromicro.identify.picking import RUN, Picked, Picking, Role, find_saturated, load, runs
from macromicro.identify.result import Line, Result
from macromicro.schema.text import write_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from macromicro.control.calibration import Calibration
    from macromicro.identify.hall import HallFit


V = Role(
    "v", "sensor voltage", ("v", "V", "hall_voltage", "hall", "voltage", "sensor", "u", "U"), ("V",)
)
X = Role("x", "position by the reference", ("x", "X", "laser", "position", "pos"), ("mm",))
ROLES = (V, X, RUN)
FILE = "hall_calibration.csv"
LEAST = 50
METHODS = {
    "mean": "mean of runs both ways",
    "spline": "one spline for all runs, fitted with the lag",
}


def identify(picking: Picking, options: Options) -> Result:
    if options.method not in METHODS:
        raise InputError("--method", options.method, ", ".join(METHODS))
    if not (options.low < options.high and 10 <= options.points <= 2000):
        found = f"it has {options.points} points from {options.low:g} to {options.high:g} V"
        raise ProblemError("table", found, "Choose 10 to 2000 points, and --low below --high.")
    tables = load(picking, ROLES)
    sweeps = [(v, x / 1e3) for table in tables for v, x in one_way(table)]
    if not sweeps:
        remedy = "Record runs over the sensor's range."
        raise ProblemError(tables[0].file, "there is no one-way run", remedy)
    v, x = (np.concatenate([sweep[k] for sweep in sweeps]) for k in (0, 1))
    falling = float(np.corrcoef(v, x)[0, 1]) < 0.0
    # The table is made monotone as a rising one.
    turned = [(v, -x) for v, x in sweeps] if falling else sweeps
    fit, beside = _fit(turned, options)
    if falling:
        table = fit.calibration._replace(position=-fit.calibration.position)
        fit = fit._replace(calibration=table)  # turned twice, place and way, `between` stays
    if not np.isfinite(fit.between).any():
        notice(DataWarning, "all runs go one way: the sensor's lag is not cancelled")
    place, seen = fit.calibration.position, np.isfinite(fit.error)
    slope, level = np.polyfit(fit.volts[seen], place[seen], 1)
    volts = fit.volts[seen]
    bend = float(np.abs(place[seen] - (slope * volts + level)).max())
    mean = "mean, from first to last voltage seen"
    lag = float(np.nanmax(np.abs(fit.between))) if np.isfinite(fit.between).any() else np.nan
    lines = [
        Line("slope", float(slope) * 1e3, unit="mm/V", note=mean),
        Line("from", float(volts[0]), unit="V", note=f"at {1e3 * place[seen][0]:.4f} mm"),
        Line("to", float(volts[-1]), unit="V", note=f"at {1e3 * place[seen][-1]:.4f} mm"),
        Line("error, mean", float(np.nanmean(fit.error)) * 1e6, unit="um", note="of the table"),
        Line("error, largest", float(np.nanmax(fit.error)) * 1e6, unit="um"),
        Line("up from down", lag * 1e6, unit="um", note="largest half difference: lag, cancelled"),
        Line("bend", bend * 1e6, unit="um", note="largest deviation from a line"),
        *beside,
    ]
    others = _report.unseen(options.tests, picking, ROLES, tables[0])
    tests = [read_by(fit.calibration, table) for table in others]
    remarks = [
        ("runs", f"{fit.runs}, one way each; {int(seen.sum())} of {len(seen)} voltages seen"),
        ("beyond them", "the table continues with its last slope"),
        ("settings", f"no setting holds a table; it is in {FILE} with --out"),
    ]

    def draw() -> dict[str, Figure]:
        from macromicro.identify.kinds import pictures

        every = [(v[:: max(len(v) // 300, 1)], x[:: max(len(v) // 300, 1)]) for v, x in sweeps]
        vs, xs = (np.concatenate([e[k] for e in every]) for k in (0, 1))
        sensor, mm, um = "sensor [V]", 1e3, 1e6
        table = [
            ("measured", vs, xs * mm, "."),
            ("table", fit.volts, place * mm, "-"),
            *((f"not fitted: {Path(o.file).name}", *_few(o), ".") for o in tests[:2]),
        ]
        unsure = [
            ("one run off the mean", fit.volts, fit.std * um, "-"),
            ("the mean", fit.volts, fit.error * um, "-"),
            ("up less down, half", fit.volts, fit.between * um, "--"),
        ]
        title = "uncertainty of the table, and lag"
        return {
            "calibration": pictures.points("sensor and table", sensor, "position [mm]", table),
            "residuals": pictures.points(title, sensor, "[um]", unsure),
        }

    head = "No setting of `macromicro run --config` holds a sensor's calibration.\n"
    head += f"The table is in {FILE} (volts, millimetres), as macromicro.control reads it."
    toml = model_file.plain(head, {"calibration": {"file": (FILE, f"{len(seen)} points")}})
    lengths = {"position_mm": place, "error_mm": fit.error, "std_mm": fit.std}
    data: dict[str, Any] = {"volts": fit.volts, **{name: x * 1e3 for name, x in lengths.items()}}
    title = f"Sensor volts to millimetres: {METHODS[options.method]}, monotone"
    files = {FILE: lambda path: _write(path, fit, METHODS[options.method])}
    parts = Result("hall", title, fit.calibration, lines, remarks, toml, draw, data, files)
    return _report.complete(parts, "mm", tests)


def _fit(sweeps: list[tuple[Array, Array]], options: Options) -> tuple[HallFit, list[Line]]:
    asked = (options.low, options.high, options.points)
    if options.method == "mean":
        from macromicro.identify.hall import fit_table

        return fit_table(sweeps, *asked), []
    from macromicro.identify.hall import fit_spline

    made = fit_spline(sweeps, *asked)
    half = made.wide * float(np.nanmean(made.fit.error)) * 1e6
    share = "half of the interval, mean; of the reference's scale"
    return made.fit, [
        Line("within, 95 %", half, unit="um", note=share),
        Line("lag", made.lag, made.lag_error, "readings", "of the sensor, fitted"),
        Line("pieces", made.pieces, note="of the spline, by cross-validation over runs"),
        Line("residual", made.residual * 1e6, unit="um", note="RMS of a run's bins, the noise"),
    ]


def read_by(table: Calibration, sweep: Picked) -> Pair:
    """Positions of a sweep by the reference and by the table."""
    volts = sweep.values["v"]
    grid = table.low + table.step * np.arange(len(table.position))
    made = 1e3 * np.interp(volts, grid, table.position)
    return Pair(sweep.file, volts, sweep.values["x"], np.asarray(made, np.float64))


def _few(trial: Pair) -> tuple[Array, Array]:
    every = max(len(trial.t) // 300, 1)
    return trial.t[::every], trial.measured[::every]


def one_way(table: Picked) -> list[tuple[Array, Array]]:
    """Each rise and fall of the position, without the ends of the sensor's range."""
    from macromicro.hysteresis.diagnostics import turning_points

    found = []
    for part in runs(table):
        v, x = part["v"], part["x"]
        stuck = find_saturated(v, f"{table.file}, v", "left out")
        if np.ptp(x) == 0.0 or np.ptp(v) == 0.0:
            name = "x" if np.ptp(x) == 0.0 else "v"
            remedy = "Record a sensor that moves."
            raise ProblemError(f"{table.file}, {name}", "the column is constant", remedy)
        v, x = v[~stuck], x[~stuck]
        turns = turning_points(x, 0.2 * float(np.ptp(x)))
        pieces = [slice(a, b + 1) for a, b in pairwise(turns)]
        found += [(v[p], x[p]) for p in pieces if _long(x[p], float(np.ptp(x)))]
    return found


def _long(x: Array, extent: float) -> bool:
    """Whether a piece covers a good part of the range, unlike rest at an end."""
    return len(x) >= LEAST and float(np.ptp(x)) > 0.2 * extent


def _write(path: Path, fit: HallFit, method: str) -> None:
    lines = [f"# Sensor calibration: {method}", "hall_V,position_mm"]
    place = fit.calibration.position * 1e3
    lines += [f"{v:.4f},{x:.6f}" for v, x in zip(fit.volts, place, strict=True)]
    write_text(path, "\n".join(lines) + "\n")
