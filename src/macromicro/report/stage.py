"""Table, summary, figures and page of a run of a machine of one stage."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

import macromicro
from macromicro.drawing.page import Picture
from macromicro.drawing.style import BLACK, BLUE, GREEN, ORANGE, RED, finish, line, new
from macromicro.machines import results
from macromicro.machines.job import Ended
from macromicro.machines.machine import as_toml
from macromicro.machines.tree import gains
from macromicro.report import _machine_page
from macromicro.report._figures import Drawn
from macromicro.report.words import Line, amount
from macromicro.runs import arrivals, folder
from macromicro.runs.arrivals import Rest
from macromicro.schema.par import entries
from macromicro.schema.text import write_text
from macromicro.units import printed

HEADINGS = (
    "#",
    "stage",
    "target",
    "arrival",
    "profile",
    "peak error",
    "true peak",
    "rms error",
    "overshoot",
    "error at rest",
    "true error",
)
RATES = ("m/s", "m/s^2", "m/s^3")  # units of the motion's limits, on a slide
_GAINS = 4  # that a line tells; the page has all
_FOOTNOTE = (
    "Arrival runs from the move's start until the reading stays within the tolerance. Peak and "
    "rms error are the distance of the reading from the set point during the profile, the "
    "true peak is that of the load's true position. The error at rest is the target minus the mean "
    "reading over the hold's last 0.1 s; the true error is the same for the true position. True "
    "values exist only in simulation."
)


def table(ended: Ended) -> list[Line]:
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
            *(
                amount(None if x is None else x * scale, 1, unit)
                for x in (m.peak_error, m.true_peak_error, m.rms_error)
            ),
            *(
                amount(None if x is None else x * scale, 2, unit)
                for x in (m.overshoot, m.rest_error, m.true_error)
            ),
        )
        lines.append(Line(cells, m.arrived_s is not None))
    return lines


def verdict(ended: Ended) -> str:
    job, moves = ended.job, ended.moves
    place, planned = job.machine.kind.place, len(job.plan.target)
    rests = results.rests(moves, place)
    if np.isfinite(job.plan.end):  # its set points come by time, and wait for no arrival
        peak = max((m.peak_error for m in moves), default=None)
        return arrivals.verdict(rests, 0, place, followed=peak and peak / place.per)
    return arrivals.verdict(rests, planned, place, doubt=_machine_page.doubt(job.settings))


def remarks(ended: Ended) -> list[tuple[str, str]]:
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
        *_machine_page.warnings(settings),
    ]
    told = [
        f"{e.path} {printed(e.par.spoken(e.value, 4))}"
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
    plan, patience = ended.job.plan, ended.job.settings.arrival.patience
    waits = patience if np.isnan(plan.end) else None
    rests = results.rests(ended.moves, ended.job.machine.kind.place)
    return said(ended, len(plan.target), waits, rests)


def said(ended: Any, planned: int, patience: float | None, rests: list[Rest]) -> list[str]:
    """Problems in a run of moves, a sentence each."""
    found = []
    count = f"move {len(ended.moves)} of {planned}"
    if ended.fault is not None:
        fault = ended.fault
        found.append(f"fault: {fault.message} Evidence: {fault.evidence}. {fault.remedy}")
    elif not ended.finished:
        found.append(f"the programme did not finish: {count} at {ended.simulated:.3f} s")
    lost = arrivals.lost(rests)
    if lost and patience is not None:
        found.append(f"{lost} within {patience:g} s of the profile's end")
    return found


def summary(ended: Ended, started: str) -> dict[str, Any]:
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
        "fault": ended.fault and ended.fault._asdict(),
        "warnings": [text for _, text in _machine_page.warnings(job.settings)],
        "moves_planned": len(job.plan.target),
        "unit": job.machine.kind.place.unit,
        "simulated_s": ended.simulated,
        "wall_s": ended.wall,
        "speed": ended.simulated / ended.wall if ended.wall > 0.0 else None,
        "moves": [m._asdict() for m in ended.moves],
    }


def draw(ended: Ended) -> Iterator[Drawn]:
    if len(ended.recording):
        yield response(ended)
        yield settling(ended)


def response(ended: Ended) -> Drawn:
    """Position with its set point, error and effort over the run."""
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


def settling(ended: Ended) -> Drawn:
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
    job = ended.job
    words = _machine_page.Words(
        HEADINGS,
        table(ended),
        remarks(ended),
        verdict(ended),
        problems(ended),
        _FOOTNOTE,
        as_toml(job.machine, job.settings),
    )
    return _machine_page.page(ended, pictures, started, words)


def write(ended: Ended, started: str) -> dict[str, Any]:
    """Write everything beside the recording; the summary first."""
    content = summary(ended, started)
    pictures = _machine_page.pictures(ended, content, draw(ended))
    text = page(ended, pictures, started)
    write_text(ended.job.out / folder.PAGE, text)
    return content
