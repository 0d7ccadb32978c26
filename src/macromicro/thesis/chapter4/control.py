"""The macro-stage under its three controllers (Sections 4.3 and 6.4.2): M9 to M16.

Design and tuning, M11 to M12, are measured by `macro_design`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro import signals
from macromicro.design.steps import ARRIVED, overshoot, rise_time, settling_time, swings
from macromicro.errors import InputError
from macromicro.models import macro
from macromicro.models.macro import INITIAL, MacroModel
from macromicro.programme import MACRO, Programme
from macromicro.recording import Recording
from macromicro.runs import programmed
from macromicro.runs.drives import DT, closed_loop, law
from macromicro.runs.machine import Machine
from macromicro.runs.programmed import Runner
from macromicro.settings import Settings
from macromicro.thesis.chapter4 import design as macro_design
from macromicro.thesis.chapter4 import identification_runs, validation
from macromicro.thesis.chapter4.design import Design
from macromicro.thesis.chapter4.readings import nrmse, sign_changes, sticking
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

Array = npt.NDArray[np.float64]

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
    """How a law follows the decaying square.

    settled: mean |error| [counts] over the last 0.2 s of every level; reversals: of the
    position after arrival, all levels; largest: the largest swing back [counts]; iae
    [counts s]; arrived: it comes within 2 counts of every level.
    """

    settled: float
    reversals: int
    largest: float
    iae: float
    arrived: bool


class MacroData(NamedTuple):
    """What Section 4.3 shows: steps of 2800 counts by law, the initial model's step (Figure
    4.20, counts), the design (Figures 4.22, 4.23), decaying squares (Figures 4.24, 4.25), a
    full-travel move of the whole system. `unidentified`: why there is no model of this machine,
    whose simulations are NaN then; empty where there is one."""

    steps: dict[str, Recording]
    initial_model: Array
    design: Design
    square: Square
    travel: Recording
    unidentified: str = ""


def decaying() -> Array:
    """The decaying square of Section 4.3.4: 2660, 140, 2380, 420 ... 1400 counts, 1.5 s each."""
    t = signals.times(9 * HOLD * DT, DT)
    return signals.decaying_square(t, 1260.0, 2.0 * HOLD * DT, 280.0, 0.5 * TRAVEL)


def collect(
    plant: Machine, settings: Settings, seed: int = 0, run: Runner = programmed.on_twin
) -> MacroData:
    """All runs on the bench `plant`, and the simulations with the models identified on it.

    `run` drives the full-travel move under `settings`.
    """
    steps = {
        name: closed_loop(plant, law(name), np.full(round(STEP_SECONDS[name] / DT), TRAVEL))
        for name in LAWS
    }
    reference = decaying()
    measured = {name: closed_loop(plant, law(name), reference) for name in LAWS}
    aim = np.full(len(steps["pd-initial"]), TRAVEL)
    initial, tuned, unidentified = (
        np.full(len(aim), math.nan),
        np.full(len(reference), math.nan),
        "",
    )
    try:
        model = validation.fitted(identification_runs.measured(plant, seed))
    except InputError as error:
        unidentified = f"no model of this machine was found: {error}"
    else:
        initial, _ = macro.closed_loop(model._replace(kind=INITIAL), law("pd-initial"), aim)
        tuned = simulated(model, reference)
    return MacroData(
        steps,
        initial,
        macro_design.collect(plant),
        Square(
            reference,
            {name: r["macro_position"] for name, r in measured.items()},
            tuned,
        ),
        full_travel(settings, seed, run),
        unidentified,
    )


def simulated(model: MacroModel, reference: Array) -> Array:
    """The tuned controller on a model (Figure 4.21): counts."""
    return macro.closed_loop(model, law("pd-tuned"), reference)[0]


def full_travel(settings: Settings, seed: int = 0, run: Runner = programmed.on_twin) -> Recording:
    """One move of 2800 counts by the whole system, laser and all."""
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
    """How `x` follows levels of `HOLD` samples each."""
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
    """Encoder counts per 200 mm of the laser's way, up to the laser's reset after the move."""
    resets = np.flatnonzero(run["laser_reset"])
    last = int(resets[0]) if len(resets) else len(run) - 1
    gone = run["macro_position"][last] - run["macro_position"][0]
    return float(gone / ((run["laser"][last] - run["laser"][0]) * 1e-3) * 200.0)


def claims(data: MacroData) -> list[Claim]:
    """M9 to M16 from what was collected."""
    return judged(
        [
            ("M9", lambda: pid(data.steps["pid"])),
            ("M10", lambda: _initial(data)),
            (("M11", "M11b"), macro_design.margins),
            ("M12", lambda: macro_design.tuning(data.design)),
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
    """M9 from the PID's step."""
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
    """M13 from the tuned PD on the decaying square."""
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
    """M14 from the tuned PD's step."""
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
    """M15 from all three laws on the decaying square."""
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
    """M16 from a full-travel move, by encoder and laser."""
    gone = float(run["macro_position"].max() - run["macro_position"].min())
    if gone < 0.5 * TRAVEL:
        raise NotMeasured(f"the carriage went {gone:.0f} counts only, too few to measure a pitch")
    counts = counts_per_200_mm(run)
    return stated(
        "M16",
        counts,
        within("M16", counts),
        f"{200e3 / counts:.1f} um a count, against the 200 um that Chapter 4 gives as precision; "
        "2800 (full travel) is taken, not 3000 (maximum). The encoder's pitch is a setting of the "
        "bench, 200 mm over 2800: the laser's length of the same move only gives it back",
    )
