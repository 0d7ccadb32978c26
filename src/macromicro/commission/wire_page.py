"""What the page of a wire shows: its figures in words and pictures, and what is doubtful."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from macromicro.commission.procedure import Drawn, Estimate, Work
from macromicro.commission.stand import Record
from macromicro.commission.wire_curves import Curves, curves, spread
from macromicro.commission.wire_fit import Wire
from macromicro.commission.wire_model import Heat, branch, simulated, thinned
from macromicro.drawing.style import BLACK, BLUE, RED, finish, line, new
from macromicro.identify.witnesses import within

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_DRIFT = 0.15  # of the loop's width: ways down that lie apart by more are doubtful
_POOR = 0.04  # of the way: the model leaves that much
MEANINGS = {
    "way": ("full contraction", "m"),
    "up": ("speed of contraction per effort", "m/(V s)"),
    "tau": ("time constant of its heat", "s"),
    "start": ("effort that begins to contract it", "V"),
    "end": ("effort that contracts it", "V"),
    "first": ("effort below which it extends", "V"),
    "last": ("effort below which it is extended", "V"),
}


def estimates(found: Wire) -> dict[str, Estimate]:
    """What the model says.

    Parameters
    ----------
    found : Wire
        Of the records.

    Returns
    -------
    dict[str, Estimate]
        By short names.
    """
    factor = within(found.freedom)
    made = {}
    for name, (meaning, unit) in MEANINGS.items():
        value = found.up if name == "up" else getattr(found.heat, name)
        made[name] = Estimate(meaning, float(value), factor * found.deviation(name), unit)
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
    warmth, ramp = work["warmth"], work["ramp"][0]
    return [
        ("noise of the reading", f"{warmth.noise * 1e6:.3g}", "", "um rms"),
        ("first seen to contract at", f"{warmth.effort:.3g}", "", "V, rising slowly"),
        ("contracted at", f"{ramp.u.max():.3g}", "", "V, rising slowly"),
    ]


def doubts(work: Work, model: Wire) -> list[str]:
    """What a person should look at before the result is relied on.

    Parameters
    ----------
    work : Work
        With all steps done.
    model : Wire
        Of the records.

    Returns
    -------
    list[str]
        A sentence each.
    """
    p, said = model.heat, []
    if model.rms > _POOR * p.way:
        said.append(
            f"The model leaves {model.rms / p.way:.1%} of the way: moving air, or something in its "
            "way?"
        )
    if p.end > 0.9 * work.options.effort:
        said.append(
            f"{p.end:.3g} V keep it contracted and {work.options.effort:.3g} V are all there is: "
            "it contracts slowly at its end; allow a larger --effort."
        )
    width = 0.5 * (p.start + p.end - p.first - p.last)
    apart = spread(_curves(work, model))
    if apart > _DRIFT * width:
        said.append(
            f"The ways down of the first-order curves lie {apart:.2g} V apart, of a loop of "
            f"{width:.3g} V: the heat's balance does not hold along them. Does the air move?"
        )
    if math.isclose(p.first, p.last, rel_tol=0.02):
        said.append("It extends within a very small range of heat: is its load too large?")
    return said


def records(every: Sequence[Record], found: Wire, dt: float) -> Figure:
    """The slow ramp and the pulses, and the model's free run.

    Parameters
    ----------
    every : Sequence[Record]
        Ramp, then pulses.
    found : Wire
        The model.
    dt : float
        Control period, s.

    Returns
    -------
    Figure
        One picture.
    """
    figure, axes = new(5.0, 2, len(every))
    for k, one in enumerate(every):
        thin = thinned(one, dt)
        line(axes[0, k], thin.t, thin.x * 1e3, BLUE, "measured")
        free = simulated(found.heat, thin, found.begin[k])
        line(axes[0, k], thin.t, free * 1e3, RED, "model", linestyle="--")
        line(axes[1, k], thin.t, thin.u, RED, "")
        finish(axes[0, k], "pulses" if k else "slow ramp", "", "" if k else "[mm]", legend=not k)
        finish(axes[1, k], "effort", "time [s]", "" if k else "[V]")
    return figure


def loop(heat: Heat) -> Figure:
    """Contraction over steady effort, both ways, as the model has it.

    Parameters
    ----------
    heat : Heat
        The model.

    Returns
    -------
    Figure
        One picture.
    """
    figure, axes = new(2.8, 1)
    h = np.linspace(0.0, 1.1 * heat.end, 200)
    up = [branch((k - heat.start) / (heat.end - heat.start), heat.warming) for k in h]
    down = [branch((k - heat.last) / (heat.first - heat.last), heat.cooling) for k in h]
    line(axes[0, 0], h, heat.way * np.array(up) * 1e3, RED, "warming")
    line(axes[0, 0], h, heat.way * np.array(down) * 1e3, BLUE, "cooling")
    finish(axes[0, 0], "Loop", "steady effort [V]", "contraction [mm]", legend=True)
    return figure


def first_order(found: Curves, heat: Heat) -> Figure:
    """Contraction over the heat along first-order curves, and the branches of the model.

    Parameters
    ----------
    found : Curves
        As measured.
    heat : Heat
        The model.

    Returns
    -------
    Figure
        One picture.
    """
    figure, axes = new(3.2, 1)
    ax = axes[0, 0]
    h, x = found.first
    line(ax, h, x * 1e3, BLACK, "first warming")
    for k, one in enumerate(found.every):
        line(ax, one.heat, one.x * 1e3, BLUE, "" if k else "down, and up again")
    at = np.linspace(0.0, 1.1 * heat.end, 200)
    for low, high, bend in (
        (heat.start, heat.end, heat.warming),
        (heat.last, heat.first, heat.cooling),
    ):
        share = np.array([branch((v - low) / (high - low), bend) for v in at])
        name = "model" if low == heat.start else ""
        line(ax, at, heat.way * share * 1e3, RED, name, linestyle="--")
    finish(ax, "First-order curves", "heat [V]", "contraction [mm]", legend=True)
    return figure


def _curves(work: Work, model: Wire) -> Curves:
    return curves(work["curves"][0], model.heat, work.stand.dt)


FIGURES = {
    "records": Drawn(
        "Heating and cooling",
        "The slow ramp and the pulses, beside the model's free run under their efforts.",
        lambda work, model: records([*work["ramp"], *work["pulses"]], model, work.stand.dt),
    ),
    "loop": Drawn(
        "Hysteresis",
        "Contraction over the effort that keeps the heat, as the model has it.",
        lambda work, model: loop(model.heat),
    ),
    "curves": Drawn(
        "First-order curves",
        "Contraction over the heat, which follows from the effort and the measured contraction by "
        "the model's balance of heat; and the branches of the model.",
        lambda work, model: first_order(_curves(work, model), model.heat),
    ),
}
