"""Open-loop models of the macro-stage (Sections 4.2.2, 4.2.4, 4.2.5): claims M2 to M8."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.control import deadzone
from macromicro.drawing.exhibit import Drawn
from macromicro.drawing.style import BLACK, BLUE, GREEN, RED, finish, line, new, smooth
from macromicro.identify.records import average_runs, differentiated
from macromicro.lab.drive import DT
from macromicro.models import macro
from macromicro.recording import Recording
from macromicro.thesis.captions import captioned
from macromicro.thesis.chapter4 import _friction_runs, _identification_runs, _validation
from macromicro.thesis.chapter4._identification_runs import MacroModel
from macromicro.thesis.chapter4._validation import Case
from macromicro.thesis.claims import DIFFERS, REPRODUCED, Claim, judged, printed, stated, within
from macromicro.thesis.contents import procedure
from macromicro.thesis.procedure import Lab


class IdentificationData(NamedTuple):
    steps: dict[float, list[Recording]]
    found: MacroModel
    cases: list[Case]


def collect(lab: Lab) -> IdentificationData:
    plant = lab.bench()
    width = _friction_runs.measured(plant).width
    steps = _identification_runs.collect(plant, lab.seed, width)
    found = _identification_runs.identified(steps, width)
    return IdentificationData(steps, found, _validation.collect(plant, found))


def claims(data: IdentificationData) -> list[Claim]:
    first = ("M2", "M3", "M3b", "M4a", "M4b", "M5", "M6a", "M6b")
    return judged(
        [
            (first, lambda: open_loop(data.found)),
            (("M7", "M8"), lambda: _validation.claims(data.cases)),
        ]
    )


def averaged(data: IdentificationData) -> tuple[Array, Array, Array]:
    """Mean position [counts] of the 1 V steps (n,), speed and the model's [counts/s] (n-1,)."""
    width = data.found.zone.width
    runs = [
        (r["motor"] - width * np.sign(r["motor"]), r["macro_position"]) for r in data.steps[1.0]
    ]
    u, x = average_runs(runs)
    u, y = differentiated(u, x, DT)
    return x, y, data.found.linear.simulate(u)


def _step(data: IdentificationData) -> Drawn:
    x, y, model = averaged(data)
    linear = data.found.linear
    t = data.steps[1.0][0]["t"][: len(x)]
    figure, axes = new(3.4, 1, 2)
    line(axes[0, 0], t, x, BLUE, "mean of the runs")
    place = np.concatenate([[0.0], np.cumsum(model) * DT])
    line(axes[0, 0], t, place, RED, "model", linestyle=":", linewidth=1.6)
    line(axes[0, 1], t[1:], y, BLUE, "mean of the runs", linewidth=0.7)
    line(axes[0, 1], t[1:], model, RED, "model", linewidth=1.6)
    finish(axes[0, 0], "(a) position", y="position [counts]")
    finish(axes[0, 1], "(b) speed", y="speed [counts/s]")
    for ax in axes[0]:
        ax.legend(fontsize=7.5, loc="lower right", frameon=False)
    a, b = float(linear.a[0]), float(linear.b[0])
    return captioned("4.11", figure, steps=len(data.steps[1.0]), b=b, pole=-a)


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
    return captioned("4.17" if tuned else "4.13", figure)


def _jump_zone(found: MacroModel, volts: Array) -> Array:
    """The tuned friction model (Figure 4.14) at each of `volts` [V]."""
    zone = found.zone
    a0, delta = zone.both.a0, zone.both.delta
    return np.array([macro.jump_zone(zone.width, a0, delta, float(v)) for v in volts])


def _friction_model(data: IdentificationData) -> Drawn:
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
        axes[0, 2].plot(
            [volts],
            [speed / zone.gain],
            color=RED,
            marker="o",
            markersize=5,
            markerfacecolor=RED if np.isclose(side.volts, volts).any() else "none",
            linestyle="none",
            label="bench" if volts == 1.0 else "",
        )
    line(axes[0, 2], np.array([-2.0, 2.0]), np.array([-2.0, 2.0]), BLACK, "", linestyle=":")
    finish(axes[0, 0], "(a) tuned friction model", "in [V]", "out [V]")
    finish(axes[0, 1], "(b) dead-zone inverse", "in [V]")
    finish(axes[0, 2], "(c) the inverse, then (a)", "in [V]")
    axes[0, 2].set_xlim(-2.2, 2.2)
    axes[0, 2].legend(fontsize=7.5, loc="upper left", frameon=False)
    return captioned("4.14", figure, side=side, zone=zone)


def open_loop(found: MacroModel) -> list[Claim]:
    return [*_speeds(found), *_linear(found), *_jump(found)]


def _speeds(found: MacroModel) -> list[Claim]:
    slow, middle, fast = (found.speeds[volts] for volts in (0.1, 1.0, 2.0))
    return [
        stated("M2", slow),
        stated("M3", middle),
        stated("M3b", fast, line=found.zone.speed(2.0)),
    ]


def _linear(found: MacroModel) -> list[Claim]:
    a, b, gain = float(found.linear.a[0]), float(found.linear.b[0]), found.linear.gain
    den, num = found.linear.with_integrator()
    pole = within("M4a", a)
    size = within("M4b", b) if abs(gain / printed("M3") - 1.0) <= 0.03 else DIFFERS
    return [
        stated("M4a", a, pole),
        stated("M4b", b, size, gain=gain),
        stated("M5", [float(num[0]), float(den[0]), float(den[1])], pole == size == REPRODUCED),
    ]


def _jump(found: MacroModel) -> list[Claim]:
    side = found.zone.both
    apart = abs(found.zone.positive.a0 - found.zone.negative.a0)
    return [stated("M6a", side.a0, apart=apart), stated("M6b", side.delta)]


PROCEDURE = procedure(
    "macro-identification",
    {
        "4.11": _step,
        "4.13": partial(_responses, False),
        "4.14": _friction_model,
        "4.17": partial(_responses, True),
    },
    collect,
    claims,
)
