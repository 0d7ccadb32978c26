"""`identify drive --structure lugre` and `gms`: friction that is elastic before it slides."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.identify import _report
from macromicro.identify._report import Curves
from macromicro.identify.driven import Driven
from macromicro.identify.kinds import drive_words, model_file, testing
from macromicro.identify.records import fit_percent
from macromicro.identify.result import Line, Result
from macromicro.identify.runs import Run

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from macromicro.identify.presliding_fit import PreslidingFit

MEANINGS = {
    "mass": "inertia",
    "viscous": "viscous friction",
    "offset": "constant force",
    "asymmetry": "viscous, excess of forwards over backwards",
    "stribeck": "breakaway above Coulomb",
    "stribeck_speed": "speed over which that fades",
    "stiffness": "before it slides",
    "settling": "presliding damping over that stiffness",
}


class Records(NamedTuple):
    runs: list[Run]  # that are fitted
    tests: list[tuple[str, Run]]  # file and record of those that are not
    force: str  # unit of the force
    place: str  # unit of the position
    units: dict[str, str]  # of the parameters that an axis with rigid friction has


def identify(records: Records, friction: str, along: int | None, driven: Driven) -> Result:
    from macromicro.identify.presliding_fit import presliding_drive

    runs, place = records.runs, records.place
    fit = presliding_drive(
        [r.t for r in runs],
        [r.u for r in runs],
        [r.x for r in runs],
        friction=friction,
        along=along,
        gain=driven.gain,
        limit=driven.limit,
        delay=driven.delay,
    )
    lines = _lines(fit, records)
    trials = [testing.driven(fit, run, file) for file, run in records.tests]
    percent = fit_percent([r.x for r in runs], fit.free_run)
    samples = sum(len(r.t) for r in runs)
    remarks = [
        ("fit", f"free run {percent:.2f} %, RMS {fit.rms:.4g} {place} over {samples} samples"),
        ("structure", _judged(fit, place)),
        drive_words.slow("offset"),
    ]
    nodes = _nodes(fit)
    if len(nodes) > 1:
        at = ", ".join(f"{x:.4g}" for x in nodes)
        remarks.append(("levels", f"of the Coulomb friction at {at} {place}, linear between"))
    remarks += drive_words.repeated(fit.repeats, records.force, records.place)
    remarks += drive_words.late(driven.delay)
    data = {
        "structure": friction,
        "taken": fit.taken,
        "judged": fit.judged,
        "reasons": fit.reasons,
        "rms": fit.rms,
        "fit_percent": percent,
        "gain": fit.gain,
        "delay": fit.delay,
        "nodes": nodes,
    }

    def curves() -> Curves:
        t, x = [r.t for r in runs], [r.x for r in runs]
        return Curves(
            _report.pairs(t, x, fit.free_run), f"position [{place}]", runs[0].dt, fit.residuals
        )

    def draw() -> dict[str, Figure]:
        from macromicro.identify.kinds import pictures

        if len(nodes) < 2:
            return {}
        levels = [("Coulomb friction", nodes, fit.model.levels, "o-")]
        title, label = "friction along the travel", f"position [{place}]"
        return {"along": pictures.points(title, label, f"[{records.force}]", levels)}

    title = "M dv/dt = gain u - (Fv +- Fa) v - (f + tau df/dt) - F0, f elastic up to Fc(x) + Fs"
    parts = Result("drive", title, fit.model, lines, remarks, _toml(lines, fit), draw, data)
    return _report.completed(parts, place, trials, curves)


def _nodes(fit: PreslidingFit) -> Array:
    model = fit.model
    return np.linspace(model.low, model.high, len(model.levels))


def _lines(fit: PreslidingFit, records: Records) -> list[Line]:
    units = records.units | {"settling": "s"}
    force, place = records.units["coulomb"], records.place
    units["stiffness"] = f"{force}/{place}" if force else ""
    lines: list[Line] = []
    every = zip(fit.names, fit.values, fit.std, fit.factors[1].tolist(), strict=True)
    for name, value, error, factor in every:
        kind = name.split(maxsplit=1)[0]
        if kind == "level":
            many = len(fit.model.levels) > 1
            note = "Coulomb friction"
            if many:
                note += f" at {_nodes(fit)[len(_of(lines, 'level'))]:.4g} {place}"
            lines.append(Line(name if many else "coulomb", value, error, force, note, factor))
        elif kind == "share":
            note = "of the friction in this element"
            lines.append(Line(name, value, error, "", note, factor))
        else:
            lines.append(Line(name, value, error, units[name], MEANINGS[name], factor))
    return lines


def _of(lines: list[Line], kind: str) -> list[Line]:
    return [line for line in lines if line.name.startswith(kind)]


def _judged(fit: PreslidingFit, place: str) -> str:
    """The structures tried and their scores, in words."""
    told = []
    for name, error in fit.judged.items():
        why = "taken" if name == fit.taken else fit.reasons.get(name, "")
        told.append(f"{name} {error:.4g}" + (f": {why}" if why else ""))
    return f"RMS of free runs over pieces held out, in {place}: " + "; ".join(told)


def _toml(lines: list[Line], fit: PreslidingFit) -> str:
    head = "A motor-driven axis whose friction is elastic before it slides: parameters by output\n"
    head += "error, for other programs. Not for `macromicro run --config`."
    values: dict[str, tuple[model_file.Value, str]] = {"friction": (fit.friction, "")}
    for line in lines:
        if line.name.startswith("test"):
            continue
        spread = "" if math.isnan(line.error) else f"+- {line.error:.2g}"
        name = line.name.replace(" ", "_")
        values[name] = float(line.value), ", ".join(filter(None, (line.unit, spread)))
    if len(fit.model.levels) > 1:
        values["low"] = (fit.model.low, "place of the first level")
        values["high"] = (fit.model.high, "place of the last one")
    return model_file.plain(head, {"drive": values})
