"""What the page of a piezo stage shows: its figures in words and pictures, and what is doubtful."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from macromicro.commission.piezo_curves import Curve, apart
from macromicro.commission.piezo_curves import curves as reversal_curves
from macromicro.commission.piezo_loops import Loops, predicted
from macromicro.commission.procedure import Drawn, Estimate, Work
from macromicro.commission.stand import Record
from macromicro.drawing.style import BLACK, BLUE, RED, finish, line, new
from macromicro.identify.witnesses import within

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_POOR = 0.01  # of the stroke: plays and creep leave that much
_APART = 0.03  # of the widest loop: a first-order curve opens otherwise than the plays
_SWUNG = 0.2  # s of the steps that are drawn


def estimates(found: Any) -> dict[str, Estimate]:
    """What the model says.

    Parameters
    ----------
    found : Model
        Of `piezo`.

    Returns
    -------
    dict[str, Estimate]
        By short names.
    """
    loops, swing = found.loops, found.swing
    slow = within(loops.freedom)
    quick = within(max(swing.freedom, 1.0))
    creep, stroke, width = loops.spread
    made = {
        "stroke": Estimate("stroke of a slow cycle", loops.stroke, slow * stroke, "m"),
        "hysteresis": Estimate("width of its loop, of the stroke", loops.width, slow * width, "1"),
        "creep": Estimate("creep per decade of time", loops.creep, slow * creep, "1"),
    }
    names = ("resonance", "damping", "lag", "slew")
    meanings = ("resonance", "its damping ratio", "lag of the effort", "greatest rate")
    values = (swing.frequency, swing.damping, swing.lag, swing.slew)
    units = ("Hz", "1", "s", "V/s")
    for name, *rest, unit, sure in zip(names, meanings, values, units, swing.spread, strict=True):
        meaning, value = rest
        made[name] = Estimate(str(meaning), float(value), quick * sure, str(unit))
    return made


def rows(work: Work) -> list[tuple[str, ...]]:
    """What the steps found, a line each.

    Parameters
    ----------
    work : Work
        With all steps done.

    Returns
    -------
    list[tuple[str, ...]]
        Quantity, value, half interval, unit.
    """
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
    """What a person should look at before the result is relied on.

    Parameters
    ----------
    work : Work
        With all steps done.
    model : Model
        Of `piezo`.

    Returns
    -------
    list[str]
        A sentence each.
    """
    said = []
    reach, loops, swing = work["reach"], model.loops, model.swing
    for why, end in zip(reach.ended, ("low", "high"), strict=True):
        if why == 1.0:
            said.append(f"The window ended the {end} side; the effort would have gone on.")
        if why == 2.0:
            said.append(f"At the {end} end it moved no more: a stop, or the end of the sensor?")
    if loops.rms > _POOR * loops.stroke:
        said.append(
            f"Play operators and creep leave {loops.rms / loops.stroke:.1%} of the stroke: drift, "
            "or a loop that is not the same everywhere?"
        )
    every = reversal_curves(work["swings"][-1], loops, work.stand.dt)
    if apart(every) > _APART:
        worst = max(every, key=lambda c: abs(c.opening - c.modelled))
        said.append(
            f"The first-order curve from {worst.turn:.3g} V opens by {worst.opening * 1e6:.3g} um, "
            f"the plays' by {worst.modelled * 1e6:.3g} um: the loop is not the same at all places, "
            "and what the law takes it for is wrong by that."
        )
    if not swing.limited:
        said.append("No step was limited in its rate: the greatest rate is what was seen, no more.")
    if swing.damping > 0.2:
        said.append("The resonance is strongly damped: is the amplifier's own servo on?")
    return said


def loop(swings: Sequence[Record], found: Loops, dt: float) -> Figure:
    """The slow swings, and what plays and creep leave of them.

    Parameters
    ----------
    swings : Sequence[Record]
        The records.
    found : Loops
        The fit.
    dt : float
        Control period, s.

    Returns
    -------
    Figure
        One picture.
    """
    figure, axes = new(4.6, 2, len(swings))
    for k, swing in enumerate(swings):
        u, x, left = predicted(found, swing, dt)
        line(axes[0, k], u, (x - x[0]) * 1e6, BLUE, "")
        line(axes[1, k], u, left * 1e9, BLACK, "")
        title = "swing that dies away" if not k else "partial swings"
        finish(axes[0, k], title, "", "[um]" if not k else "")
        finish(axes[1, k], "measured less plays and creep", "effort [V]", "[nm]" if not k else "")
    return figure


def curves(every: Sequence[Curve]) -> Figure:
    """First-order reversal curves, and how wide they open.

    Parameters
    ----------
    every : Sequence[Curve]
        The curves.

    Returns
    -------
    Figure
        Two pictures.
    """
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
    finish(axes[0, 1], "How wide they open", "turned at [V]", "[um]", legend=True)
    return figure


def ringing(steps: Sequence[Record]) -> Figure:
    """What follows a small and a large step.

    Parameters
    ----------
    steps : Sequence[Record]
        The records.

    Returns
    -------
    Figure
        One picture.
    """
    picked = (steps[0], steps[-2])
    figure, axes = new(2.8, 1, len(picked))
    for k, one in enumerate(picked):
        shown = one.t <= _SWUNG
        line(axes[0, k], one.t[shown] * 1e3, (one.x - one.x[0])[shown] * 1e6, RED, "")
        size = one.u[-1] - one.u[0]
        finish(axes[0, k], f"step of {size:.2g} V", "time [ms]", "[um]" if not k else "")
    return figure


def weights(found: Loops) -> Figure:
    """Weights over thresholds.

    Parameters
    ----------
    found : Loops
        The fit.

    Returns
    -------
    Figure
        One picture.
    """
    figure, axes = new(2.6, 1)
    at = np.array(found.thresholds[1:])
    axes[0, 0].bar(at, np.array(found.weights[1:]) * 1e6, width=0.7 * at[0], color=BLUE)
    finish(axes[0, 0], "Weights of the plays", "threshold [V]", "[um/V]")
    return figure


FIGURES = {
    "loop": Drawn(
        "Hysteresis",
        "Slow swings once both ends had been reached, and what plays and creep leave of them.",
        lambda work, model: loop(work["swings"], model.loops, work.stand.dt),
    ),
    "curves": Drawn(
        "First-order reversal curves",
        "From the top down to a turning point and up again, beside the plays; the widest distance "
        "between both ways.",
        lambda work, model: curves(reversal_curves(work["swings"][-1], model.loops, work.stand.dt)),
    ),
    "weights": Drawn(
        "Plays",
        "Weights of the play operators that hold back; the one without a threshold is not drawn.",
        lambda work, model: weights(model.loops),
    ),
    "ringing": Drawn(
        "Ringing",
        "What follows a small and the largest step, from which resonance and lag were found.",
        lambda work, model: ringing(work["steps"]),
    ),
}
