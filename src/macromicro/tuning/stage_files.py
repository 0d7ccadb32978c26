"""The folder of a tuning of a machine of one stage: settings that run, numbers, figure."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import macromicro
from macromicro.columns import quantities
from macromicro.drawing import files as drawings
from macromicro.drawing.style import BLACK, BLUE, RED, finish, line, new
from macromicro.machines import runs
from macromicro.machines.machine import KEY
from macromicro.machines.trial import Trial
from macromicro.runs import folder
from macromicro.schema import config
from macromicro.schema.par import entries, value_at
from macromicro.schema.text import plain, write_text
from macromicro.tuning.stage import OVERSHOOT, ROUGH, Tuning, knobs, terms
from macromicro.units import printed

SETTINGS, NUMBERS, FIGURE = "tuned.toml", "tuning.json", "response"
FILES = (SETTINGS, NUMBERS, *drawings.names((FIGURE,)))


def table(found: Tuning) -> list[tuple[str, float, float, str]]:
    units = {e.path: printed(e.par.unit) for e in entries(found.start)}
    lines = [
        (path, value_at(found.start, path), value_at(found.tuned, path), units[path])
        for path in knobs(found.machine, found.tuned)
    ]
    place = found.machine.kind.place
    several = ", nominal" if len(found.before) > 1 else ""
    for name, about in quantities(Trial, place).items():
        unit = "" if about.unit == "1" else about.unit
        now = [getattr(t[0], name) for t in (found.before, found.after)]
        lines.append((about.meaning + several, now[0], now[1], unit))
    which = f", worst of {len(found.before)} machines" if several else ""
    if not several:
        parts = [terms(found.objective, t[0], found.start) for t in (found.before, found.after)]
        for (name, was), (_, new) in zip(*parts, strict=True):
            lines.append((f"  {name}", was, new, found.objective.unit))
    lines.append((f"objective{which}", *found.costs, found.objective.unit))
    if found.fresh[0]:
        late = [sum(t.fault != 0.0 or t.missed > 0.0 for t in group) for group in found.fresh]
        of = f"of {len(found.fresh[0])} fresh machines, those with a fault or without arrival"
        lines.append((of, float(late[0]), float(late[1]), ""))
        middle = [float(np.nanmedian([t.rms_error for t in group])) for group in found.fresh]
        lines.append(("on them, median rms error on the way", middle[0], middle[1], place.fine))
    return lines


def lines(found: Tuning) -> list[str]:
    told = [
        f"{name:66} {before:12.5g} {after:12.5g} {unit}".rstrip()
        for name, before, after, unit in table(found)
    ]
    told.append(f"{found.evaluations} designs were tried")
    if not found.better:
        told.append("none was better than the start, whose gains stay")
    return told


def as_toml(found: Tuning) -> str:
    """Settings for ``macromicro run --config``."""
    head = (
        f"# {found.machine.title}: {found.machine.law.name}, tuned for {found.objective.name}\n"
        f"# {found.evaluations} designs, seed {found.seed}, macromicro {macromicro.__version__}\n"
    )
    body = config.changed_toml(
        found.tuned, found.machine.settings, knobs(found.machine, found.tuned)
    )
    return f"{head}{KEY} = {found.machine.written}\n{body}"


def content(found: Tuning) -> dict[str, Any]:
    return {
        "machine": found.machine.name,
        "law": found.machine.law.name,
        "objective": {"name": found.objective.name, "meaning": found.objective.meaning},
        "penalties": {"overshoot": OVERSHOOT, "rough": ROUGH},
        "evaluations": found.evaluations,
        "seed": found.seed,
        "version": macromicro.__version__,
        "machines": len(found.before),
        "table": [{"name": n, "before": b, "after": a, "unit": u} for n, b, a, u in table(found)],
    }


def draw_figure(found: Tuning) -> Any:
    figure, axes = new(5.2, 2, sharex=True)
    for tree, color, label in ((found.start, RED, "before"), (found.tuned, BLUE, "after")):
        run = runs.record(found.machine, tree, found.plan, seed=found.seed, warn=False).recording
        line(axes[0, 0], run["t"], (run["target"] - run["position"]) * 1e3, color, label)
        line(axes[1, 0], run["t"], run["effort"], color, label)
    place = found.machine.kind.place
    band = found.start.arrival.tolerance * place.fines
    for edge in (-band, band):
        axes[0, 0].axhline(edge, color=BLACK, linewidth=0.8, linestyle=":")
    finish(
        axes[0, 0],
        "Set point minus position; dotted: tolerance",
        "",
        f"[{place.fine}]",
        legend=True,
    )
    finish(axes[1, 0], "Effort at the D/A", y="[V]", legend=True)
    return figure


def write(out: Path, found: Tuning, kinds: Sequence[str]) -> None:
    save(out, as_toml(found), content(found), (FIGURE, draw_figure(found)), kinds)


def save(
    out: Path, settings: str, numbers: Any, picture: tuple[str, Any], kinds: Sequence[str]
) -> None:
    """Write settings, numbers and a figure, or none of them."""
    name, figure = picture
    with folder.staged(out, remove=(SETTINGS, NUMBERS, *drawings.names((name,)))) as place:
        write_text(place / SETTINGS, settings)
        text = json.dumps(plain(numbers), indent=2, allow_nan=False)
        write_text(place / NUMBERS, text + "\n")
        drawings.save(figure, place, name, kinds)
