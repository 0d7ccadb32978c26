"""The report of a run of a machine of one stage, or of several on one clock."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any

from macromicro.drawing.page import PageFigure
from macromicro.machines import composite, doubts, results
from macromicro.machines.composite import Composite
from macromicro.machines.joint.settings import UPPER
from macromicro.machines.machine import as_toml
from macromicro.machines.tree import gains
from macromicro.report import joint_figures, run, stage_figures
from macromicro.report.run import Line, RunReport, amount
from macromicro.runs import arrivals
from macromicro.runs.job import Ended
from macromicro.schema.par import entries
from macromicro.units import printed

_ONE = (
    *run.MOVE, "profile", run.PEAK, "true peak", "rms error", run.OVERSHOOT, run.REST, run.TRUE,
)  # fmt: skip
_LEG = ("#", "move", *run.MOVE[2:], "profile")
_PLANE = (
    *_LEG, "contour rms", "contour peak", "true contour", f"{run.PEAK} x",
    f"{run.PEAK} y", run.TRUE,
)  # fmt: skip
RATES = ("m/s", "m/s^2", "m/s^3")  # units of the motion's limits, on a slide
_GAINS = 4  # that a line tells; the page has all


def report(ended: Ended, started: str) -> RunReport:
    job, machine = ended.job, ended.job.setup.machine
    return RunReport(
        opening=f"{run.cycles(job.request.cycles)} on the machine {machine.name} "
        f"({machine.title}), simulated, {run.origin(job.request.seed, started)}",
        headings=headings(ended),
        table=table(ended),
        remarks=remarks(ended),
        verdict=verdict(ended),
        problems=problems(ended),
        footnote=run.footnote(headings(ended)),
        settings=as_toml(machine, job.settings),
        summary=summary(ended, started),
    )


def warnings(settings: Any) -> list[tuple[str, str]]:
    return [("warning", each.text) for each in doubts.find_doubts(settings)]


def doubt(settings: Any) -> str:
    """Reason to doubt the arrivals of a run."""
    wide = [d for d in doubts.find_doubts(settings) if d.path.endswith(doubts.ARRIVAL)]
    return "".join(f", but {d.path} = {d.value} is in doubt (see warning)" for d in wide)


def headings(ended: Ended) -> tuple[str, ...]:
    machine = ended.job.setup.machine
    if not isinstance(machine, Composite):
        return _ONE
    if machine.has_plane:
        return _PLANE
    names = composite.names(machine)
    errors = [f"{what} {name}" for name in names for what in (run.PEAK, run.REST)]
    return (*_LEG, *errors)


def table(ended: Ended) -> list[Line]:
    machine = ended.job.setup.machine
    if not isinstance(machine, Composite):
        return _table_of_one(ended)
    return [
        _line(
            m,
            m.name,
            _target(ended, m),
            _plane_errors(m) if machine.has_plane else _stage_errors(ended, m),
        )
        for m in ended.moves
    ]


def _line(m: Any, stage: str, target: str, errors: Iterable[str]) -> Line:
    cells = (f"{m.profile_s:.3f} s", *errors)
    return run.line(m.move + 1, stage, target, m.arrived_s, m.complete, cells)


def _table_of_one(ended: Ended) -> list[Line]:
    lines = []
    # Errors of a stage that is exact to nanometres would all read 0.00 um.
    kind = ended.job.setup.machine.stages[0][1].kind
    place = kind.place
    fine = ended.job.settings.arrival.tolerance < place.smallest
    unit, scale = (place.finest, 1e6) if fine else (place.fine, 1e3)
    for m in ended.moves:
        way = ((e, 1) for e in (m.peak_error, m.true_peak_error, m.rms_error))
        rest = ((e, 2) for e in (m.overshoot, m.rest_error, m.true_error))
        errors = (_scaled(e, scale, digits, unit) for e, digits in (*way, *rest))
        lines.append(_line(m, kind.name, f"{m.target:.6g} {place.unit}", errors))
    return lines


def _scaled(error: float | None, scale: float, digits: int, unit: str) -> str:
    """An error in a finer unit; none and NaN as none."""
    if error is None or math.isnan(error):
        return run.NONE
    return amount(scale * error, digits, unit)


def _target(ended: Ended, m: Any) -> str:
    units = [place.unit for place in composite.places(ended.job.setup.machine)]
    if len(set(units)) == 1:
        return f"{', '.join(f'{value:.6g}' for value in m.target)} {units[0]}"
    return ", ".join(f"{value:.6g} {unit}" for value, unit in zip(m.target, units, strict=True))


def _plane_errors(m: Any) -> Iterator[str]:
    c = m.contour
    contour = (None,) * 3 if c is None else (c.rms, c.peak, c.true_peak)
    for e in (*contour, *(own.peak_error for own in m.axes), m.true_error):
        yield _scaled(e, 1e3, 1, "um")


def _stage_errors(ended: Ended, m: Any) -> Iterator[str]:
    for (_, one), own in zip(ended.job.setup.machine.stages, m.axes, strict=True):
        for e in (own.peak_error, own.rest_error):
            yield _scaled(e, 1e3, 2, one.kind.place.fine)


def verdict(ended: Ended) -> str:
    job, moves = ended.job, ended.moves
    place = job.setup.machine.stages[0][1].kind.place
    rests = results.rests(moves, composite.places(job.setup.machine))
    if job.setup.timed:  # set points come by time, and wait for nothing
        peak = max((m.peak_error for m in moves), default=None)
        return arrivals.verdict(rests, 0, place, followed=peak and peak / place.per)
    return arrivals.verdict(rests, job.setup.planned, place, doubt=doubt(job.settings))


def remarks(ended: Ended) -> list[tuple[str, str]]:
    job = ended.job
    if isinstance(job.setup.machine, Composite):
        found = _of_several(ended)
    else:
        found = _of_one(job.settings, job.setup.machine.kind.place)
    return [*found, *run.speed(ended)]


def _of_one(settings: Any, place: Any) -> list[tuple[str, str]]:
    tolerance = settings.arrival.tolerance
    within = f"within {tolerance * place.fines:.4g} {place.fine} for {settings.arrival.dwell:g} s"
    told = [
        f"{e.path} {printed(e.par.spoken(e.value, 4))}"
        for e in entries(gains(settings))
        if isinstance(e.value, float) and e.value > 0.0
    ]
    return [
        ("motion", _motion(settings, place)),
        ("arrival", within),
        *warnings(settings),
        ("law", f"{settings.law}: {', '.join(told[:_GAINS])}"),
    ]


def _motion(settings: Any, place: Any) -> str:
    limits = zip(settings.motion, RATES, strict=True)
    return "at most " + ", ".join(place.told(value, unit, 4) for value, unit in limits)


def _of_several(ended: Ended) -> list[tuple[str, str]]:
    machine, settings = ended.job.setup.machine, ended.job.settings
    plane = machine.has_plane
    found = _path(ended) if plane else []
    for (name, one), own in zip(machine.stages, machine.trees(settings), strict=True):
        if plane:
            text = (
                f"at most {own.motion.velocity:.4g} m/s, {own.motion.acceleration:.4g} m/s^2, "
                f"{own.motion.jerk:.4g} m/s^3; {own.load.mass + own.load.payload:.4g} kg; "
                f"{own.law}, position gain {own.controller.position:.4g} 1/s"
            )
        else:
            text = f"{one.name}; {_motion(own, one.kind.place)}; {own.law}"
        found.append((name, text))
    found += warnings(settings)
    if plane and settings.stack.carries == UPPER:
        found.append(("stack", f"x carries y: {settings.x.load.payload:.4g} kg"))
    return found


def _path(ended: Ended) -> list[tuple[str, str]]:
    """The contour error of a run in the plane, and the limits of its path."""
    path, found = ended.job.settings.path, []
    contours = [m.contour for m in ended.moves if m.contour is not None]
    if contours:
        tolerance = 1e6 * path.tolerance
        told = _contour_error("by the encoders", [(c.peak, c.rms) for c in contours], tolerance)
        if not any(math.isnan(c.true_peak) for c in contours):  # no rig knows it
            true = _contour_error("true", [(c.true_peak, c.true_rms) for c in contours], tolerance)
            told = f"{told}; {true}"
        found.append(("contour", f"{told}; tolerance {tolerance:.4g} um"))
    limits = f"at most {path.speed:.4g} m/s and {path.acceleration:.4g} m/s^2 in the plane"
    return [*found, ("path", limits)]


def _contour_error(whose: str, moves: list[tuple[float, float]], tolerance: float) -> str:
    """Peak and rms of the distance from the path (mm), judged by a tolerance (um)."""
    peak = 1e3 * max(peak for peak, _ in moves)
    rms = 1e3 * math.sqrt(sum(rms**2 for _, rms in moves) / len(moves))
    word = "within" if peak <= tolerance else "beyond"
    return f"{whose} at most {peak:.1f} um, {word} the tolerance, rms {rms:.1f} um"


def problems(ended: Ended) -> list[str]:
    """Problems in a run of moves, a sentence each."""
    job = ended.job
    found = run.stop_lines(ended, f"move {len(ended.moves)} of {job.setup.planned}")
    lost = arrivals.describe_missed(results.rests(ended.moves, composite.places(job.setup.machine)))
    if lost and not job.setup.timed:
        patience = max(own.arrival.patience for own in job.setup.machine.trees(job.settings))
        found.append(f"{lost} within {patience:g} s of the profile's end")
    return found


def summary(ended: Ended, started: str) -> dict[str, Any]:
    job, machine = ended.job, ended.job.setup.machine
    content = {
        "machine": machine.name,
        **run.summary(ended, started, job.setup.planned),
        "warnings": [text for _, text in warnings(job.settings)],
    }
    if not isinstance(machine, Composite):
        moves = [m._asdict() for m in ended.moves]
        return content | {"unit": machine.kind.place.unit, "moves": moves}
    if machine.has_plane:
        content["contour_tolerance_mm"] = 1e3 * job.settings.path.tolerance
    names = composite.names(machine)
    content["moves"] = [
        {
            **m._asdict(),
            "contour": m.contour and m.contour._asdict(),
            "axes": {n: a._asdict() for n, a in zip(names, m.axes, strict=True)},
        }
        for m in ended.moves
    ]
    return content


def draw(ended: Ended) -> Iterator[PageFigure]:
    job, rows = ended.job, ended.recording
    if not len(rows):
        return
    if not isinstance(job.setup.machine, Composite):
        yield stage_figures.response(ended)
        yield stage_figures.settling(ended)
        return
    if job.setup.machine.has_plane:
        yield joint_figures.path(rows, job.setup.plan, job.settings.path.tolerance)
    yield joint_figures.axes_over_time(rows, job.setup.plan, job.setup.machine, job.settings)
