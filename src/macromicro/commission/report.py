"""What a commissioning gives a person: page, figures, JSON, and the machine's file."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import macromicro
from macromicro.commission import figures, store
from macromicro.commission.model import UNITS
from macromicro.commission.running import EXCHANGE, Commissioned, Place
from macromicro.drawing import files as drawings
from macromicro.drawing.page import Picture, filled
from macromicro.runs import folder

PAGE, JSON, MACHINE = "commission.html", "commission.json", "machine.toml"
RECORDING = "verification.h5"
FILES = (PAGE, JSON, MACHINE, RECORDING, *drawings.names(figures.FIGURES))
BYTES = 30_000_000
TEMPLATE = Path(__file__).parent / "templates" / "commission.html.j2"
MEANINGS = {
    "mass": "mass",
    "viscous": "viscous friction and back-EMF",
    "coulomb": "sliding friction",
    "offset": "constant force",
    "lag": "lag of the effort",
}
HEADINGS = (
    "move",
    "to [mm]",
    "arrived after [s]",
    "profile [s]",
    "greatest error [um]",
    "overshoot [um]",
    "error at rest [um]",
)
_WIDE = 0.2  # an interval that is a larger part of its value is doubtful
_UNEVEN = 0.3  # friction that differs by more along the travel
_CAPTIONS = {
    figures.FRICTION: (
        "Friction over position",
        "Effort that starts the axis, both ways, and the model's sliding friction.",
    ),
    figures.STROKES: (
        "Strokes and model",
        "Some strokes, and the model's free run from the same start under the same effort.",
    ),
    figures.VERIFICATION: (
        "Verification",
        "Moves that nothing was fitted to, by the gains that follow from the model.",
    ),
}


def doubts(found: Commissioned) -> list[str]:
    """What a person should look at before the result is relied on.

    Parameters
    ----------
    found : Commissioned
        Everything.

    Returns
    -------
    list[str]
        A sentence each.
    """
    work, model = found.work, found.model
    said = []
    if work.direction.sign < 0.0:
        said.append(EXCHANGE)
    if not work.ends.found:
        said.append("The window was named; no end stop was felt for.")
    known = [e for e in (*work.friction.forward, *work.friction.backward) if not math.isnan(e)]
    spread = (max(known) - min(known)) / work.friction.mean
    if spread > _UNEVEN:
        said.append(
            f"What starts the axis differs by {spread:.0%} along the travel and between the "
            "directions: dirt, a bent rail, or a weight?"
        )
    if model.axis.limit < work.options.effort:
        said.append(
            f"The drive's current gives a force of {model.axis.limit:.3g} V of "
            f"{work.options.effort:.3g} V at most."
        )
    for name in ("mass", "coulomb"):
        value, half = getattr(model.axis, name), model.half_width(name)
        if half > _WIDE * value:
            said.append(
                f"The {MEANINGS[name]} is known to {half / value:.0%} only: a longer travel, or a "
                "larger effort, would show it better."
            )
    if model.axis.lag > 3.0 * work.stand.dt:
        said.append(
            f"Efforts act {model.axis.lag * 1e3:.2g} ms late, {model.axis.lag / work.stand.dt:.2g} "
            "control periods: the drive or the bus is slow, and so are the gains."
        )
    return said


def as_json(found: Commissioned, place: Place) -> str:
    """All results as JSON.

    Parameters
    ----------
    found : Commissioned
        Everything.
    place : Place
        What was commissioned.

    Returns
    -------
    str
        One object.
    """
    model = found.model
    what: dict[str, Any] = {
        "of": place.name,
        "version": macromicro.__version__,
        "direction": found.work.direction._asdict(),
        "ends": found.work.ends._asdict(),
        "friction": found.work.friction._asdict(),
        "model": {
            name: {
                "value": getattr(model.axis, name),
                "half_width_95": model.half_width(name),
                "unit": UNITS[name],
            }
            for name in model.names
        },
        "rms_of_strokes_m": model.rms,
        "verification": {
            "met": found.verified.met,
            "fault": found.verified.fault,
            "moves": [m._asdict() for m in found.verified.moves],
        },
        "doubts": doubts(found),
    }
    return json.dumps(what, indent=2) + "\n"


def rows(found: Commissioned) -> list[tuple[str, ...]]:
    """What was found, a line each: quantity, value, half interval, unit.

    Parameters
    ----------
    found : Commissioned
        Everything.

    Returns
    -------
    list[tuple[str, ...]]
        Text.
    """
    work, model = found.work, found.model
    lines: list[tuple[str, ...]] = [
        ("travel", f"{work.ends.travel * 1e3:.5g}", "", "mm"),
        ("starts forwards at", f"{work.direction.forward:.3g}", "", "V"),
        ("starts backwards at", f"{work.direction.backward:.3g}", "", "V"),
    ]
    for name in model.names:
        value, half = getattr(model.axis, name), model.half_width(name)
        lines.append((MEANINGS[name], f"{value:.4g}", f"+- {half:.2g}", UNITS[name]))
    return lines


def move_rows(found: Commissioned) -> list[tuple[str, ...]]:
    """How the moves of the verification went, under `HEADINGS`.

    Parameters
    ----------
    found : Commissioned
        Everything.

    Returns
    -------
    list[tuple[str, ...]]
        Text.
    """
    lines = []
    for m in found.verified.moves:
        figures_ = (m.peak_error, m.overshoot, m.rest_error)
        lines.append(
            (
                f"{m.move + 1}",
                f"{m.target:.4f}",
                "not" if m.arrived_s is None else f"{m.arrived_s:.3f}",
                f"{m.profile_s:.3f}",
                *("-" if v is None else f"{v * 1e3:.1f}" for v in figures_),
            )
        )
    return lines


def why(found: Commissioned) -> str:
    """Why the verification was not met.

    Parameters
    ----------
    found : Commissioned
        Everything.

    Returns
    -------
    str
        In words; "" where it was.
    """
    if found.verified.fault:
        return found.verified.fault
    late = [str(m.move + 1) for m in found.verified.moves if m.arrived_s is None]
    return f"move {', '.join(late)} did not arrive within its tolerance" if late else ""


def write(
    out: Path,
    found: Commissioned,
    place: Place,
    started: str,
    kinds: Iterable[str] = drawings.DEFAULT,
) -> None:
    """Write everything, all of it or nothing; what steps found stays beside it.

    Parameters
    ----------
    out : Path
        The folder.
    found : Commissioned
        Everything.
    place : Place
        What was commissioned.
    started : str
        When, in words.
    kinds : Iterable[str], optional
        Formats of the figures.

    Raises
    ------
    OSError
        The disk refuses.
    """
    work = found.work
    drawn = {
        figures.FRICTION: figures.friction(work.friction, found.model),
        figures.STROKES: figures.strokes(work.strokes, found.model, work.stand.dt),
        figures.VERIFICATION: figures.verification(found.verified.recording),
    }
    with folder.staged(out) as stage:
        (stage / MACHINE).write_text(found.toml, encoding="utf-8")
        (stage / JSON).write_text(as_json(found, place), encoding="utf-8")
        found.verified.recording.save(stage / RECORDING)
        pictures = []
        for name, figure in drawn.items():
            data = drawings.save(figure, stage, name, kinds)
            pictures.append(Picture(name, *_CAPTIONS[name], data))
        text = filled(
            TEMPLATE,
            name=place.name,
            started=started,
            version=macromicro.__version__,
            met=found.verified.met,
            why=why(found),
            found=rows(found),
            sign=work.direction.sign,
            doubts=doubts(found),
            headings=HEADINGS,
            moves=move_rows(found),
            pictures=pictures,
            file=MACHINE,
            toml=found.toml,
        )
        (stage / PAGE).write_text(text, encoding="utf-8")


def names() -> tuple[str, ...]:
    """All files that a commissioning may leave.

    Returns
    -------
    tuple[str, ...]
        Names, from its folder.
    """
    return (*FILES, *store.names())
