"""The macro-stage's three controllers (Sections 4.3, 6.4.2): claims M9 to M16."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from macromicro import signals
from macromicro.arrays import Array
from macromicro.design.steps import ARRIVED, overshoot, rise_time, settling_time, swings
from macromicro.drawing.exhibit import Drawn
from macromicro.drawing.style import BLACK, BLUE, GREEN, RED, finish, line, new, smooth
from macromicro.errors import InputError
from macromicro.lab.drive import DT, closed_loop, law
from macromicro.lab.machine import Machine
from macromicro.models import macro
from macromicro.models.macro import INITIAL, MacroModel
from macromicro.programme import MACRO, Programme
from macromicro.recording import Recording
from macromicro.runs import programmed
from macromicro.runs.programmed import Runner
from macromicro.settings import Settings
from macromicro.thesis.chapter4 import _design, identification
from macromicro.thesis.chapter4._design import Design, sample_times
from macromicro.thesis.chapter4.identification import nrmse
from macromicro.thesis.claims import DIFFERS, Claim, NotMeasured, accepts, judge, state
from macromicro.thesis.contents import caption
from macromicro.thesis.procedure import Lab

LAWS = ("pid", "pd-initial", "pd-tuned")
TRAVEL = 2800.0  # counts
HOLD = 1500  # samples of each level of the decaying square
STEP_SECONDS = {"pid": 60.0, "pd-initial": 5.0, "pd-tuned": 5.0}
SETTLED = 200  # samples at the end of each level


class Square(NamedTuple):
    """Decaying square: reference [counts], the bench's counts by law, the tuned model's."""

    reference: Array
    bench: dict[str, Array]
    simulated: Array


class Tracking(NamedTuple):
    settled: float  # mean |error| [counts] over the last 0.2 s of every level
    reversals: int  # of the position after arrival, all levels
    largest: float  # swing back [counts]
    iae: float  # [counts s]
    arrived: bool  # within 2 counts of every level


class MacroData(NamedTuple):
    steps: dict[str, Recording]  # of 2800 counts, by law
    initial_model: Array  # its step (Figure 4.20) [counts]
    design: Design  # Figures 4.22, 4.23
    square: Square  # Figures 4.24, 4.25
    travel: Recording  # a full-travel move of the whole system
    unidentified: str = ""  # why this machine has no model, whose simulations are NaN then; else ""


def decaying() -> Array:
    """The decaying square of Section 4.3.4: 2660, 140, 2380, 420 ... 1400 counts, 1.5 s each."""
    t = signals.times(9 * HOLD * DT, DT)
    return signals.decaying_square(t, 1260.0, 2.0 * HOLD * DT, 280.0, 0.5 * TRAVEL)


def control_runs(
    plant: Machine, settings: Settings, seed: int = 0, run: Runner = programmed.on_twin
) -> MacroData:
    """All runs on the bench, and the simulations with the models identified on it.

    `run` drives the full-travel move under `settings`.
    """
    steps = {
        name: closed_loop(plant, law(name), np.full(round(STEP_SECONDS[name] / DT), TRAVEL))
        for name in LAWS
    }
    reference = decaying()
    measured = {name: closed_loop(plant, law(name), reference) for name in LAWS}
    aim = np.full(len(steps["pd-initial"]), TRAVEL)
    unidentified = ""
    try:
        model = identification.fit(identification.measure(plant, seed))
    except InputError as error:
        unidentified = f"no model of this machine was found: {error}"
        initial, tuned = np.full(len(aim), math.nan), np.full(len(reference), math.nan)
    else:
        initial, _ = macro.closed_loop(model._replace(kind=INITIAL), law("pd-initial"), aim)
        tuned = simulate(model, reference)
    return MacroData(
        steps,
        initial,
        _design.collect(plant),
        Square(reference, {name: r["macro_position"] for name, r in measured.items()}, tuned),
        full_travel(settings, seed, run),
        unidentified,
    )


def simulate(model: MacroModel, reference: Array) -> Array:
    return macro.closed_loop(model, law("pd-tuned"), reference)[0]


def full_travel(settings: Settings, seed: int = 0, run: Runner = programmed.on_twin) -> Recording:
    move = Programme(
        "full travel",
        np.array([math.nan]),
        np.array([MACRO]),
        np.array([TRAVEL]),
        np.array([1.0]),
        math.nan,
        "",
    )
    return run(move, settings, seed, False)


def tracking(x: Array, reference: Array) -> Tracking:
    """Tracking of levels of `HOLD` samples each."""
    settled, backs, near = [], [], []
    for k in range(0, len(reference), HOLD):
        level = x[k : k + HOLD]
        settled.append(float(np.abs(level[-SETTLED:] - reference[k]).mean()))
        backs.append(swings(level, reference[k]))
        near.append(float(np.abs(level - reference[k]).min()) <= ARRIVED)
    all_backs = np.concatenate(backs)
    iae = float(np.abs(reference - x).sum()) * DT
    largest = float(all_backs.max(initial=0.0))
    return Tracking(float(np.mean(settled)), len(all_backs), largest, iae, all(near))


def counts_per_200_mm(run: Recording) -> float:
    """Encoder counts per 200 mm of the laser, up to its reset after the move."""
    resets = np.flatnonzero(run["laser_reset"])
    last = int(resets[0]) if len(resets) else len(run) - 1
    gone = run["macro_position"][last] - run["macro_position"][0]
    return float(gone / ((run["laser"][last] - run["laser"][0]) * 1e-3) * 200.0)


RAMP = 1.0  # V


class Stuck(NamedTuple):
    """Stiction off the target while the effort ramps towards it."""

    seconds: float
    begin: float  # effort [V]
    end: float  # effort [V]
    back: bool  # it then moves towards the target, against its earlier direction


def sticking(x: Array, motor: Array, target: float, below: float) -> Stuck | None:
    """The longest stiction after the rise (98 %), or None.

    `x` stays the same count off `target` while the effort [V] ramps by `RAMP` or more in the
    direction of the error, below `below` [V].
    """
    rise = rise_time(x, target)
    if math.isnan(rise):
        return None
    first = round(rise / DT)
    edges = np.concatenate([[first], first + np.flatnonzero(np.diff(x[first:])) + 1, [len(x)]])
    found: list[Stuck] = []
    for a, b in pairwise(int(e) for e in edges):
        way = float(np.sign(target - x[a]))
        # The sample of a new count has the kick of the derivative.
        part = motor[a + 1 : b]
        if way == 0.0 or not len(part) or float(np.abs(part).max()) >= below:
            continue
        if way * (part[-1] - part[0]) < RAMP or float((way * np.diff(part)).min(initial=0.0)) < 0.0:
            continue
        turned = way * np.sign(target - x[0]) < 0.0
        moved = b < len(x) and way * (x[b] - x[a]) > 0.0
        pushed = way * part[-1] > 0.0
        back = bool(turned and moved and pushed)
        found.append(Stuck(len(part) * DT, float(part[0]), float(part[-1]), back))
    return max(found, key=lambda s: s.seconds, default=None)


def sign_changes(motor: Array) -> int:
    """Number of sign changes of the effort, without zeros."""
    signs = np.sign(motor[motor != 0.0])
    return int(np.count_nonzero(np.diff(signs)))


def claims(data: MacroData) -> list[Claim]:
    return judge(
        [
            ("M9", lambda: pid(data.steps["pid"])),
            ("M10", lambda: initial_pd(data.steps["pd-initial"], _identified(data).initial_model)),
            (("M11", "M11b"), _design.margins),
            ("M12", lambda: _design.tuning(data.design)),
            ("M13", lambda: tuned_pd(_identified(data).square)),
            ("M14", lambda: full_move(data.steps["pd-tuned"])),
            ("M15", lambda: ranking(data.square)),
            ("M16", lambda: travel(data.travel)),
        ]
    )


def _identified(data: MacroData) -> MacroData:
    if data.unidentified:
        raise NotMeasured(data.unidentified)
    return data


def pid(run: Recording) -> Claim:
    x, motor = run["macro_position"], run["motor"]
    rise, stuck, turns = rise_time(x, TRAVEL), sticking(x, motor, TRAVEL, 3.0), sign_changes(motor)
    swing = {
        "turns": turns,
        "seconds": len(x) * DT,
        "reversals": _reversals(turns),
        "over": overshoot(x, TRAVEL),
    }
    if stuck is None:
        return state("M9", rise, DIFFERS, wording="free", **swing)
    good = accepts("M9", rise) and stuck.seconds > 2.0 and stuck.back
    turned = "turns back" if stuck.back else "does not turn back"
    return state("M9", rise, good, wording="stuck", stuck=stuck, turned=turned, **swing)


def _reversals(turns: int) -> str:
    if turns == 1:
        return "one reversal, no limit cycle as the thesis reports it"
    return f"{turns} reversals, where the thesis reports a limit cycle"


def initial_pd(run: Recording, model: Array) -> Claim:
    """M10 from the initial PD's step, on the bench and on the initial model."""
    x = run["macro_position"]
    over, backs = overshoot(x, TRAVEL), len(swings(x, TRAVEL))
    model_over, model_backs = overshoot(model, TRAVEL), len(swings(model, TRAVEL))
    good = accepts("M10", over, float(backs)) and model_over < 1.0 and model_backs == 0
    return state("M10", [over, float(backs)], good, over=model_over, backs=model_backs)


def tuned_pd(square: Square) -> Claim:
    x = square.bench["pd-tuned"]
    error, seen = nrmse(square.simulated, x), tracking(x, square.reference)
    model = tracking(square.simulated, square.reference)
    good = accepts("M13", error) and seen.arrived and seen.largest <= 1.0
    wording = "arrived" if seen.arrived else "missed"
    return state("M13", error, good, wording=wording, seen=seen, model=model)


def full_move(run: Recording) -> Claim:
    time = settling_time(run["macro_position"], TRAVEL)
    if math.isnan(time):
        return state("M14", time, DIFFERS, wording="late", travel=TRAVEL, seconds=len(run) * DT)
    return state("M14", time, wording="arrived", rate=0.5 / time)


def ranking(square: Square) -> Claim:
    pid_, initial, tuned = (tracking(square.bench[name], square.reference) for name in LAWS)
    good = tuned.settled <= initial.settled < pid_.settled
    good = good and tuned.reversals < initial.reversals
    measured = [tuned.settled, initial.settled, pid_.settled]
    return state("M15", measured, good, tuned=tuned, initial=initial, pid=pid_)


def travel(run: Recording) -> Claim:
    """M16 from a full-travel move, by encoder and laser; NotMeasured if it is too short."""
    gone = float(run["macro_position"].max() - run["macro_position"].min())
    if gone < 0.5 * TRAVEL:
        raise NotMeasured(f"the carriage moved only {gone:.0f} counts, too few to measure a pitch")
    counts = counts_per_200_mm(run)
    return state("M16", counts, pitch=200e3 / counts)


DEAD_ZONE = 3.0  # V
ZOOMED = (0.45, 0.85)  # s after the step, Figure 4.20
BAND = 0.02  # of the move, M14
AROUND = (-0.12, 0.3)  # s about arrival, zooms of Figures 4.24 and 4.25


def draw_pid(data: MacroData) -> Drawn:
    run = data.steps["pid"]
    x, motor = run["macro_position"], run["motor"]
    figure, axes = new(5.0, 2, sharex=True)
    effort, place = axes[:, 0]
    line(effort, run["t"], motor, BLUE, "effort", linewidth=0.7)
    for volts in (-DEAD_ZONE, DEAD_ZONE):
        effort.axhline(volts, color=BLACK, linestyle=":", linewidth=0.9)
    target = run["macro_reference"]
    line(place, run["t"], target, BLACK, "target", linestyle="-.", linewidth=0.9)
    line(place, run["t"], x, BLUE, "encoder")
    finish(effort, "(a) controller output; dotted: ±3 V", "", "output [V]")
    finish(place, "(b) response", y="position [counts]", legend="lower right")
    return caption(
        "4.18",
        figure,
        travel=TRAVEL,
        seconds=len(run) * run.dt,
        rise=rise_time(x, TRAVEL),
        over=overshoot(x, TRAVEL),
        stuck=_why_stuck(x, motor),
        turns=_times(sign_changes(motor)),
    )


def _why_stuck(x: Array, motor: Array) -> str:
    found = sticking(x, motor, TRAVEL, DEAD_ZONE)
    if found is None:
        return "it never sticks off the target while the output ramps"
    back = " and creeps back at the edge of motion" if found.back else ""
    return (
        f"then it sticks for {found.seconds:.1f} s while the output ramps from {found.begin:.2f} "
        f"to {found.end:.2f} V{back}"
    )


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"


def draw_initial_pd(data: MacroData) -> Drawn:
    run = data.steps["pd-initial"]
    x, t = run["macro_position"], run["t"]
    figure, axes = new(3.4, 1, 2)
    for ax, (begin, end) in zip(axes[0], ((0.0, 1.5), ZOOMED), strict=True):
        rows = slice(round(begin / run.dt), round(end / run.dt))
        line(ax, t[rows], data.initial_model[rows], RED, "initial model", linestyle="--")
        line(ax, t[rows], x[rows], BLUE, "bench")
        line(ax, t[rows], run["macro_reference"][rows], BLACK, "target", linestyle="-.")
    finish(axes[0, 0], "(a) full", y="position [counts]", legend="lower right")
    finish(axes[0, 1], "(b) zoom")
    axes[0, 1].set_ylim(TRAVEL - 30.0, TRAVEL + 10.0)
    backs, model_backs = (len(swings(y, TRAVEL)) for y in (x, data.initial_model))
    return caption(
        "4.20",
        figure,
        travel=TRAVEL,
        over=overshoot(x, TRAVEL),
        backs=backs,
        model_over=overshoot(data.initial_model, TRAVEL),
        model_backs=model_backs,
    )


def arrival(x: Array, target: float) -> int:
    """Row at which `x` first comes within the tolerance of `target` [counts]."""
    return int((np.abs(x - target) <= ARRIVED).argmax())


def zoom_rows(square: Square, law: str) -> slice:
    """Rows about the first arrival of a law on the decaying square."""
    row = arrival(square.bench[law][:HOLD], float(square.reference[0]))
    begin, end = (row + round(s / DT) for s in AROUND)
    return slice(max(begin, 0), min(end, HOLD))


def _target(ax: Any, square: Square, t: Array, rows: slice) -> None:
    line(ax, t[rows], square.reference[rows], BLACK, "target", linestyle="-.", linewidth=0.9)


def draw_tuned_pd(data: MacroData) -> Drawn:
    """Figure 4.24, with the full-travel move in two panels."""
    square, run = data.square, data.steps["pd-tuned"]
    t = sample_times(len(square.reference))
    near = zoom_rows(square, "pd-tuned")
    x = square.bench["pd-tuned"]
    figure, axes = new(5.8, 2, 2)
    for ax, rows in ((axes[0, 0], slice(None)), (axes[0, 1], near)):
        _target(ax, square, t, rows)
        smooth(ax, t[rows], square.simulated[rows], BLUE, "simulated")
        smooth(ax, t[rows], x[rows], RED, "bench", linestyle=":", linewidth=1.6)
    finish(axes[0, 0], "(a) full", y="position [counts]", legend="upper right", ncols=3)
    finish(axes[0, 1], "(b) zoom")
    axes[0, 1].set_ylim(square.reference[0] - 60.0, square.reference[0] + 30.0)
    axes[0, 0].set_ylim(top=3300.0)
    settled = _full_move(axes[1, 0], run)
    counts = _travel(axes[1, 1], data.travel)
    error = nrmse(square.simulated, x)
    return caption("4.24", figure, error=error, settled=settled, counts=counts)


def _full_move(ax: Any, run: Recording) -> float:
    x = run["macro_position"]
    rows = slice(0, round(1.5 / run.dt))
    settled = settling_time(x, TRAVEL, BAND)
    ax.axhspan(TRAVEL * (1.0 - BAND), TRAVEL * (1.0 + BAND), color=BLACK, alpha=0.12, linewidth=0)
    line(ax, run["t"][rows], x[rows], RED, "bench")
    ax.axvline(settled, color=BLACK, linestyle=":", linewidth=0.9)
    ax.text(settled + 0.03, 200.0, f"{settled:.2f} s", fontsize=8)
    finish(ax, f"(c) step of {TRAVEL:.0f} counts", y="position [counts]")
    return settled


def _travel(ax: Any, run: Recording) -> float:
    resets = np.flatnonzero(run["laser_reset"])
    rows = slice(0, int(resets[0]) if len(resets) else len(run))
    gone = (run["laser"][rows] - run["laser"][0]) * 1e-3
    smooth(ax, run["macro_position"][rows], gone, GREEN, "laser")
    finish(ax, "(d) laser over encoder", "encoder [counts]", "laser [mm]")
    return counts_per_200_mm(run)


def comparison(data: MacroData) -> Drawn:
    square = data.square
    t = sample_times(len(square.reference))
    shown = {
        "pid": ("PID", GREEN, "--"),
        "pd-initial": ("initial PD", RED, ":"),
        "pd-tuned": ("tuned PD", BLUE, "-"),
    }
    figure, axes = new(5.8, 2)
    full, near = axes[:, 0]
    for ax, rows in ((full, slice(None)), (near, zoom_rows(square, "pd-initial"))):
        _target(ax, square, t, rows)
        for law_name, (name, color, style) in shown.items():
            width = 1.6 if style == ":" else 1.1
            position = square.bench[law_name][rows]
            smooth(ax, t[rows], position, color, name, linestyle=style, linewidth=width)
    finish(full, "(a) full", "", "position [counts]", legend="upper right", ncols=4)
    finish(near, "(b) zoom", y="position [counts]")
    target = float(square.reference[0])
    near.set_ylim(target - 35.0, target + 20.0)
    full.set_ylim(top=3300.0)
    seen = {name: tracking(square.bench[name], square.reference) for name in shown}
    errors = ", ".join(f"{shown[k][0]} {s.settled:.1f}" for k, s in seen.items())
    return caption(
        "4.25",
        figure,
        errors=errors,
        target=target,
        initial=seen["pd-initial"].reversals,
        tuned=seen["pd-tuned"].reversals,
    )


def collect(lab: Lab) -> MacroData:
    return control_runs(lab.bench(), lab.settings, lab.seed, lab.runner())


def ratios(data: MacroData) -> Drawn:
    return _design.ratios(data.design)


def frequencies(data: MacroData) -> Drawn:
    return _design.frequencies(data.design)


arithmetic = _design.margins
