"""`identify deadzone`: the lowest voltages for motion without pause."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.identify import _report, model_file
from macromicro.identify._report import Curves, Pair
from macromicro.identify.notices import DataWarning, notice
from macromicro.identify.options import Deadzone as Options
from macromicro.identify.picking import RUN, Picked, Picking, Role, T, runs
from macromicro.identify.result import Line, Result
from macromicro.identify.runs import Run, checked
from macromicro.nominal import FULL_SCALE
from macromicro.schema.text import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from macromicro.identify.deadzone import DeadZone, DiscontinuousDeadZone
    from macromicro.identify.deadzone import Trial as Outcome


U = Role(
    "u", "drive voltage", ("u", "U", "motor", "voltage", "volts", "v", "V", "input", "vir"), ("V",)
)
X = Role(
    "x",
    "position",
    ("x", "X", "macro_position", "position", "pos", "qm", "q"),
    ("counts", "m", "rad"),
)
ROLES = (T, U, X, RUN)
LEAST = 20
_NEXT = 1e-9  # V: what rounding does to a voltage
_NO_RUN = "there is no stretch at a constant voltage other than 0"
_RECORD = "Record open-loop runs, each at one voltage."


class Prediction(NamedTuple):
    file: str
    runs: tuple[Outcome, ...]
    right: int  # number of runs that move on without a pause, or pause, as the dead zone predicts
    distance: Pair | None  # positions, and those by (4.5); None without a gain

    def data(self) -> dict[str, Any]:
        more = {} if self.distance is None else _report.validation_data([self.distance])[0]
        return {"file": self.file, "runs": len(self.runs), "right": self.right, **more}


def identify(picking: Picking, options: Options) -> Result:
    from macromicro.identify import dead_zone

    tables, others = _report.records(picking, ROLES, options.tests)
    records = [run for table in tables for run in constant(table)]
    if not records:
        raise ProblemError(tables[0].file, _NO_RUN, _RECORD)
    known = tables[0].constants
    travel = options.travel
    if travel is None and {"travel_low", "travel_high"} <= set(known):
        travel = (known["travel_low"], known["travel_high"])
    if not options.pause > 0.0:
        raise InputError("--pause", options.pause, "a time above 0 s")
    zone = dead_zone(records, travel=travel, pause=options.pause)
    lines = [
        _lowest("positive", zone.positive, step_below(zone, 1.0)),
        _lowest("negative", -zone.negative, step_below(zone, -1.0)),
        Line("width", zone.width, unit="V", note="the larger one, which an inverse adds"),
    ]
    places = tables[0].units["x"] or "x"
    moved = sum(t.uninterrupted for t in zone.trials)
    remarks = [
        ("runs", f"{len(records)} at {len(zone.volts)} voltages, {moved} moved without a pause"),
        ("step", "to the next lower voltage that was tried"),
        ("by place", spread(zone, places)),
    ]
    data = {
        "positive": zone.positive,
        "negative": zone.negative,
        "width": zone.width,
        "trials": [t._asdict() for t in zone.trials],
    }
    law = None
    if options.gain is not None:
        law = jump(records, options.gain, options.width or zone.width, remarks)
        lines += jump_lines(law)
    seen = [prediction(zone, law, constant(t), t.file, options.pause) for t in others]
    lines += prediction_lines(seen)
    data["tests"] = [one.data() for one in seen]
    distances = [one.distance for one in seen if one.distance is not None]

    def draw() -> dict[str, Figure]:
        from macromicro.identify.kinds import pictures

        series = []
        for sign, name in ((1, "forwards"), (-1, "backwards")):
            starts, lowest = zone.thresholds(sign)
            series.append((name, starts, lowest, "o-"))
        series += marks(seen)
        speeds = [
            (f"{v:g} V", zone.places, row, "-")
            for v, row in zip(zone.volts, zone.speeds, strict=True)
        ]
        shown = speeds[:: max(1, math.ceil(len(speeds) / 8))]
        title, start = "lowest voltage that moved on from each start", f"start [{places}]"
        place, speed = f"place [{places}]", f"speed [{places}/s]"
        return {
            "thresholds": pictures.points(title, start, "voltage [V]", series),
            "speeds": pictures.points("speed by place", place, speed, shown),
        }

    title = "Dead zone: the lowest voltage that moves the axis without a pause from every start"
    found = Result("deadzone", title, zone, lines, remarks, settings(zone), draw, data)
    curves = None
    if law is not None:
        predicted = predicted_travel(law, records, "")
        curves = partial(Curves, [predicted], f"position [{places}]", records[0].dt)
    return _report.complete(found, places, distances, curves)


def _lowest(name: str, volts: float, step: float) -> Line:
    note = "lowest with steady motion"
    return Line(name, volts, unit="V", note=note, extra=step, extra_name="step")


def prediction(
    zone: DeadZone, law: DiscontinuousDeadZone | None, runs: Sequence[Run], file: str, pause: float
) -> Prediction:
    """Prediction of validation runs by the dead zone and, if known, (4.5)."""
    from macromicro.identify.deadzone import covered_travel, find_trials

    if not runs:
        raise ProblemError(f"--test, {file}", _NO_RUN, _RECORD)
    outcomes = find_trials(runs, covered_travel(runs, None), pause)
    right = 0
    for outcome in outcomes:
        least = zone.positive if outcome.volts > 0.0 else zone.negative
        right += outcome.uninterrupted == (abs(outcome.volts) >= least - _NEXT)
    return Prediction(
        file, outcomes, right, None if law is None else predicted_travel(law, runs, file)
    )


def predicted_travel(law: DiscontinuousDeadZone, runs: Sequence[Run], file: str) -> Pair:
    """Runs one after another, and the distance at the steady speed of (4.5)."""
    times: list[Array] = []
    model: list[Array] = []
    end = 0.0
    for run in runs:
        volts, t = float(run.u[0]), run.t - run.t[0]
        beyond = abs(volts) - law.width
        speed = law.speed(float(np.copysign(beyond, volts))) if beyond > 0.0 else 0.0
        model.append(run.x[0] + speed * t)
        times.append(t + end)
        end = float(times[-1][-1]) + run.dt
    measured = np.concatenate([run.x for run in runs])
    return Pair(file, np.concatenate(times), measured, np.concatenate(model))


def prediction_lines(seen: Sequence[Prediction]) -> list[Line]:
    """Share of runs of each file that behave as predicted."""
    lines = []
    for k, one in enumerate(seen, 1):
        note = f"of {len(one.runs)} test runs behave as predicted: {printable(Path(one.file).name)}"
        share = 100.0 * one.right / len(one.runs)
        lines.append(Line(_report.validation_name(k, len(seen)), share, unit="%", note=note))
    return lines


def marks(seen: Sequence[Prediction]) -> list[tuple[str, Array, Array, str]]:
    series = []
    for moved, name, form in ((True, "moved on", "^"), (False, "paused", "x")):
        mine = [t for one in seen for t in one.runs if t.uninterrupted == moved]
        if mine:
            starts, volts = (np.array([getattr(t, n) for t in mine]) for n in ("start", "volts"))
            series.append((f"not fitted: {name}", starts, np.abs(volts), form))
    return series


def constant(table: Picked) -> list[Run]:
    """Stretches of constant voltage other than 0, of 20 samples or more."""
    found, short = [], 0
    for part in runs(table):
        cuts = np.flatnonzero(np.diff(part["u"])) + 1
        for piece in np.split(np.arange(len(part["u"])), cuts):
            if part["u"][piece[0]] == 0.0:
                continue
            if len(piece) < LEAST:
                short += 1
                continue
            found.append(checked(part["t"][piece], part["u"][piece], part["x"][piece], table.file))
    if short:
        text = (
            f"{table.file}: {short} stretches of constant voltage under {LEAST} samples; left out"
        )
        notice(DataWarning, text)
    return found


def step_below(zone: DeadZone, direction: float) -> float:
    mine = {abs(t.volts) for t in zone.trials if t.volts * direction > 0.0}
    edge = zone.positive if direction > 0.0 else zone.negative
    lower = [v for v in mine if v < edge]
    return edge - max(lower) if lower else math.nan


def spread(zone: DeadZone, unit: str) -> str:
    said = []
    for sign, name in ((1, "forwards"), (-1, "backwards")):
        starts, lowest = zone.thresholds(sign)
        good = np.isfinite(lowest)
        if good.any():
            least, most = int(np.nanargmin(lowest)), int(np.nanargmax(lowest))
            said.append(
                f"{name} {lowest[least]:g} V from {starts[least]:g} {unit} to "
                f"{lowest[most]:g} V from {starts[most]:g} {unit}"
            )
    return "; ".join(said)


def jump(
    records: list[Run], gain: float, width: float, remarks: list[tuple[str, str]]
) -> DiscontinuousDeadZone:
    """a0 and delta of (4.5) from the runs beyond the dead zone."""
    from macromicro.identify import discontinuous_dead_zone

    beyond = [r for r in records if abs(float(r.u[0])) > width + 1e-9]
    law = discontinuous_dead_zone(beyond, gain, width)
    remarks.append(("(4.5)", f"Vout = a0 + delta |V|, V beyond {width:g} V, {len(beyond)} runs"))
    return law


def jump_lines(law: DiscontinuousDeadZone) -> list[Line]:
    lines = []
    for name, side in (("forwards", law.positive), ("backwards", law.negative), ("", law.both)):
        lines.append(Line(f"a0 {name}".strip(), side.a0, side.a0_std, "V"))
        lines.append(Line(f"delta {name}".strip(), side.delta, side.delta_std))
    return lines


def settings(zone: DeadZone) -> str:
    head = "The dead zone that the controller's inverse compensates (Section 4.2.3).\n"
    head += "Use: macromicro run --config model.toml"
    if zone.width >= FULL_SCALE:
        return model_file.plain(
            head.partition("\n")[0]
            + f"\nNot for the bench, whose D/A board ends at {FULL_SCALE:g} V.",
            {"dead_zone": {"width": (zone.width, "V")}},
        )
    comment = f"forwards {zone.positive:g} V, backwards {zone.negative:g} V"
    return model_file.settings(head, {"controller.dead_zone": (zone.width, comment)})
