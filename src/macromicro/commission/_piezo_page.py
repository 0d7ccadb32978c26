"""Page of a piezo stage: values, figures and points to check."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from macromicro.commission._piezo_fit import Curve, Loops, apart, predicted
from macromicro.commission._piezo_fit import curves as reversal_curves
from macromicro.commission.procedure import Drawn, Estimate, Work
from macromicro.commission.stand import Record
from macromicro.drawing.style import BLACK, BLUE, RED, finish, line, new

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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
    return [
        (
            "gain at a low voltage",
            f"{gain.gain * 1e6:.4g}",
            f"+- {2 * gain.scatter * 1e6:.2g}",
            "um/V",
        ),
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
        u, x, left = predicted(found, swing, dt)
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
