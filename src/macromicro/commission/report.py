"""Results of a commissioning: page, figures, JSON, and the machine's file."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import macromicro
from macromicro.commission import _store, _verifying, procedure
from macromicro.commission.procedure import Kind
from macromicro.commission.running import Commissioned, Place
from macromicro.drawing import files as drawings
from macromicro.drawing.page import PageFigure, fill, save_figures
from macromicro.drawing.style import BLACK, BLUE, RED, finish, line, new
from macromicro.place import LENGTH
from macromicro.place import Place as Unit
from macromicro.runs import folder
from macromicro.schema.text import write_text
from macromicro.units import readable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from macromicro.recording import Recording


def verification(recording: Recording, place: Unit = LENGTH) -> Figure:
    figure, axes = new(5.0, 3, sharex=True)
    t, x, target = (np.asarray(recording[c], float) for c in ("t", "position", "target"))
    line(axes[0, 0], t, target, BLACK, "target", linestyle=":")
    line(axes[0, 0], t, x, BLUE, "position")
    line(axes[1, 0], t, (x - target) * 1e3, BLUE, "error")
    line(axes[2, 0], t, np.asarray(recording["effort"], float), RED, "effort")
    title = "Verification: moves that were not used before"
    finish(axes[0, 0], title, "", f"[{place.unit}]", legend=True)
    finish(axes[1, 0], "error", "", f"[{place.fine}]")
    finish(axes[2, 0], "effort", "time [s]", "[V]")
    return figure


PAGE, JSON, MACHINE = "commission.html", "commission.json", "machine.toml"
RECORDING, VERIFICATION = "verification.h5", "verification"
FILES = (PAGE, JSON, MACHINE, RECORDING)
BYTES = 30_000_000
_COUNTS = 5.0  # within which an axis rests that friction does not keep off
TEMPLATE = Path(__file__).parent / "templates" / "commission.html.j2"


def headings(place: Unit) -> tuple[str, ...]:
    return (
        "move",
        f"to [{place.unit}]",
        "arrived after [s]",
        "profile [s]",
        f"greatest error [{place.fine}]",
        f"overshoot [{place.fine}]",
        f"error at rest [{place.fine}]",
    )


def doubts(found: Commissioned, place: Place) -> list[str]:
    turned = procedure.sign(place.kind, found.work) < 0.0
    said = list(place.kind.doubts(found.work, found.model))
    said += [*found.tuned.doubts, *found.margins.doubts]
    rests = found.settings.arrival.tolerance
    if place.kind.rehearse is not None and rests > _COUNTS * place.pitch:
        unit = place.kind.place
        said.append(
            f"With its friction and lag the axis settles within {rests * unit.fines:.3g} "
            f"{unit.fine}, {rests / place.pitch:.3g} counts: that is the tolerance of its "
            "moves."
        )
    if found.rested is not None:
        said.append("The model did not settle as closely as friction and lag suggest.")
    return [place.kind.turned, *said] if turned else said


def as_json(found: Commissioned, place: Place) -> str:
    kind = place.kind
    what: dict[str, Any] = {"of": place.name, "kind": kind.name, "version": macromicro.__version__}
    for step in kind.steps:
        if step.result is not None:
            what[step.name] = found.work[step.name]._asdict()
    what["model"] = {
        name: {"value": one.value, "half_width_95": one.half, "unit": one.unit}
        for name, one in kind.estimates(found.model).items()
    }
    what["tuned"] = [list(row) for row in found.tuned.rows]
    what["margins"] = [list(row) for row in found.margins.rows]
    what["verification"] = {
        "met": found.verified.met,
        "fault": found.verified.fault,
        "moves": [m._asdict() for m in found.verified.moves],
    }
    what["doubts"] = doubts(found, place)
    return json.dumps(what, indent=2) + "\n"


def rows(found: Commissioned, place: Place) -> list[tuple[str, ...]]:
    """Results, a line each: quantity, value, half interval, unit."""
    lines = place.kind.rows(found.work)
    for one in place.kind.estimates(found.model).values():
        scale, unit = readable(one.value, one.unit)
        half = float(f"{scale * one.half:.2g}")
        lines.append((one.meaning, f"{scale * one.value:.4g}", f"+- {half:g}", unit))
    return [*lines, *found.tuned.rows, *found.margins.rows]


def move_rows(found: Commissioned) -> list[tuple[str, ...]]:
    """Moves of the verification, under `headings`."""
    lines = []
    for m in found.verified.moves:
        arrived = "not" if m.arrived_s is None else f"{m.arrived_s:.3f}"
        errors = (m.peak_error, m.overshoot, m.rest_error)
        shown = ("-" if v is None else f"{v * 1e3:.3g}" for v in errors)
        lines.append((f"{m.move + 1}", f"{m.target:.6g}", arrived, f"{m.profile_s:.3f}", *shown))
    return lines


def why(found: Commissioned) -> str:
    if found.verified.fault:
        return found.verified.fault
    which = late(found.verified.moves)
    return f"move {which} did not arrive within its tolerance" if which else ""


def late(moves: Iterable[Any]) -> str:
    return ", ".join(str(m.move + 1) for m in moves if m.arrived_s is None)


def write(
    out: Path,
    found: Commissioned,
    place: Place,
    started: str,
    kinds: Sequence[str] = drawings.DEFAULT,
) -> None:
    """Write all files or none, beside those of the steps."""
    work, kind = found.work, place.kind
    with folder.staging(out) as stage:
        write_text(stage / MACHINE, found.toml)
        write_text(stage / JSON, as_json(found, place))
        found.verified.recording.save(stage / RECORDING)
        text = fill(
            TEMPLATE,
            name=place.name,
            started=started,
            met=found.verified.met,
            why=why(found),
            found=rows(found, place),
            note=kind.note,
            sign=procedure.sign(kind, work),
            doubts=doubts(found, place),
            headings=headings(kind.place),
            moves=move_rows(found),
            pictures=save_figures(_figures(found, kind), stage, kinds),
            file=MACHINE,
            toml=found.toml,
        )
        write_text(stage / PAGE, text)


def _figures(found: Commissioned, kind: Kind) -> Iterator[PageFigure]:
    for name, one in kind.figures.items():
        yield PageFigure(name, one.title, one.caption, one.figure(found.work, found.model))
    yield PageFigure(
        VERIFICATION,
        "Verification",
        "Verification moves, not used before, with the gains that follow from the model.",
        verification(found.verified.recording, kind.place),
    )


def names(kind: Kind) -> tuple[str, ...]:
    """All files that a commissioning may write."""
    drawn = drawings.names((*kind.figures, VERIFICATION))
    return (*FILES, *drawn, *(_store.file(step) for step in _verifying.kept_steps(kind)))
