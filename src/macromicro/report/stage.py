"""Table, summary, figures and page of a run of a machine of one stage."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

import macromicro
from macromicro.drawing.page import Picture
from macromicro.drawing.style import BLACK, BLUE, GREEN, ORANGE, RED, finish, line, new
from macromicro.machines.job import Ended
from macromicro.machines.machine import as_toml
from macromicro.machines.tree import gains
from macromicro.report import machine_page
from macromicro.report.figures import Drawn
from macromicro.report.words import Line, amount
from macromicro.runs import folder
from macromicro.schema.par import entries

HEADINGS = (
    "#",
    "stage",
    "target",
    "arrival",
    "profile",
    "peak error",
    "rms error",
    "overshoot",
    "error at rest",
    "true error",
)
RATES = ("m/s", "m/s^2", "m/s^3")  # units of the motion's limits, on a slide
_GAINS = 4  # that a line tells; the page has all
_FOOTNOTE = (
    "Arrival runs from the move's start until the reading stays within the tolerance. Peak and "
    "rms error are the distance from the set point while the profile lasts. The error at rest is "
    "the target minus the mean reading over the hold's last 0.1 s; the true error the same of "
    "the load's true position, which no controller sees."
)


def table(ended: Ended) -> list[Line]:
    """One line a move.

    Parameters
    ----------
    ended : Ended
        The run.

    Returns
    -------
    list[Line]
        Text with units, in the order of `HEADINGS`.
    """
    lines = []
    # Errors of a stage that is exact to nanometres would all read 0.00 um.
    place = ended.job.machine.kind.place
    fine = ended.job.settings.arrival.tolerance < place.smallest
    unit, scale = (place.finest, 1e6) if fine else (place.fine, 1e3)
    for m in ended.moves:
        lost = "did not arrive" if m.complete else "cut short"
        cells = (
            str(m.move + 1),
            ended.job.machine.kind.name,
            f"{m.target:.6g} {place.unit}",
            lost if m.arrived_s is None else f"{m.arrived_s:.3f} s",
            f"{m.profile_s:.3f} s",
            amount(m.peak_error * scale, 1, unit),
            amount(m.rms_error * scale, 1, unit),
            *(
                amount(None if x is None else x * scale, 2, unit)
                for x in (m.overshoot, m.rest_error, m.true_error)
            ),
        )
        lines.append(Line(cells, m.arrived_s is not None))
    return lines


def remarks(ended: Ended) -> list[tuple[str, str]]:
    """The machine's limits, and the speed of the simulation.

    Parameters
    ----------
    ended : Ended
        The run.

    Returns
    -------
    list[tuple[str, str]]
        Heading and text.
    """
    settings = ended.job.settings
    motion, law, place = settings.motion, gains(settings), ended.job.machine.kind.place
    tolerance = settings.arrival.tolerance
    found = [
        (
            "motion",
            ", ".join(
                f"{'' if k else 'at most '}{place.told(value, unit, 4)}"
                for k, (value, unit) in enumerate(zip(motion, RATES, strict=True))
            ),
        ),
        (
            "arrival",
            f"within {tolerance * place.fines:.4g} {place.fine} for {settings.arrival.dwell:g} s",
        ),
    ]
    told = [
        f"{e.path} {e.par.spoken(e.value, 4).replace('*', ' ')}"
        for e in entries(law)
        if isinstance(e.value, float) and e.value > 0.0
    ]
    found.append(("law", f"{settings.law}: {', '.join(told[:_GAINS])}"))
    if ended.wall > 0.0:
        speed = ended.simulated / ended.wall
        text = f"{ended.simulated:.1f} s simulated in {ended.wall:.2f} s, "
        found.append(("speed", f"{text}{speed:.0f} times real time"))
    return found


def problems(ended: Ended) -> list[str]:
    """What went wrong, a sentence each.

    Parameters
    ----------
    ended : Ended
        The run.

    Returns
    -------
    list[str]
        None for a good run.
    """
    plan, patience = ended.job.plan, ended.job.settings.arrival.patience
    waits = patience if np.isnan(plan.end) else None
    return said(ended, len(plan.target), waits)


def said(ended: Any, planned: int, patience: float | None) -> list[str]:
    """What went wrong in a run of moves, a sentence each.

    Parameters
    ----------
    ended : Any
        The run, of one axis or of several.
    planned : int
        Moves of its programme.
    patience : float | None
        How long an arrival was waited for, s; None: it was not.

    Returns
    -------
    list[str]
        None for a good run.
    """
    found = []
    count = f"move {len(ended.moves)} of {planned}"
    if ended.interrupted:
        found.append(f"interrupted at {ended.simulated:.3f} s, {count}; the recording is kept")
    if ended.fault is not None:
        fault = ended.fault
        found.append(f"fault: {fault.message} Evidence: {fault.evidence}. {fault.remedy}")
    elif not ended.finished and not ended.interrupted:
        found.append(f"the programme did not finish: {count} at {ended.simulated:.3f} s")
    lost = [str(m.move + 1) for m in ended.moves if m.complete and m.arrived_s is None]
    if lost and patience is not None:
        shown = ", ".join(lost[:10]) + (f" and {len(lost) - 10} more" if len(lost) > 10 else "")
        verb = "move" if len(lost) == 1 else "moves"
        found.append(f"{verb} {shown} did not arrive within {patience:g} s of the profile's end")
    return found


def summary(ended: Ended, started: str) -> dict[str, Any]:
    """The content of summary.json.

    Parameters
    ----------
    ended : Ended
        The run.
    started : str
        When, in words a person reads (ISO 8601).

    Returns
    -------
    dict[str, Any]
        Quantities with their unit in the key; places of moves in `unit`.
    """
    job = ended.job
    return {
        "machine": job.machine.name,
        "programme": job.programme.title,
        "source": job.programme.source,
        "cycles": job.request.cycles,
        "seed": job.request.seed,
        "version": macromicro.__version__,
        "started": started,
        "overrides": job.overrides,
        "finished": ended.finished,
        "interrupted": ended.interrupted,
        "fault": ended.fault and ended.fault._asdict(),
        "moves_planned": len(job.plan.target),
        "unit": job.machine.kind.place.unit,
        "simulated_s": ended.simulated,
        "wall_s": ended.wall,
        "speed": ended.simulated / ended.wall if ended.wall > 0.0 else None,
        "moves": [m._asdict() for m in ended.moves],
    }


def draw(ended: Ended) -> Iterator[Drawn]:
    """The figures of a run.

    Parameters
    ----------
    ended : Ended
        The run.

    Yields
    ------
    Drawn
        One after the other; none of an empty recording.
    """
    if len(ended.recording):
        yield response(ended)
        yield arrivals(ended)


def response(ended: Ended) -> Drawn:
    """Position with its set point, error and effort over the run.

    Parameters
    ----------
    ended : Ended
        The run.

    Returns
    -------
    Drawn
        Figure `response`.
    """
    r = ended.recording
    place = ended.job.machine.kind.place
    t, band = r["t"], ended.job.settings.arrival.tolerance * place.fines
    figure, axes = new(7.4, 3, sharex=True)
    places, errors, efforts = axes[:, 0]
    line(places, t, r["target"], BLACK, "set point", linewidth=0.9, linestyle="--")
    line(places, t, r["position"], BLUE, "position")
    finish(places, "Position", "", f"[{place.unit}]", legend=True)
    line(errors, t, (r["target"] - r["position"]) * 1e3, RED, "error")
    for edge in (-band, band):
        errors.axhline(edge, color=GREEN, linewidth=0.8, linestyle=":")
    finish(errors, "Set point minus position; dotted: tolerance", "", f"[{place.fine}]")
    line(efforts, t, r["effort"], ORANGE, "effort")
    if "integral" in r:
        line(efforts, t, r["integral"], BLACK, "of it integral", linewidth=0.8)
    finish(efforts, "Effort at the D/A", y="[V]", legend=True)
    figure.subplots_adjust(hspace=0.28)
    return Drawn(
        "response",
        "The run",
        "Position with its set point, the error between them, and the effort.",
        figure,
    )


def arrivals(ended: Ended) -> Drawn:
    """The error of each move around the end of its profile.

    Parameters
    ----------
    ended : Ended
        The run.

    Returns
    -------
    Drawn
        Figure `moves`.
    """
    r = ended.recording
    place = ended.job.machine.kind.place
    band = ended.job.settings.arrival.tolerance * place.fines
    figure, axes = new(3.6, 1)
    ax = axes[0, 0]
    error = (r["target"] - r["position"]) * 1e3
    colors = (BLUE, RED, GREEN, ORANGE)
    shown = ended.moves[:4]
    for m, color in zip(shown, colors, strict=False):
        since = r["t"] - m.start_s - m.profile_s
        rows = (r["move"] == m.move) & (since > -0.05) & (since < 0.25)
        line(ax, since[rows] * 1e3, error[rows], color, f"move {m.move + 1}")
    for edge in (-band, band):
        ax.axhline(edge, color=BLACK, linewidth=0.8, linestyle=":")
    finish(
        ax,
        "Error around the end of the profile; dotted: tolerance",
        "time since the profile's end [ms]",
        f"[{place.fine}]",
        legend=True,
    )
    which = "each move" if len(shown) == len(ended.moves) else "the first moves"
    return Drawn("moves", "Arrival", f"How the error of {which} settles.", figure)


def page(ended: Ended, pictures: list[Picture], started: str) -> str:
    """The report as HTML. All text is escaped.

    Parameters
    ----------
    ended : Ended
        The run.
    pictures : list[Picture]
        Its figures.
    started : str
        When, in words a person reads (ISO 8601).

    Returns
    -------
    str
        One self-contained file.
    """
    job = ended.job
    words = machine_page.Words(
        HEADINGS,
        table(ended),
        remarks(ended),
        problems(ended),
        _FOOTNOTE,
        as_toml(job.machine, job.settings),
    )
    return machine_page.page(ended, pictures, started, words)


def write(ended: Ended, started: str) -> dict[str, Any]:
    """Write everything beside the recording; the summary first.

    Parameters
    ----------
    ended : Ended
        The run.
    started : str
        When, in words a person reads (ISO 8601).

    Returns
    -------
    dict[str, Any]
        Content of the summary.

    Raises
    ------
    OSError
        The disk refuses.
    """
    content = summary(ended, started)
    pictures = machine_page.pictures(ended, content, draw(ended))
    text = page(ended, pictures, started)
    (ended.job.out / folder.PAGE).write_text(text, encoding="utf-8")
    return content
