"""Table, summary, figures and page of a run of a machine of two axes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import macromicro
from macromicro.drawing.page import Picture
from macromicro.machines.joint import results
from macromicro.machines.joint.job import Ended
from macromicro.machines.joint.machine import as_toml
from macromicro.machines.joint.settings import AXES, UPPER, of
from macromicro.report import _machine_page, joint_figures
from macromicro.report._figures import Drawn
from macromicro.report.stage import said
from macromicro.report.words import Line, amount
from macromicro.runs import arrivals, folder
from macromicro.schema.text import write_text

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
    "error is the distance of the encoders' position from the path during the profile; "
    "the true contour is the largest one of the true position, which includes the squareness "
    "of the axes. Peak errors are distances from each axis' set point. The true error is the "
    "distance of the true position from the target over the hold's last 0.1 s. No controller reads "
    "true values."
)


def table(ended: Ended) -> list[Line]:
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


def verdict(ended: Ended) -> str:
    rests, planned = results.rests(ended.moves), len(ended.job.plan.legs)
    return arrivals.verdict(rests, planned, doubt=_machine_page.doubt(ended.job.settings))


def remarks(ended: Ended) -> list[tuple[str, str]]:
    settings, found = ended.job.settings, []
    beside = [m.contour for m in ended.moves if m.contour is not None]
    if beside:
        tolerance = 1e6 * settings.path.tolerance
        told = _beside("by the encoders", [(c.peak, c.rms) for c in beside], tolerance)
        if not any(math.isnan(c.true_peak) for c in beside):  # no rig knows it
            true = _beside("true", [(c.true_peak, c.true_rms) for c in beside], tolerance)
            told = f"{told}; {true}"
        found.append(("contour", f"{told}; tolerance {tolerance:.4g} um"))
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
    found += _machine_page.warnings(settings)
    if settings.stack.carries == UPPER:
        found.append(("stack", f"x carries y: {settings.x.load.payload:.4g} kg"))
    if ended.wall > 0.0:
        speed = ended.simulated / ended.wall
        text = f"{ended.simulated:.1f} s simulated in {ended.wall:.2f} s, "
        found.append(("speed", f"{text}{speed:.0f} times real time"))
    return found


def _beside(whose: str, moves: list[tuple[float, float]], tolerance: float) -> str:
    """Peak and rms of the distance from the path (mm), judged by a tolerance (um)."""
    peak = 1e3 * max(peak for peak, _ in moves)
    rms = 1e3 * math.sqrt(sum(rms**2 for _, rms in moves) / len(moves))
    word = "within" if peak <= tolerance else "beyond"
    return f"{whose} at most {peak:.1f} um, {word} the tolerance, rms {rms:.1f} um"


def problems(ended: Ended) -> list[str]:
    patience = max(own.arrival.patience for own in of(ended.job.settings))
    return said(ended, len(ended.job.plan.legs), patience, results.rests(ended.moves))


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
    if len(ended.recording):
        job = ended.job
        yield joint_figures.path(ended.recording, job.plan, job.settings.path.tolerance)
        yield joint_figures.axes_over_time(ended.recording, job.plan, job.settings)


def page(ended: Ended, pictures: list[Picture], started: str) -> str:
    job = ended.job
    words = _machine_page.Words(
        HEADINGS,
        table(ended),
        remarks(ended),
        verdict(ended),
        problems(ended),
        _FOOTNOTE,
        as_toml(job.settings),
    )
    return _machine_page.page(ended, pictures, started, words)


def write(ended: Ended, started: str) -> dict[str, Any]:
    """Write everything beside the recording; the summary first."""
    content = summary(ended, started)
    pictures = _machine_page.pictures(ended, content, draw(ended))
    text = page(ended, pictures, started)
    write_text(ended.job.out / folder.PAGE, text)
    return content
