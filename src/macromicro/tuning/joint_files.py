"""The folder of a tuning of a machine of two axes: settings that run, numbers, figure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import macromicro
from macromicro import place as places
from macromicro.columns import quantities
from macromicro.drawing import files as drawings
from macromicro.drawing.style import BLUE, GREEN, RED, finish, line, new
from macromicro.machines import composite, results, runs
from macromicro.machines.joint import contour
from macromicro.machines.machine import KEY
from macromicro.schema import config
from macromicro.schema.par import entries, value_at
from macromicro.tuning.joint import Tuning, Version
from macromicro.tuning.stage import ROUGH
from macromicro.tuning.stage_files import NUMBERS, SETTINGS, save
from macromicro.units import printed

FIGURE = "contour"
FILES = (SETTINGS, NUMBERS, *drawings.names((FIGURE,)))


class Row(NamedTuple):
    name: str  # what it is
    values: tuple[float, ...]  # in the order of the versions
    unit: str  # of all


def table(found: Tuning) -> list[Row]:
    versions = found.versions
    units = {e.path: printed(e.par.unit) for e in entries(versions[0].settings)}
    rows = [
        Row(path, tuple(float(value_at(v.settings, path)) for v in versions), units[path])
        for path in found.knobs
    ]
    for name, about in quantities(type(versions[0].found)).items():
        unit = "" if about.unit == "1" else about.unit
        rows.append(Row(about.meaning, tuple(getattr(v.found, name) for v in versions), unit))
    what, unit = ("contour", "um") if found.machine.has_plane else ("error in tolerances", "")
    rows.append(Row(f"cost ({what})", tuple(v.cost for v in versions), unit))
    return rows


def lines(found: Tuning) -> list[str]:
    told = [f"{'':62}" + "".join(f"{v.name:>12}" for v in found.versions)]
    for row in table(found):
        values = "".join(f"{value:12.5g}" for value in row.values)
        told.append(f"{row.name:62}{values} {row.unit}".rstrip())
    told.append(f"least cost: {found.best.name}")
    return told


def as_toml(found: Tuning) -> str:
    """Settings for ``macromicro run --config``."""
    head = (
        f"# {found.machine.title}: tuned for {found.objective.name} of each axis, then for the "
        f"contour: {found.best.name}\n"
        f"# {found.evaluations} designs, seed {found.seed}, macromicro {macromicro.__version__}\n"
    )
    body = config.changed_toml(found.best.settings, found.machine.settings, found.knobs)
    return f"{head}{KEY} = {found.machine.written}\n{body}"


def content(found: Tuning) -> dict[str, Any]:
    return {
        "machine": found.machine.name,
        "objective": {"name": found.objective.name, "meaning": found.objective.meaning},
        "penalties": {"rough": ROUGH},
        "evaluations": found.evaluations,
        "seed": found.seed,
        "version": macromicro.__version__,
        "versions": [v.name for v in found.versions],
        "best": found.best.name,
        "table": [row._asdict() for row in table(found)],
    }


def _errors(found: Tuning, version: Version, color: str) -> Iterator[tuple[Any, Any, str, str]]:
    """Times, errors, colours and labels: the distance from the path, or the error of each stage."""
    done = runs.record(found.machine, version.settings, found.plan, seed=found.seed, warn=False)
    r = done.recording
    if found.machine.has_plane:
        for k, trace in enumerate(found.plan.traces):
            part = results.under_way(r, found.plan, k)
            if trace.pieces and part.stop > part.start:
                x, y = (1e-3 * results.known(r[f"{n}_position"][part]) for n in "xy")
                yield r["t"][part], 1e6 * contour.off(trace, x, y).distance, color, ""
        return
    trees = found.machine.trees(version.settings)
    for k, (name, own) in enumerate(zip(composite.names(found.machine), trees, strict=True)):
        error = 1e3 * (r[f"{name}_target"] - r[f"{name}_position"])
        yield r["t"], error, f"C{k}", f"{name} [{places.of(own).fine}]"


def draw_figure(found: Tuning) -> Any:
    """The error with the gains of the sheets and with the best, for the same moves."""
    figure, axes = new(4.6, 2, sharex=True)
    plane = found.machine.has_plane
    what, unit = ("Distance from the path", "[um]") if plane else ("Set point minus position", "")
    both = ((found.versions[0], RED), (found.best, BLUE))
    for ax, (version, color) in zip(axes[:, 0], both, strict=True):
        for each in _errors(found, version, color):
            line(ax, *each)
        if plane:
            tolerance = 1e6 * version.settings.path.tolerance
            ax.axhline(tolerance, color=GREEN, linewidth=0.8, linestyle=":")
        title = f"{what}, {version.name}{'; dotted: tolerance' if plane else ''}"
        finish(ax, title, "time [s]" if ax is axes[-1, 0] else "", unit, legend=not plane)
    ends = [end for ax in axes[:, 0] for end in ax.get_ylim()]
    for ax in axes[:, 0]:
        ax.set_ylim(0.0 if plane else min(ends), max(ends))
    return figure


def write(out: Path, found: Tuning, kinds: Sequence[str]) -> None:
    save(out, as_toml(found), content(found), (FIGURE, draw_figure(found)), kinds)
