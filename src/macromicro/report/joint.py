"""Table, summary, figures and page of a run of a machine of two axes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import macromicro
from macromicro.drawing.page import Picture
from macromicro.machines.joint.job import Ended
from macromicro.machines.joint.machine import as_toml
from macromicro.machines.joint.settings import AXES, UPPER, of
from macromicro.report import joint_figures, machine_page
from macromicro.report.figures import Drawn
from macromicro.report.stage import said
from macromicro.report.words import Line, amount
from macromicro.runs import folder

HEADINGS = (
    "#",
    "move",
    "target",
    "arrival",
    "profile",
    "contour rms",
    "contour peak",
    "true contour",
    "peak error x",
    "peak error y",
    "true error",
)
_FOOTNOTE = (
    "Arrival runs from the move's start until both axes stay within their tolerances. The contour "
    "error is the distance of the place that the encoders show from the path while the profile "
    "lasts; the true contour is the largest of the true places, with the axes as square as they "
    "are. Peak errors are distances from each axis' set point. The true error is the distance "
    "of the true place from the target over the hold's last 0.1 s. No controller sees what is true."
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
    for m in ended.moves:
        lost = "did not arrive" if m.complete else "cut short"
        beside = (None,) * 3 if m.contour is None else (m.contour[0], m.contour[1], m.contour[3])
        errors = (*beside, m.axes[0].peak_error, m.axes[1].peak_error)
        cells = (
            str(m.move + 1),
            m.name,
            f"{m.target[0]:.6g}, {m.target[1]:.6g} mm",
            lost if m.arrived_s is None else f"{m.arrived_s:.3f} s",
            f"{m.profile_s:.3f} s",
            *(amount(None if e is None or math.isnan(e) else 1e3 * e, 1, "um") for e in errors),
            amount(None if m.true_error is None else 1e3 * m.true_error, 1, "um"),
        )
        lines.append(Line(cells, m.arrived_s is not None))
    return lines


def remarks(ended: Ended) -> list[tuple[str, str]]:
    """Contour, limits, gains, and the speed of the simulation.

    Parameters
    ----------
    ended : Ended
        The run.

    Returns
    -------
    list[tuple[str, str]]
        Heading and text.
    """
    settings, found = ended.job.settings, []
    beside = [m.contour for m in ended.moves if m.contour is not None]
    if beside:
        peak, tolerance = max(c.peak for c in beside), 1e6 * settings.path.tolerance
        rms = math.sqrt(sum(c.rms**2 for c in beside) / len(beside))
        word = "within" if 1e3 * peak <= tolerance else "beyond"
        text = f"at most {1e3 * peak:.1f} um, {word} the tolerance of {tolerance:.4g} um; "
        text, true = f"{text}rms {1e3 * rms:.1f} um", max(c.true_peak for c in beside)
        if not math.isnan(true):  # no rig knows it
            text += f"; true at most {1e3 * true:.1f} um"
        found.append(("contour", text))
    path = settings.path
    found.append(
        ("path", f"at most {path.speed:.4g} m/s and {path.acceleration:.4g} m/s^2 in the plane")
    )
    for name, own in zip(AXES, of(settings), strict=True):
        text = (
            f"at most {own.motion.velocity:.4g} m/s, {own.motion.acceleration:.4g} m/s^2, "
            f"{own.motion.jerk:.4g} m/s^3; {own.load.mass + own.load.payload:.4g} kg; {own.law}, "
            f"position gain {own.controller.position:.4g} 1/s"
        )
        found.append((name, text))
    if settings.stack.carries == UPPER:
        found.append(("stack", f"x carries y: {settings.x.load.payload:.4g} kg"))
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
    patience = max(own.arrival.patience for own in of(ended.job.settings))
    return said(ended, len(ended.job.plan.legs), patience)


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
        Quantities with their unit in the key; lengths of moves in mm.
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
        "moves_planned": len(job.plan.legs),
        "simulated_s": ended.simulated,
        "wall_s": ended.wall,
        "speed": ended.simulated / ended.wall if ended.wall > 0.0 else None,
        "contour_tolerance_mm": 1e3 * job.settings.path.tolerance,
        "moves": [
            {
                **m._asdict(),
                "contour": m.contour and m.contour._asdict(),
                "axes": {n: a._asdict() for n, a in zip(AXES, m.axes, strict=True)},
            }
            for m in ended.moves
        ],
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
        job = ended.job
        yield joint_figures.path(ended.recording, job.plan, job.settings.path.tolerance)
        yield joint_figures.axes_over_time(ended.recording, job.plan, job.settings)


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
        as_toml(job.settings),
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
