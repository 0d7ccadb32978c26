"""`identify actuator` without a kiln's table: from drive and position alone."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import ProblemError
from macromicro.identify import _report
from macromicro.identify._report import Curves, Pair
from macromicro.identify.kinds import model_file
from macromicro.identify.kinds.loading import Picking, loaded
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
    from macromicro.identify.heating import AMBIENT

    wanted = (*roles, RUN)
    tables = loaded(what, wanted)
    others = _report.unseen(tests, what, wanted, tables[0])
    records = [one for table in tables for one in _records(table)]
    room = AMBIENT if ambient is None else ambient
    median = AUSTENITE if austenite is None else austenite
    fit = unheated(records, room, median)
    u = tables[0].units["u"] or "u"
    lines = [
        Line(name, value, fit.std[name], *_meaning(name, u)) for name, value in fit.values.items()
    ]
    unseen = [_predicted(fit.model, one, table.file) for table in others for one in _records(table)]
    share = 100.0 * fit.rms / fit.range
    remarks = [
        ("fit", f"{1e3 * fit.rms:.3g} um RMS, {share:.2f} % of the range, {len(records)} records"),
        (
            "scale of temperature",
            f"half contracted at {median:g} degC while it warms; given, not identified",
        ),
    ]
    if unseen:
        worst = max(100.0 * t.rms / fit.range for t in unseen)
        remarks.append(("test records", f"{worst:.2f} % of the range at most"))
    data: dict[str, Any] = {
        "rms_mm": fit.rms,
        "range_mm": fit.range,
        "austenite": median,
        "ambient": room,
    }

    def draw() -> dict[str, Figure]:
        wires = fit.model.wires
        heat = heat_map(wires.volts, wires.heat, f"drive [{u}]")
        return {"branches": _branches(fit), "heat": heat}

    def curves() -> Curves:
        times = [np.arange(len(r.u), dtype=np.float64) * r.dt for r in records]
        free = _report.pairs(times, [r.x for r in records], fit.free_run)
        return Curves(free, "contraction [mm]", records[0].dt)

    title = "c1 T' = heat(u) - (T - plates) / r1, less latent heat; relays at T, less stress"
    parts = Result("actuator", title, fit.model, lines, remarks, _toml(lines, fit), draw, data)
    return _report.completed(parts, "mm", unseen, curves)


def heat_map(drive: Array, heat: Array, label: str) -> Figure:
    from macromicro.identify.kinds import pictures

    series = [("heat map", drive, heat, "o-")]
    return pictures.points("final warming of the wires", label, "[K]", series)


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


def _predicted(model: Unheated, record: Heated, file: str) -> Pair:
    from macromicro.identify._unheated import simulate

    t = np.arange(len(record.u), dtype=np.float64) * record.dt
    return Pair(file, t, record.x, simulate(model, record.u, record.dt))


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
    values = {"range": (fit.range, "mm"), **_report.notes(lines, point="p")}
    return model_file.plain(head, {"actuator": values})


def refused(table: Path | None, austenite: float | None) -> None:
    if table is not None and austenite is not None:
        raise ProblemError(
            "--austenite",
            "it cannot be combined with --table, whose temperatures were measured",
            "Remove one of them.",
        )
