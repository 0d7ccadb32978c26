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
    MET,
    Claim,
    NotMeasured,
    accepts,
    holds,
    judged,
    reached,
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
    if stuck is None:
        held, good = "it never stands off the target while the effort ramps below 3 V", False
    else:
        held = (
            f"stands off the target for {stuck.seconds:.1f} s while the effort ramps from "
            f"{stuck.begin:.2f} to {stuck.end:.2f} V, and then "
            f"{'turns back' if stuck.back else 'does not turn back'}"
        )
        good = accepts("M9", rise) and stuck.seconds > 2.0 and stuck.back
    return stated(
        "M9",
        rise,
        holds(good),
        f"{held}; the effort changes "
        f"sign {turns} time(s) in {len(x) * DT:.0f} s: {_ways(turns)}. It goes "
        f"{overshoot(x, TRAVEL):.0f} counts over, where Section 4.3.1 asks for none; {MET}",
    )


def _ways(turns: int) -> str:
    if turns == 1:
        return "one reversal, no limit cycle as the thesis reports it"
    return f"{turns} reversals, where the thesis reports a limit cycle"


def initial_pd(run: Recording, model: Array) -> Claim:
    """M10 from the initial PD's step, on the bench and on the initial model."""
    x = run["macro_position"]
    over, backs = overshoot(x, TRAVEL), len(swings(x, TRAVEL))
    model_over, model_backs = overshoot(model, TRAVEL), len(swings(model, TRAVEL))
    good = accepts("M10", over, float(backs)) and model_over < 1.0 and model_backs == 0
    return stated(
        "M10",
        [over, float(backs)],
        holds(good),
        f"the simulation goes {model_over:.2f} counts over and reverses {model_backs} times; the "
        "bench's one period of output delay, structure and no parameter, is there for this claim",
    )


def tuned_pd(square: Square) -> Claim:
    x = square.bench["pd-tuned"]
    error, seen = nrmse(square.simulated, x), tracking(x, square.reference)
    model = tracking(square.simulated, square.reference)
    return stated(
        "M13",
        error,
        holds(accepts("M13", error) and seen.arrived and seen.largest <= 1.0),
        f"{'' if seen.arrived else 'it does not arrive at every level; '}"
        f"{seen.reversals} reversals after arrival on the bench, at most {seen.largest:.0f} "
        f"counts; the model, which has no stiction, chatters by up to {model.largest:.2f} counts",
    )


def full_move(run: Recording) -> Claim:
    time = settling_time(run["macro_position"], TRAVEL)
    return stated(
        "M14",
        time,
        reached("M14", time),
        f"there and back {0.5 / time:.2f} times a second, against 0.67 Hz; {MET}"
        if math.isfinite(time)
        else f"not within 2 % of {TRAVEL:.0f} counts after {len(run) * DT:.0f} s",
    )


def ranking(square: Square) -> Claim:
    pid_, initial, tuned = (tracking(square.bench[name], square.reference) for name in LAWS)
    good = tuned.settled <= initial.settled < pid_.settled
    good = good and tuned.reversals < initial.reversals
    return stated(
        "M15",
        [tuned.settled, initial.settled, pid_.settled],
        holds(good),
        f"reversals after arrival: tuned {tuned.reversals}, initial {initial.reversals}. By the "
        f"integral of the error the initial PD leads ({initial.iae:.0f} counts s, tuned "
        f"{tuned.iae:.0f}, PID {pid_.iae:.0f}): it is the quicker one",
    )


def travel(run: Recording) -> Claim:
    """M16 from a full-travel move, by encoder and laser; NotMeasured if it is too short."""
    gone = float(run["macro_position"].max() - run["macro_position"].min())
    if gone < 0.5 * TRAVEL:
        raise NotMeasured(f"the carriage moved only {gone:.0f} counts, too few to measure a pitch")
    counts = counts_per_200_mm(run)
    return stated(
        "M16",
        counts,
        within("M16", counts),
        f"{200e3 / counts:.1f} um a count, against the 200 um that Chapter 4 gives as precision; "
        "2800 (full travel) is taken, not 3000 (maximum). The encoder's pitch is a setting of the "
        "bench, 200 mm over 2800: the laser's length of the same move only gives it back",
    )
