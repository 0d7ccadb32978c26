"""Macro models against the bench in open loop (Figures 4.13 and 4.17): M7 and M8.

Square and sine inputs of 0.1 V, 1 V and 2 V pass the dead-zone inverse to the bench and to
the initial and the tuned model.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from macromicro import signals
from macromicro.arrays import Array
from macromicro.lab.drive import DT, open_loop
from macromicro.lab.machine import Machine
from macromicro.models import macro
from macromicro.models.macro import INITIAL, TUNED, Linear, MacroModel
from macromicro.thesis.chapter4._identification_runs import MacroModel as Found
from macromicro.thesis.chapter4._readings import nrmse
from macromicro.thesis.claims import Claim, accepts, stated

HALVES = {0.1: 1.35, 1.0: 0.65, 2.0: 0.35}  # half a period [s]; the first two from Figure 4.13
PERIODS = 2
START = 200.0  # counts
SHAPES = ("square", "sine")
MISSED = 0.05  # of the bench's speed: a smaller error is no miss, a larger one no fit


class Case(NamedTuple):
    """One panel of Figures 4.13 and 4.17: time [s], V before the inverse, counts."""

    volts: float
    shape: str
    t: Array
    sent: Array
    bench: Array
    initial: Array
    tuned: Array

    @property
    def initial_error(self) -> float:
        """NRMSE of the initial model's position [%]."""
        return nrmse(self.initial, self.bench)

    @property
    def tuned_error(self) -> float:
        """NRMSE of the tuned model's position [%]."""
        return nrmse(self.tuned, self.bench)


def fitted(found: Found, kind: int = TUNED) -> MacroModel:
    linear = Linear(float(found.linear.a[0]), float(found.linear.b[0]), DT)
    zone = found.zone
    return MacroModel(linear, kind, zone.width, zone.both.a0, zone.both.delta)


def collect(plant: Machine, found: Found) -> list[Case]:
    cases = []
    for volts, half in HALVES.items():
        t = signals.times(2.0 * half * PERIODS, DT)
        for shape in SHAPES:
            if shape == "square":
                wave = signals.square(t, volts, 2.0 * half)
            else:
                wave = signals.sine(t, volts, 0.5 / half)
            motor = wave + found.zone.width * np.sign(wave)
            measured = open_loop(plant, motor, START + 0.5)["macro_position"]
            models = [macro.simulate(fitted(found, k), motor, START) for k in (INITIAL, TUNED)]
            cases.append(Case(volts, shape, t, wave, measured, *models))
    return cases


def speed_error(case: Case, model: Array) -> float:
    """Steady speed of the model minus the bench's [counts/s], averaged over half periods.

    Speeds along the motion over the second half of each; for square inputs.
    """
    rows = round(HALVES[case.volts] / DT)
    gaps = []
    for k in range(0, len(case.t) - rows + 1, rows):
        a, b = k + rows // 2, k + rows - 1
        way = np.sign(case.sent[a])
        gaps.append(way * ((model[b] - model[a]) - (case.bench[b] - case.bench[a])) / (b - a) / DT)
    return float(np.mean(gaps))


def speed(case: Case) -> float:
    """The bench's steady speed along the motion [counts/s], computed as in `speed_error`."""
    rows = round(HALVES[case.volts] / DT)
    found = []
    for k in range(0, len(case.t) - rows + 1, rows):
        a, b = k + rows // 2, k + rows - 1
        found.append(np.sign(case.sent[a]) * (case.bench[b] - case.bench[a]) / (b - a) / DT)
    return float(np.mean(found))


def claims(cases: list[Case]) -> list[Claim]:
    return [_initial(cases), _tuned(cases)]


def _initial(cases: list[Case]) -> Claim:
    square = [c for c in cases if c.shape == "square"]
    gaps = [speed_error(c, c.initial) for c in square]
    speeds = [speed(c) for c in square]
    low, middle, high = (abs(g) for g in gaps)
    missed = all(abs(gaps[k]) >= MISSED * abs(speeds[k]) > 0.0 for k in (0, 2))
    right = middle <= MISSED * speeds[1]
    shares = [100.0 * g / v if v else float("nan") for g, v in zip(gaps, speeds, strict=True)]
    return stated(
        "M7",
        gaps,
        min(low, high) >= 4.0 * middle and missed and right,
        shares=_list(shares),
        inputs=_names(cases),
        errors=_list([c.initial_error for c in cases]),
    )


def _tuned(cases: list[Case]) -> Claim:
    initial = [c.initial_error for c in cases]
    tuned = [c.tuned_error for c in cases]
    fits = accepts("M8", *tuned) and all(b <= a + 1.0 for a, b in zip(initial, tuned, strict=True))
    return stated("M8", tuned, fits, inputs=_names(cases), initial=_list(initial))


def _names(cases: list[Case]) -> str:
    return ", ".join(f"{c.volts:g} V {c.shape}" for c in cases)


def _list(values: list[float]) -> str:
    return ", ".join(f"{v:.1f}" for v in values)
