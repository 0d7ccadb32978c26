"""Commissioning of a piezo stage: gain, range, hysteresis, creep and resonance."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from macromicro.commission import _piezo_fit, _piezo_page, margins
from macromicro.commission import piezo_drives as drives
from macromicro.commission._piezo_fit import Loops, Swing
from macromicro.commission._settings import texts
from macromicro.commission.courses import Corner, course, decaying, played
from macromicro.commission.margins import DRAWS, SEED, Robust
from macromicro.commission.piezo_drives import (
    GAIN,
    REACH,
    REST,
    SLOW,
    STEPS,
    SWINGS,
    SWUNG,
    Gain,
    Reach,
)
from macromicro.commission.procedure import SIMULATED, Kind, Robustness, Step, Work
from macromicro.machines import loops, piezo_loop
from macromicro.machines.loops import Complex

if TYPE_CHECKING:
    from macromicro.arrays import Array

_SPARE = 0.05  # of the reach that targets leave free
_ROUNDED = 0.3  # of a count: standard deviation by rounding
_SENSOR = 0.1  # of the reach that the sensor shows beyond it at least


class Model(NamedTuple):
    loops: Loops  # hysteresis and creep
    swing: Swing  # resonance and what precedes it


def _ready(work: Work) -> None:
    work.stand.facing = work[GAIN].sign


def fitted(work: Work) -> Model:
    dt = work.stand.dt
    loops = _piezo_fit.fitted_loops(work[SWINGS], dt)
    reach, steps = work[REACH], work[STEPS]
    before = (reach.lowest, reach.highest, 0.0, float(steps[0].u[0]))
    noise = max(work[GAIN].noise, _ROUNDED * work.stand.pitch)
    swing = _piezo_fit.fitted_swing(steps, dt, before, noise, loops)
    return Model(loops, swing)


def settings(work: Work, found: Model, home: Any) -> dict[str, str]:
    reach, gain, stand = work[REACH], work[GAIN], work.stand
    loops, swing = found.loops, found.swing
    room = _SENSOR * (reach.high - reach.low)
    figures = {
        "amplifier.low": (reach.lowest, "V"),
        "amplifier.high": (reach.highest, "V"),
        "amplifier.bandwidth": (1.0 / (2.0 * math.pi * swing.lag), "Hz"),
        "amplifier.current": (swing.slew * 1e-6, "A"),
        "amplifier.capacitance": (1e-6, "F"),
        "stack.stroke": (loops.stroke, "m"),
        "stack.span": (reach.extent, "V"),
        "guide.resonance": (swing.frequency, "Hz"),
        "guide.load": (0.0, "kg"),
        "encoder.noise": (gain.noise, "m"),
        "encoder.pitch": (stand.pitch, "m"),
        "encoder.low": (min(reach.low - room, 0.0), "m"),
        "encoder.high": (reach.high + room, "m"),
        "timing.period": (stand.dt, "s"),
        "timing.delay": (0.0, "s"),
        "travel.low": (0.0, "m"),
        "travel.high": ((1.0 - _SPARE) * reach.high, "m"),
    }
    plain = {
        "amplifier.gain": 1.0,
        "stack.hysteresis": loops.width,
        "creep.share": loops.creep,
        "hidden.stronger": 1.0,
        "hidden.detuned": 1.0,
        "hidden.damping": swing.damping,
    }
    lists = {
        "controller.loop_thresholds": [f"{r:.9g} V" for r in loops.thresholds],
        "controller.loop_weights": [f"{1e6 * w:.9g} um/V" for w in loops.weights],
    }
    return {
        **texts(figures, plain),
        **{path: "[" + ", ".join(f'"{v}"' for v in values) + "]" for path, values in lists.items()},
    }


def home(work: Work, found: Model) -> None:
    reach, stand = work[REACH], work.stand
    rate = reach.extent / SLOW
    efforts = [reach.highest, reach.lowest]
    efforts += [*decaying(0.0, 0.9 * -reach.lowest, SWUNG), 0.0]
    caution = work.options.caution(work.options.speed).anywhere
    corners = [Corner(u, REST, rate) for u in efforts]
    played(stand, course([*corners, Corner(0.0, 1.0, rate)], stand.dt), caution)


_FAR_BELOW = 1e-3  # of the slower integral


def drawn_models(
    settings: Any, model: Model, frequency: Array, number: int, seed: int = SEED
) -> Iterator[Complex]:
    """Drawn stages with another stroke than the one inverted, and another resonance."""
    random = np.random.Generator(np.random.PCG64(seed))
    loop, swing = model.loops, model.swing
    wide = np.array([loop.spread[1] / loop.stroke, *np.divide(swing.spread[:3], swing[:3])])
    hidden, amplifier = settings.hidden, settings.amplifier
    for off in random.standard_normal((number, 4)) * wide:
        stroke, resonance, damping, lag = np.maximum(1.0 + off, 0.05).tolist()
        one = settings._replace(
            hidden=hidden._replace(
                detuned=resonance * hidden.detuned, damping=damping * hidden.damping
            ),
            amplifier=amplifier._replace(bandwidth=amplifier.bandwidth / lag),
        )
        yield stroke * piezo_loop.plant(one, frequency)


def robust_loop(settings: Any, model: Model) -> Robust:
    p, dt = settings.controller, settings.timing.period
    frequency = loops.grid(dt, _FAR_BELOW * (p.drift if p.drift > 0.0 else p.integral))
    law = piezo_loop.law(p, frequency, dt)
    every = (law * one for one in drawn_models(settings, model, frequency, DRAWS))
    found = law * piezo_loop.plant(settings, frequency)
    return margins.robust(frequency, found, every)


def robustness(settings: Any, model: Model) -> Robustness:
    return margins.told(robust_loop(settings, model), "a sensor with less noise")


KIND = Kind(
    name="piezo",
    steps=(
        Step(GAIN, "sign and gain at a low voltage", drives.gain_intent, drives.gain, Gain),
        Step(REACH, "reachable travel", drives.reach_intent, drives.reach, Reach),
        Step(
            SWINGS,
            "slow swings for hysteresis and creep",
            drives.swings_intent,
            drives.swings,
            None,
        ),
        Step(STEPS, "steps for the resonance", drives.steps_intent, drives.steps, None),
    ),
    turned=(
        "A positive effort made the reading fall: reverse the sensor's sign before using this file."
    ),
    note=f"Efforts are volts at the D/A; the amplifier is part of the stage. {SIMULATED}",
    prepare=_ready,
    model=fitted,
    settings=settings,
    head=(
        "The amplifier's gain is 1 below: one volt at the stack is one volt at the D/A. Its "
        "current and\ncapacitance only express the slew rate. What is not below was not "
        "measured and is that of the default\nstage, PI's P-621.1CD: stiffness of the guide, "
        "warming, spread of the plays."
    ),
    homing="A slow decaying swing brings the stage to rest at 0 V; it takes this position as 0",
    home=home,
    rows=_piezo_page.rows,
    estimates=_piezo_page.estimates,
    doubts=_piezo_page.doubts,
    figures=_piezo_page.FIGURES,
    margins=robustness,
    one_way=True,
)
