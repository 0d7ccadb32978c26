"""Open-loop models of the macro-stage (Sections 4.2.2, 4.2.4, 4.2.5): claims M2 to M8."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from macromicro import signals
from macromicro.arrays import Array
from macromicro.control import deadzone
from macromicro.drawing.exhibit import Drawn
from macromicro.drawing.style import BLACK, BLUE, GREEN, RED, dots, finish, line, new, smooth
from macromicro.identify.deadzone import DiscontinuousDeadZone, discontinuous_dead_zone
from macromicro.identify.linear import LinearFit, mls
from macromicro.identify.records import average_runs, differentiated
from macromicro.lab.drive import DT, open_loop
from macromicro.lab.machine import Machine
from macromicro.models import macro
from macromicro.models.macro import INITIAL, TUNED, Linear, MacroModel
from macromicro.recording import Recording
from macromicro.rig.twin import noise_source
from macromicro.thesis.chapter4 import friction
from macromicro.thesis.chapter4.friction import TRAVEL
from macromicro.thesis.claims import (
    DIFFERS,
    REPRODUCED,
    Claim,
    accepts,
    judge,
    printed_value,
    state,
    within,
)
from macromicro.thesis.contents import caption
from macromicro.thesis.procedure import Lab

WIDTH = 3.0  # Section 4.2.3: the thesis' width of the dead-zone inverse [V]
RUNS = 10
SECONDS = {0.1: 1.45, 1.0: 0.65, 2.0: 0.4}  # of Figure 4.13; 2 V reaches the end of travel


class Identified(NamedTuple):
    linear: LinearFit  # (4.3), speed [counts/s] for V [V] beyond the dead zone
    zone: DiscontinuousDeadZone  # a0 and delta of (4.5) from 0.1 V and 1 V
    speeds: dict[float, float]  # steady [counts/s] by V [V], mean of both directions


def step_runs(
    plant: Machine, seed: int = 0, width: float = WIDTH, runs: int = RUNS
) -> dict[float, list[Recording]]:
    """`runs` steps for each V [V], in alternating directions, from places near each end."""
    draw = noise_source(seed)
    found: dict[float, list[Recording]] = {}
    for volts, seconds in SECONDS.items():
        found[volts] = []
        for k in range(runs):
            sign = 1.0 if k % 2 == 0 else -1.0
            place = 20.0 + 60.0 * float(draw.random())
            start = place if sign > 0.0 else TRAVEL[1] - place
            steps = np.full(round(seconds / DT), sign * (width + volts))
            found[volts].append(open_loop(plant, steps, start))
    return found


def identify(recordings: Mapping[float, Sequence[Recording]], width: float = WIDTH) -> Identified:
    averaged = {
        volts: average_runs([_before_inverse(r, width) for r in runs])
        for volts, runs in recordings.items()
    }
    u, y = differentiated(*averaged[1.0], DT)
    linear = mls(u, y, na=1, nb=1, dt=DT)
    both = [r for volts in (0.1, 1.0) for r in recordings[volts]]
    zone = discontinuous_dead_zone(both, linear.gain, width)
    return Identified(linear, zone, {v: _steady(x) for v, (_, x) in averaged.items()})


def _before_inverse(recording: Recording, width: float) -> tuple[Array, Array]:
    """V and position, with the dead-zone inverse removed from the recorded volts."""
    motor = recording["motor"]
    return motor - width * np.sign(motor), recording["macro_position"]


def _steady(x: Array) -> float:
    """Speed over the second half [counts/s]."""
    half = x[len(x) // 2 :]
    return float(half[-1] - half[0]) / ((len(half) - 1) * DT)


def measure(plant: Machine, seed: int = 0) -> Identified:
    """The whole procedure on a bench (M2 to M6), with the dead zone by M1."""
    width = friction.measure(plant).width
    return identify(step_runs(plant, seed, width), width)


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


def fit(found: Identified, kind: int = TUNED) -> MacroModel:
    linear = Linear(float(found.linear.a[0]), float(found.linear.b[0]), DT)
    zone = found.zone
    return MacroModel(linear, kind, zone.width, zone.both.a0, zone.both.delta)


def case_runs(plant: Machine, found: Identified) -> list[Case]:
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
            models = [macro.simulate(fit(found, k), motor, START) for k in (INITIAL, TUNED)]
            cases.append(Case(volts, shape, t, wave, measured, *models))
    return cases


def speed_error(case: Case, model: Array) -> float:
    """Steady speed of the model minus the bench's [counts/s], averaged over half periods.

    Speeds along the motion over the second half of each; for square inputs.
    """
    return _speed(case, lambda a, b: (model[b] - model[a]) - (case.bench[b] - case.bench[a]))


def speed(case: Case) -> float:
    """The bench's steady speed along the motion [counts/s], computed as in `speed_error`."""
    return _speed(case, lambda a, b: case.bench[b] - case.bench[a])


def _speed(case: Case, gone: Callable[[int, int], float]) -> float:
    """Mean speed over the half periods; `gone` is the way between two rows [counts]."""
    rows = round(HALVES[case.volts] / DT)
    found = []
    for k in range(0, len(case.t) - rows + 1, rows):
        a, b = k + rows // 2, k + rows - 1
        found.append(np.sign(case.sent[a]) * gone(a, b) / (b - a) / DT)
    return float(np.mean(found))


def case_claims(cases: list[Case]) -> list[Claim]:
    return [_initial(cases), _tuned_claim(cases)]


def _initial(cases: list[Case]) -> Claim:
    square = [c for c in cases if c.shape == "square"]
    gaps = [speed_error(c, c.initial) for c in square]
    speeds = [speed(c) for c in square]
    low, middle, high = (abs(g) for g in gaps)
    missed = all(abs(gaps[k]) >= MISSED * abs(speeds[k]) > 0.0 for k in (0, 2))
    right = middle <= MISSED * speeds[1]
    shares = [100.0 * g / v if v else float("nan") for g, v in zip(gaps, speeds, strict=True)]
    return state(
        "M7",
        gaps,
        min(low, high) >= 4.0 * middle and missed and right,
        shares=_list(shares),
        inputs=_names(cases),
        errors=_list([c.initial_error for c in cases]),
    )


def _tuned_claim(cases: list[Case]) -> Claim:
    initial = [c.initial_error for c in cases]
    tuned = [c.tuned_error for c in cases]
    fits = accepts("M8", *tuned) and all(b <= a + 1.0 for a, b in zip(initial, tuned, strict=True))
    return state("M8", tuned, fits, inputs=_names(cases), initial=_list(initial))


def _names(cases: list[Case]) -> str:
    return ", ".join(f"{c.volts:g} V {c.shape}" for c in cases)


def _list(values: list[float]) -> str:
    return ", ".join(f"{v:.1f}" for v in values)


def nrmse(model: Array, measured: Array) -> float:
    """RMS difference over the range of `measured` [%]."""
    return 100.0 * float(np.sqrt(np.mean((model - measured) ** 2)) / np.ptp(measured))


class IdentificationData(NamedTuple):
    steps: dict[float, list[Recording]]
    found: Identified
    cases: list[Case]


def collect(lab: Lab) -> IdentificationData:
    plant = lab.bench()
    width = friction.measure(plant).width
    steps = step_runs(plant, lab.seed, width)
    found = identify(steps, width)
    return IdentificationData(steps, found, case_runs(plant, found))


def claims(data: IdentificationData) -> list[Claim]:
    first = ("M2", "M3", "M3b", "M4a", "M4b", "M5", "M6a", "M6b")
    return judge(
        [
            (first, lambda: [*_speeds(data.found), *_linear(data.found), *_jump(data.found)]),
            (("M7", "M8"), lambda: case_claims(data.cases)),
        ]
    )


def average(data: IdentificationData) -> tuple[Array, Array, Array]:
    """Mean position [counts] of the 1 V steps (n,), speed and the model's [counts/s] (n-1,)."""
    width = data.found.zone.width
    u, x = average_runs([_before_inverse(r, width) for r in data.steps[1.0]])
    u, y = differentiated(u, x, DT)
    return x, y, data.found.linear.simulate(u)


def step(data: IdentificationData) -> Drawn:
    x, y, model = average(data)
    linear = data.found.linear
    t = data.steps[1.0][0]["t"][: len(x)]
    figure, axes = new(3.4, 1, 2)
    place, speed = axes[0]
    line(place, t, x, BLUE, "mean of the runs")
    gone = np.concatenate([[0.0], np.cumsum(model) * DT])
    line(place, t, gone, RED, "model", linestyle=":", linewidth=1.6)
    line(speed, t[1:], y, BLUE, "mean of the runs", linewidth=0.7)
    line(speed, t[1:], model, RED, "model", linewidth=1.6)
    finish(place, "(a) position", y="position [counts]", legend="lower right")
    finish(speed, "(b) speed", y="speed [counts/s]", legend="lower right")
    a, b = float(linear.a[0]), float(linear.b[0])
    return caption("4.11", figure, steps=len(data.steps[1.0]), b=b, pole=-a)


def _responses(tuned: bool, data: IdentificationData) -> Drawn:
    cases = data.cases
    figure, axes = new(6.6, 3, 2)
    name = "tuned model" if tuned else "initial model"
    for ax, letter, case in zip(axes.flat, "abcdef", cases, strict=True):
        model = case.tuned if tuned else case.initial
        error = case.tuned_error if tuned else case.initial_error
        smooth(ax, case.t, case.bench, BLUE, "bench")
        smooth(ax, case.t, model, RED, name, linestyle=":", linewidth=1.6)
        finish(
            ax,
            f"({letter}) {case.volts:g} V {case.shape} wave, {error:.1f} %",
            "time [s]" if case is cases[-1] or case is cases[-2] else "",
            "position [counts]" if case.shape == "square" else "",
        )
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, fontsize=8, loc="lower center", ncols=2, frameon=False)
    figure.subplots_adjust(bottom=0.12, hspace=0.42)
    return caption("4.17" if tuned else "4.13", figure)


def _jump_zone(found: Identified, volts: Array) -> Array:
    """The tuned friction model (Figure 4.14) at each of `volts` [V]."""
    zone = found.zone
    a0, delta = zone.both.a0, zone.both.delta
    return np.array([macro.jump_zone(zone.width, a0, delta, float(v)) for v in volts])


def friction_model(data: IdentificationData) -> Drawn:
    found = data.found
    zone, side = found.zone, found.zone.both
    end = 5.0
    figure, axes = new(3.2, 1, 3)
    inside = np.linspace(-zone.width, zone.width, 3)
    beyond = np.linspace(zone.width + 1e-9, end, 100)
    small = np.linspace(1e-9, end - zone.width, 100)
    # Branches apart: a line across a step would be drawn where there are no values.
    line(axes[0, 0], inside, _jump_zone(found, inside), BLUE, "")
    for sign in (1.0, -1.0):
        line(axes[0, 0], sign * beyond, _jump_zone(found, sign * beyond), BLUE, "")
        lifted = np.array([deadzone.inverse(zone.width, v) for v in sign * small])
        line(axes[0, 1], sign * small, lifted, GREEN, "")
        line(axes[0, 2], sign * small, _jump_zone(found, lifted), BLUE, "" if sign < 0 else "model")
    for volts, speed in found.speeds.items():
        label = "bench" if volts == 1.0 else ""
        face = RED if np.isclose(side.volts, volts).any() else "none"
        dots(axes[0, 2], [volts], [speed / zone.gain], RED, "o", label, markerfacecolor=face)
    line(axes[0, 2], np.array([-2.0, 2.0]), np.array([-2.0, 2.0]), BLACK, "", linestyle=":")
    finish(axes[0, 0], "(a) tuned friction model", "in [V]", "out [V]")
    finish(axes[0, 1], "(b) dead-zone inverse", "in [V]")
    finish(axes[0, 2], "(c) the inverse, then (a)", "in [V]", legend="upper left")
    axes[0, 2].set_xlim(-2.2, 2.2)
    return caption("4.14", figure, side=side, zone=zone)


def _speeds(found: Identified) -> list[Claim]:
    slow, middle, fast = (found.speeds[volts] for volts in (0.1, 1.0, 2.0))
    return [
        state("M2", slow),
        state("M3", middle),
        state("M3b", fast, line=found.zone.speed(2.0)),
    ]


def _linear(found: Identified) -> list[Claim]:
    a, b, gain = float(found.linear.a[0]), float(found.linear.b[0]), found.linear.gain
    den, num = found.linear.with_integrator()
    pole = within("M4a", a)
    size = within("M4b", b) if abs(gain / printed_value("M3") - 1.0) <= 0.03 else DIFFERS
    return [
        state("M4a", a, pole),
        state("M4b", b, size, gain=gain),
        state("M5", [float(num[0]), float(den[0]), float(den[1])], pole == size == REPRODUCED),
    ]


def _jump(found: Identified) -> list[Claim]:
    side = found.zone.both
    apart = abs(found.zone.positive.a0 - found.zone.negative.a0)
    return [state("M6a", side.a0, apart=apart), state("M6b", side.delta)]


initial_responses = partial(_responses, False)
tuned_responses = partial(_responses, True)
