"""Runs of the macro-stage under its three controllers (Sections 4.3 and 6.4.2)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from macromicro import signals
from macromicro.arrays import Array
from macromicro.design.steps import ARRIVED, swings
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
from macromicro.thesis.chapter4 import _design as macro_design
from macromicro.thesis.chapter4 import _identification_runs, _validation
from macromicro.thesis.chapter4._design import Design

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


def collect(
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
    initial, tuned, unidentified = (
        np.full(len(aim), math.nan),
        np.full(len(reference), math.nan),
        "",
    )
    try:
        model = _validation.fitted(_identification_runs.measured(plant, seed))
    except InputError as error:
        unidentified = f"no model of this machine was found: {error}"
    else:
        initial, _ = macro.closed_loop(model._replace(kind=INITIAL), law("pd-initial"), aim)
        tuned = simulated(model, reference)
    return MacroData(
        steps,
        initial,
        macro_design.collect(plant),
        Square(reference, {name: r["macro_position"] for name, r in measured.items()}, tuned),
        full_travel(settings, seed, run),
        unidentified,
    )


def simulated(model: MacroModel, reference: Array) -> Array:
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
