"""`identify carriage`: the model of the law `terminal`, from strokes in open loop."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.identify import _report, model_file
from macromicro.identify._report import Curves, Pair
from macromicro.identify.clusters import within
from macromicro.identify.options import Carriage as Options
from macromicro.identify.picking import RUN, Picking, Role, T, runs
from macromicro.identify.result import Line, Result
from macromicro.schema.par import entries
from macromicro.units import quantity

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from macromicro.identify.carriage import CarriageFit

LAW = "terminal"
U = Role("u", "effort sent", ("u", "motor", "voltage", "effort"), ("V",))
X = Role("x", "encoder", ("x", "macro_position", "counts", "position"), ("counts",))
Y = Role("y", "platform by a laser", ("y", "laser"), ("m",), optional=True)
ROLES = (T, U, X, Y, RUN)
_SAME = 0.01  # of the sample time
_NO_NUDGES = (
    "unknown: no small efforts at rest, seen by the laser; the swing includes the compliance "
    "of the carriage, so its share is larger and its frequency slightly lower"
)
_DOUBTFUL = 0.3  # of a value: records that differ by more tell it poorly


def identify(picking: Picking, options: Options) -> Result:
    from macromicro.identify import carriage

    tables, others = _report.records(picking, ROLES, options.tests)
    records = [part for table in tables for part in runs(table)]
    pitch, said = _pitch(records, options.pitch, tables[0].file)
    fit = carriage.carriage([_columns(r) for r in records], pitch)
    pars = {e.path: e.par for e in entries(fit.model)}
    found = [n for n in (*carriage.RIGID, *carriage.SWING) if n in carriage.RIGID or n in fit.std]
    lines = [
        Line(name, float(getattr(fit.model, name)), error, pars[name].unit, note, within(degrees))
        for name in found
        for error, degrees in [(fit.std.get(name, math.nan), fit.freedom.get(name, math.inf))]
        for note in [_note(pars[name].meaning, fit.apart.get(name))]
    ]
    lines.append(Line("pitch", pitch, math.nan, "m", f"travel per count, {said}"))
    poor = [n for n, (lo, hi) in fit.apart.items() if hi - lo > _DOUBTFUL * getattr(fit.model, n)]
    strokes = sum(len(r.strokes) for r in fit.records)
    remarks = [("strokes", f"{strokes}, both ways")]
    if math.isfinite(fit.swing_rms):
        remarks.append(("swing", f"residual of {fit.swing_rms * 1e6:.2g} um RMS at the laser"))
    else:
        remarks.append(("swing", "unknown: no laser, or no rest of 0.25 s after a stroke"))
    if fit.std and fit.give is None:
        remarks.append(("compliance at rest", _NO_NUDGES))
    if poor:
        remarks.append(("poorly determined by these strokes", ", ".join(poor)))
    tests = [_predict(fit, part, file.file) for file in others for part in runs(file)]
    values = {f"controller.own.{line.name}": (line.value, line.note) for line in lines[:-1]}
    head = f"A carriage under the law `{LAW}`: macromicro run --config model.toml"
    toml = model_file.settings(head, values, LAW)
    if fit.give is not None:
        way, lag, (of_way, of_lag) = fit.give.carriage
        what = "at rest, by an effort at the swing's frequency; not included in the swing"
        lines.append(Line("give", way, of_way, "m/V", what))
        lines.append(Line("give lag", lag, of_lag, "s", "of this motion, beyond the delay"))

    def draw() -> dict[str, Figure]:
        from macromicro.identify.kinds import pictures

        t = np.arange(len(fit.records[0].u), dtype=np.float64) * fit.dt
        friction = [("friction beyond the model's", t, fit.motion[0][3], "-")]
        return {"friction": pictures.points("by the law's estimator", "time [s]", "[V]", friction)}

    def curves() -> Curves:
        left = [
            r.counts + 0.5 - m[0] / fit.model.pitch
            for r, m in zip(fit.records, fit.motion, strict=True)
        ]
        counts = [r.counts for r in fit.records]
        times = [np.arange(len(one), dtype=np.float64) * fit.dt for one in counts]
        free = [carriage.free_run(fit.model, r, fit.dt) for r in fit.records]
        return Curves(_report.pairs(times, counts, free), "counts", fit.dt, left)

    title = "x'' = push (u(t - delay) - friction(x') sign x') - drag x' + share (swing)"
    data = {"surprise": fit.surprise, "strokes": strokes, "swing_rms_m": fit.swing_rms}
    parts = Result("carriage", title, fit.model, lines, remarks, toml, draw, data)
    return _report.complete(parts, "counts", tests, curves)


def _predict(fit: CarriageFit, part: Mapping[str, Array], file: str) -> Pair:
    """Validation strokes, each simulated from its start."""
    from macromicro.identify import carriage

    r = carriage.cut_strokes(*_columns(part))
    if not r.strokes:
        remedy = "Record strokes from rest to rest."
        raise ProblemError(f"--test, {file}", "there is no stroke", remedy)
    t = np.asarray(part["t"])
    if abs(float(t[1] - t[0]) - fit.dt) > _SAME * fit.dt:
        found = f"its sample time is {t[1] - t[0]:.3g} s, that of the fit {fit.dt:.3g} s"
        raise ProblemError(f"--test, {file}", found, "Give a test with the fit's.")
    return Pair(file, t - t[0], r.counts, carriage.free_run(fit.model, r, fit.dt))


def _note(meaning: str, apart: tuple[float, float] | None) -> str:
    if apart is None:
        return meaning
    return f"{meaning}; {apart[0]:.3g} to {apart[1]:.3g} by each record alone"


def _columns(r: Mapping[str, Array]) -> tuple[Array, ...]:
    return tuple(r[name] for name in ("t", "u", "x", "y") if name in r)


def _pitch(
    records: Sequence[Mapping[str, Array]], told: str | None, file: str
) -> tuple[float, str]:
    if told is not None:
        pitch = quantity(told, "m", "--pitch")
        if not pitch > 0.0:
            raise InputError("--pitch", told, "a length above zero")
        return pitch, "as given"
    seen = [r for r in records if "y" in r]
    if not seen:
        remedy = "Give --pitch, or a column y of a laser."
        raise ProblemError("--pitch", "the travel per count is unknown", remedy)
    slope = float(np.polyfit(seen[0]["x"], seen[0]["y"], 1)[0])
    if not slope > 0.0:
        raise ProblemError(f"{file}, y", f"{slope:.3g} m a count", "The laser must rise with x.")
    return slope, "by the laser"
