"""Commissioning of a piezo stage: gain, range, hysteresis, creep and resonance."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.commission import _piezo_fit, margins
from macromicro.commission import piezo_drives as drives
from macromicro.commission._piezo_fit import Curve, Loops, Swing, apart, predict
from macromicro.commission._piezo_fit import curves as reversal_curves
from macromicro.commission._settings import texts
from macromicro.commission.courses import Corner, course, decaying, play
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
from macromicro.commission.procedure import SIMULATED, Drawn, Estimate, Kind, Robustness, Step, Work
from macromicro.commission.stand import Record
from macromicro.drawing.style import BLACK, BLUE, RED, finish, line, new
from macromicro.machines import loops, piezo_loop
from macromicro.machines.loops import Complex

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_SPARE = 0.05  # of the reach that targets leave free
_ROUNDED = 0.3  # of a count: standard deviation by rounding
_SENSOR = 0.1  # of the reach that the sensor shows beyond it at least


class Model(NamedTuple):
    loops: Loops  # hysteresis and creep
    swing: Swing  # resonance and what precedes it


def _ready(work: Work) -> None:
    work.stand.facing = work[GAIN].sign


def fit(work: Work) -> Model:
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
    play(stand, course([*corners, Corner(0.0, 1.0, rate)], stand.dt), caution)


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
    return margins.as_robustness(robust_loop(settings, model), "a sensor with less noise")


_POOR = 0.01  # of the stroke: plays and creep leave that much
_APART = 0.03  # of the widest loop: a first-order curve opens otherwise than the plays
_SWUNG = 0.2  # s of the steps that are drawn


def estimates(found: Any) -> dict[str, Estimate]:
    loops, swing = found.loops, found.swing
    creep, stroke, width = loops.half
    made = {
        "stroke": Estimate("stroke of a slow cycle", loops.stroke, stroke, "m"),
        "hysteresis": Estimate("width of its loop, of the stroke", loops.width, width, "1"),
        "creep": Estimate("creep per decade of time", loops.creep, creep, "1"),
    }
    names = ("resonance", "damping", "lag", "slew")
    meanings = ("resonance", "its damping ratio", "lag of the effort", "greatest rate")
    values = (swing.frequency, swing.damping, swing.lag, swing.slew)
    units = ("Hz", "1", "s", "V/s")
    rows = zip(names, meanings, values, swing.half, units, strict=True)
    made |= {name: Estimate(*one) for name, *one in rows}
    return made


def rows(work: Work) -> list[tuple[str, ...]]:
    reach, gain = work["reach"], work["gain"]
    half = f"+- {2 * gain.scatter * 1e6:.2g}"
    return [
        ("gain at a low voltage", f"{gain.gain * 1e6:.4g}", half, "um/V"),
        ("noise of the reading", f"{gain.noise * 1e9:.3g}", "", "nm rms"),
        ("efforts", f"{reach.lowest:.3g} to {reach.highest:.3g}", "", "V"),
        ("reached from rest", f"{reach.low * 1e6:.5g} to {reach.high * 1e6:.5g}", "", "um"),
    ]


def doubts(work: Work, model: Any) -> list[str]:
    said = []
    reach, loops, swing = work["reach"], model.loops, model.swing
    for why, end in zip(reach.ended, ("low", "high"), strict=True):
        if why == 1.0:
            said.append(f"The window ended the {end} side before the effort did.")
        if why == 2.0:
            said.append(
                f"The motion stopped at the {end} end: a stop, or the end of the sensor's range."
            )
    if loops.rms > _POOR * loops.stroke:
        said.append(
            f"Plays and creep leave a residual of {loops.rms / loops.stroke:.1%} of the "
            "stroke. Check for drift, or a loop that varies with position."
        )
    every = reversal_curves(work["swings"][-1], loops, work.stand.dt)
    if apart(every) > _APART:
        worst = max(every, key=lambda c: abs(c.opening - c.modelled))
        said.append(
            f"The first-order curve from {worst.turn:.3g} V is {worst.opening * 1e6:.3g} um "
            f"wide, that of the plays {worst.modelled * 1e6:.3g} um: the loop varies with "
            "position, and the compensation of the law is wrong by the difference."
        )
    if not swing.limited:
        said.append(
            "No step reached the slew-rate limit: the greatest rate is only the greatest one seen."
        )
    if swing.damping > 0.2:
        said.append(
            "The resonance is strongly damped. Check whether the amplifier's own servo is on."
        )
    return said


def loop(swings: Sequence[Record], found: Loops, dt: float) -> Figure:
    """The slow swings, and the residual of plays and creep."""
    figure, axes = new(4.6, 2, len(swings))
    for k, swing in enumerate(swings):
        u, x, left = predict(found, swing, dt)
        line(axes[0, k], u, (x - x[0]) * 1e6, BLUE, "")
        line(axes[1, k], u, left * 1e9, BLACK, "")
        title = "decaying swing" if not k else "partial swings"
        finish(axes[0, k], title, "", "[um]" if not k else "")
        finish(axes[1, k], "measured less plays and creep", "effort [V]", "[nm]" if not k else "")
    return figure


def curves(every: Sequence[Curve]) -> Figure:
    """First-order reversal curves and their widths."""
    figure, axes = new(2.8, 1, 2)
    for k, one in enumerate(every):
        x, model = ((values - one.x[0]) * 1e6 for values in (one.x, one.model))
        line(axes[0, 0], one.u, x, BLUE, "" if k else "measured")
        line(axes[0, 0], one.u, model, RED, "" if k else "plays", linestyle="--")
    turns = np.array([one.turn for one in every])
    opened = np.array([(one.opening, one.modelled) for one in every]).reshape(-1, 2) * 1e6
    axes[0, 1].plot(turns, opened[:, 0], "o", color=BLUE, label="measured")
    axes[0, 1].plot(turns, opened[:, 1], "x", color=RED, label="plays")
    finish(axes[0, 0], "First-order curves", "effort [V]", "from the top [um]", legend=True)
    finish(axes[0, 1], "Width", "turning point [V]", "[um]", legend=True)
    return figure


def ringing(steps: Sequence[Record]) -> Figure:
    picked = (steps[0], steps[-2])
    figure, axes = new(2.8, 1, len(picked))
    for k, one in enumerate(picked):
        shown = one.t <= _SWUNG
        line(axes[0, k], one.t[shown] * 1e3, (one.x - one.x[0])[shown] * 1e6, RED, "")
        size = one.u[-1] - one.u[0]
        finish(axes[0, k], f"step of {size:.2g} V", "time [ms]", "[um]" if not k else "")
    return figure


def weights(found: Loops) -> Figure:
    figure, axes = new(2.6, 1)
    at = np.array(found.thresholds[1:])
    axes[0, 0].bar(at, np.array(found.weights[1:]) * 1e6, width=0.7 * at[0], color=BLUE)
    finish(axes[0, 0], "Weights of the plays", "threshold [V]", "[um/V]")
    return figure


FIGURES = {
    "loop": Drawn(
        "Hysteresis",
        "Slow swings after both ends have been reached, and the residual of plays and creep.",
        lambda work, model: loop(work["swings"], model.loops, work.stand.dt),
    ),
    "curves": Drawn(
        "First-order reversal curves",
        "From the top down to a turning point and up again, with the plays; the largest "
        "distance between both branches.",
        lambda work, model: curves(reversal_curves(work["swings"][-1], model.loops, work.stand.dt)),
    ),
    "weights": Drawn(
        "Plays",
        "Weights of the play operators with a threshold.",
        lambda work, model: weights(model.loops),
    ),
    "ringing": Drawn(
        "Ringing",
        "Ringing after a small and the largest step, from which resonance and lag were identified.",
        lambda work, model: ringing(work["steps"]),
    ),
}


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
    model=fit,
    settings=settings,
    head=(
        "The amplifier's gain is 1 below: one volt at the stack is one volt at the D/A. Its "
        "current and\ncapacitance only express the slew rate. What is not below was not "
        "measured and is that of the default\nstage, PI's P-621.1CD: stiffness of the guide, "
        "warming, spread of the plays."
    ),
    homing="A slow decaying swing brings the stage to rest at 0 V; it takes this position as 0",
    home=home,
    rows=rows,
    estimates=estimates,
    doubts=doubts,
    figures=FIGURES,
    margins=robustness,
    one_way=True,
)
