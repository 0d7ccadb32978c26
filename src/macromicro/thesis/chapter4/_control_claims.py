"""Claims M9 to M16: the macro-stage under its three controllers (Sections 4.3 and 6.4.2)."""

from __future__ import annotations

import math

from macromicro.arrays import Array
from macromicro.design.steps import overshoot, rise_time, settling_time, swings
from macromicro.lab.drive import DT
from macromicro.recording import Recording
from macromicro.thesis.chapter4 import _design
from macromicro.thesis.chapter4._control_runs import (
    LAWS,
    TRAVEL,
    MacroData,
    Square,
    counts_per_200_mm,
    tracking,
)
from macromicro.thesis.chapter4._readings import nrmse, sign_changes, sticking
from macromicro.thesis.claims import (
    DIFFERS,
    Claim,
    NotMeasured,
    accepts,
    holds,
    judged,
    stated,
    within,
)


def claims(data: MacroData) -> list[Claim]:
    return judged(
        [
            ("M9", lambda: pid(data.steps["pid"])),
            ("M10", lambda: _initial(data)),
            (("M11", "M11b"), _design.margins),
            ("M12", lambda: _design.tuning(data.design)),
            ("M13", lambda: _tuned(data)),
            ("M14", lambda: full_move(data.steps["pd-tuned"])),
            ("M15", lambda: ranking(data.square)),
            ("M16", lambda: travel(data.travel)),
        ]
    )


def _initial(data: MacroData) -> Claim:
    if data.unidentified:
        raise NotMeasured(data.unidentified)
    return initial_pd(data.steps["pd-initial"], data.initial_model)


def _tuned(data: MacroData) -> Claim:
    if data.unidentified:
        raise NotMeasured(data.unidentified)
    return tuned_pd(data.square)


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
        return stated("M9", rise, DIFFERS, "free", **swing)
    good = accepts("M9", rise) and stuck.seconds > 2.0 and stuck.back
    turned = "turns back" if stuck.back else "does not turn back"
    return stated("M9", rise, holds(good), "stuck", stuck=stuck, turned=turned, **swing)


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
    return stated("M10", [over, float(backs)], holds(good), over=model_over, backs=model_backs)


def tuned_pd(square: Square) -> Claim:
    x = square.bench["pd-tuned"]
    error, seen = nrmse(square.simulated, x), tracking(x, square.reference)
    model = tracking(square.simulated, square.reference)
    good = accepts("M13", error) and seen.arrived and seen.largest <= 1.0
    wording = "arrived" if seen.arrived else "missed"
    return stated("M13", error, holds(good), wording, seen=seen, model=model)


def full_move(run: Recording) -> Claim:
    time = settling_time(run["macro_position"], TRAVEL)
    if math.isnan(time):
        return stated("M14", time, DIFFERS, "late", travel=TRAVEL, seconds=len(run) * DT)
    return stated("M14", time, within("M14", time), "arrived", rate=0.5 / time)


def ranking(square: Square) -> Claim:
    pid_, initial, tuned = (tracking(square.bench[name], square.reference) for name in LAWS)
    good = tuned.settled <= initial.settled < pid_.settled
    good = good and tuned.reversals < initial.reversals
    return stated(
        "M15",
        [tuned.settled, initial.settled, pid_.settled],
        holds(good),
        tuned=tuned,
        initial=initial,
        pid=pid_,
    )


def travel(run: Recording) -> Claim:
    """M16 from a full-travel move, by encoder and laser; NotMeasured if it is too short."""
    gone = float(run["macro_position"].max() - run["macro_position"].min())
    if gone < 0.5 * TRAVEL:
        raise NotMeasured(f"the carriage moved only {gone:.0f} counts, too few to measure a pitch")
    counts = counts_per_200_mm(run)
    return stated("M16", counts, within("M16", counts), pitch=200e3 / counts)
