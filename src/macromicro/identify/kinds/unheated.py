"""`identify actuator` without a kiln's table: from drive and position alone."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import ProblemError
from macromicro.identify.kinds import model_file, testing
from macromicro.identify.kinds.loading import Picking, loaded
from macromicro.identify.kinds.testing import Trial
from macromicro.identify.picking import RUN, Picked, Role, runs
from macromicro.identify.result import Line, Result
from macromicro.identify.runs import checked

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.figure import Figure

    from macromicro.identify._unheated import Heated, Unheated, UnheatedFit

_LEAST = 50  # samples of a record
_MEANS = {
    "wire": ("s", "time constant of the wires"),
    "r1": ("", "resistance wires to plates"),
    "plates": ("s", "time constant of what is next to them"),
    "r2": ("", "resistance plates to body"),
    "body": ("s", "heat capacity of the body"),
    "latent": ("K", "latent heat over the wires' capacity"),
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


def identify(
    what: Picking,
    roles: tuple[Role, Role, Role, Role],
    ambient: float | None,
    austenite: float | None,
    tests: tuple[str, ...],
) -> Result:
    """Heat, ladder, latent heat, stress, expansion and relays; `ambient`, `austenite` in deg C."""
    from macromicro.identify._unheated import AUSTENITE, unheated
    from macromicro.identify.actuator import AMBIENT

    wanted = (*roles, RUN)
    tables = loaded(what, wanted)
    others = testing.unseen(tests, what, wanted, tables[0])
    records = [one for table in tables for one in _records(table)]
    room = AMBIENT if ambient is None else ambient
    median = AUSTENITE if austenite is None else austenite
    fit = unheated(records, room, median)
    u = tables[0].units["u"] or "u"
    lines = [
        Line(name, value, fit.std[name], *_meaning(name, u)) for name, value in fit.values.items()
    ]
    trials = [_tried(fit.model, one, table.file) for table in others for one in _records(table)]
    lines += testing.lines(trials, "mm")
    share = 100.0 * fit.rms / fit.range
    remarks = [
        ("fit", f"{1e3 * fit.rms:.3g} um RMS, {share:.2f} % of the range, {len(records)} records"),
        (
            "scale of temperature",
            f"half contracted at {median:g} degC while it warms; given, not identified",
        ),
    ]
    if trials:
        worst = max(100.0 * t.rms / fit.range for t in trials)
        remarks.append(("test records", f"{worst:.2f} % of the range at most"))
    data: dict[str, Any] = {
        "rms_mm": fit.rms,
        "range_mm": fit.range,
        "austenite": median,
        "ambient": room,
        "tests": testing.data(trials),
    }

    def draw() -> dict[str, Figure]:
        from macromicro.identify.kinds import pictures

        times = [np.arange(len(r.u), dtype=np.float64) * r.dt for r in records]
        seen = [r.x for r in records]
        heat = [("heat map", fit.model.wires.volts, fit.model.wires.heat, "o-")]
        return {
            "free_run": testing.drawn(times, seen, fit.free_run, trials, "contraction [mm]"),
            "branches": _branches(fit),
            "heat": pictures.points("final warming of the wires", f"drive [{u}]", "[K]", heat),
        }

    title = "c1 T' = heat(u) - (T - plates) / r1, less latent heat; relays at T, less stress"
    return Result("actuator", title, fit.model, lines, remarks, _toml(lines, fit), draw, data)


def _meaning(name: str, u: str) -> tuple[str, str]:
    if name.startswith("heat "):
        return "K", f"final warming of the wires by so many {u}"
    return _MEANS[name]


def _records(file: Picked) -> list[Heated]:
    """Runs of a file, each from cold; the drive is 0 while a switch interrupts it."""
    from macromicro.identify._unheated import Heated

    made = []
    for part in runs(file):
        run = checked(part["t"], part["u"], part["x"], file.file, _LEAST)
        u = run.u
        if "c" in part and len(part["c"]) == len(u):
            u = np.where(part["c"] > 0.5, 0.0, u)
        made.append(Heated(u, run.x, run.dt))
    return made


def _tried(model: Unheated, record: Heated, file: str) -> Trial:
    from macromicro.identify._unheated import simulate

    t = np.arange(len(record.u), dtype=np.float64) * record.dt
    return Trial(file, t, record.x, simulate(model, record.u, record.dt))


def _branches(fit: UnheatedFit) -> Figure:
    from macromicro.identify.kinds import pictures

    table = fit.table
    last = len(table.values) - 1
    at = table.lo + table.step * np.arange(last + 1, dtype=np.float64)
    rise: Array = table.f_low + table.values[:, 0]
    fall: Array = table.f_low + table.span - table.values[last, :]
    return pictures.points(
        "branches without load, by the temperature that is counted in",
        "temperature [degC]",
        "contraction [mm]",
        [("while it warms", at, rise, "-"), ("while it cools", at, fall, "-")],
    )


def _toml(lines: list[Line], fit: UnheatedFit) -> str:
    head = "An actuator from drive and position alone, for other programs. Not for\n"
    head += "`macromicro run --config`, which takes one that was found with the kiln's table."
    values: dict[str, tuple[model_file.Value, str]] = {"range": (fit.range, "mm")}
    for line in lines:
        if line.name.startswith("test"):
            continue
        spread = "" if math.isnan(line.error) else f"+- {line.error:.2g}"
        name = line.name.replace(" ", "_").replace(".", "p")
        values[name] = float(line.value), ", ".join(filter(None, (line.unit, spread)))
    return model_file.plain(head, {"actuator": values})


def refused(table: Path | None, austenite: float | None) -> None:
    if table is not None and austenite is not None:
        raise ProblemError(
            "--austenite",
            "it cannot be combined with --table, whose temperatures were measured",
            "Remove one of them.",
        )
