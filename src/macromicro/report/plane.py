"""Report of the commissioning of two axes: a page of both, and each axis' own."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import macromicro
from macromicro.commission import procedure, report
from macromicro.commission.plane import Both
from macromicro.commission.running import Place
from macromicro.drawing import files as drawings
from macromicro.drawing.page import PageFigure, fill, save_figures
from macromicro.machines.joint.machine import XY_MACHINE
from macromicro.machines.joint.settings import AXES
from macromicro.machines.machine import JOINT
from macromicro.report import joint_figures
from macromicro.runs import folder
from macromicro.schema.text import write_text

HEADINGS = (
    *("move", "which", "to [mm]", "arrived after [s]", "profile [s]"),
    *("contour error, rms [um]", "peak [um]"),
)
DRAWN = ("path", "axes")
FILES = (*report.FILES, *drawings.names(DRAWN))


def why(found: Both) -> str:
    for name, one in zip(AXES, found.axes, strict=True):
        if not one.verified.met:
            return f"axis {name} alone: {report.why(one)}"
    if found.fault:
        return found.fault
    which = report.late(found.moves)
    return f"move {which} of both did not arrive within its tolerance" if which else ""


def rows(found: Both, places: tuple[Place, Place]) -> list[tuple[str, ...]]:
    """The results: quantity, value, half interval, unit."""
    each = zip(AXES, found.axes, places, strict=True)
    return [
        (f"{name}: {row[0]}", *row[1:]) for name, one, at in each for row in report.rows(one, at)
    ]


def doubts(found: Both, places: tuple[Place, Place]) -> list[str]:
    """Points to check before relying on the result."""
    each = zip(AXES, found.axes, places, strict=True)
    said = [f"{name}: {doubt}" for name, one, at in each for doubt in report.doubts(one, at)]
    said.append("The encoders cannot show whether the axes are square.")
    peak = max((m.contour.peak for m in found.moves if m.contour is not None), default=0.0)
    if 1e-3 * peak > found.settings.path.tolerance:
        said.append(
            f"Both together leave their path by up to {1e3 * peak:.3g} um; as closely as each "
            f"rests would be {1e6 * found.settings.path.tolerance:.3g} um."
        )
    return said


def move_rows(found: Both) -> list[tuple[str, ...]]:
    """The moves of both, under `HEADINGS`."""
    lines: list[tuple[str, ...]] = []
    for m in found.moves:
        target = f"{m.target[0]:.5g}, {m.target[1]:.5g}"
        arrived = "not" if m.arrived_s is None else f"{m.arrived_s:.3f}"
        c = m.contour
        errors = ("-", "-") if c is None else (f"{1e3 * c.rms:.3g}", f"{1e3 * c.peak:.3g}")
        lines.append((f"{m.move + 1}", m.name, target, arrived, f"{m.profile_s:.3f}", *errors))
    return lines


def as_json(found: Both, places: tuple[Place, Place]) -> str:
    each = zip(AXES, found.axes, places, strict=True)
    what: dict[str, Any] = {"kind": JOINT, "version": macromicro.__version__}
    what["axes"] = {name: json.loads(report.as_json(one, at)) for name, one, at in each}
    keys = ("move", "name", "target", "arrived_s", "profile_s")
    what["verification"] = {
        "met": found.met,
        "fault": found.fault,
        "moves": [
            {k: getattr(m, k) for k in keys}
            | ({} if m.contour is None else {"rms": m.contour.rms, "peak": m.contour.peak})
            for m in found.moves
        ],
    }
    what["doubts"] = doubts(found, places)
    return json.dumps(what, indent=2) + "\n"


def write(
    out: Path,
    found: Both,
    places: tuple[Place, Place],
    started: str,
    kinds: Sequence[str] = drawings.DEFAULT,
) -> None:
    """Write the results of both; each axis' own stay beside them."""
    signs = {procedure.sign(p.kind, f.work) for p, f in zip(places, found.axes, strict=True)}
    with folder.staging(out) as stage:
        write_text(stage / report.MACHINE, found.toml)
        write_text(stage / report.JSON, as_json(found, places))
        found.recording.save(stage / report.RECORDING)
        shown = save_figures(_figures(found), stage, kinds)
        text = fill(
            report.TEMPLATE,
            name=" and ".join(place.name for place in places),
            started=started,
            met=found.met,
            why=why(found),
            found=rows(found, places),
            note=f"{places[0].kind.note} What each step shows is in x/{report.PAGE} and "
            f"y/{report.PAGE}.",
            sign=signs.pop() if len(signs) == 1 else 0.0,
            doubts=doubts(found, places),
            headings=HEADINGS,
            moves=move_rows(found),
            pictures=shown,
            file=report.MACHINE,
            toml=found.toml,
        )
        write_text(stage / report.PAGE, text)


def _figures(found: Both) -> Iterator[PageFigure]:
    yield joint_figures.path(found.recording, found.plan, found.settings.path.tolerance)
    yield joint_figures.axes_over_time(found.recording, found.plan, XY_MACHINE, found.settings)
