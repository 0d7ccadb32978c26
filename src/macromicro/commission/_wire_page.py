"""Page of a wire: values, figures and points to check."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from macromicro.commission._wire_fit import Curves, Wire, curves, spread
from macromicro.commission.procedure import Drawn, Estimate, Work
from macromicro.commission.stand import Record
from macromicro.commission.wire_model import Heat, branch, simulated, thinned
from macromicro.drawing.style import BLACK, BLUE, RED, finish, line, new

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_DRIFT = 0.15  # of the loop's width: ways down that lie apart by more are doubtful
_POOR = 0.04  # of the way: the model leaves that much
MEANINGS = {
    "way": ("full contraction", "m"),
    "up": ("speed of contraction per effort", "m/(V s)"),
    "tau": ("time constant of its heat", "s"),
    "start": ("effort at which contraction begins", "V"),
    "end": ("effort for full contraction", "V"),
    "first": ("effort at which extension begins", "V"),
    "last": ("effort for full extension", "V"),
}


def estimates(found: Wire) -> dict[str, Estimate]:
    made = {}
    for name, (meaning, unit) in MEANINGS.items():
        value = found.up if name == "up" else getattr(found.heat, name)
        made[name] = Estimate(meaning, float(value), found.half_width(name), unit)
    return made


def rows(work: Work) -> list[tuple[str, ...]]:
    warmth, ramp = work["warmth"], work["ramp"][0]
    return [
        ("noise of the reading", f"{warmth.noise * 1e6:.3g}", "", "um rms"),
        ("first contraction at", f"{warmth.effort:.3g}", "", "V, rising slowly"),
        ("contracted at", f"{ramp.u.max():.3g}", "", "V, rising slowly"),
    ]


def doubts(work: Work, model: Wire) -> list[str]:
    p, said = model.heat, []
    if model.rms > _POOR * p.way:
        said.append(
            f"The model leaves a residual of {model.rms / p.way:.1%} of the travel. Check for "
            "moving air or an obstacle."
        )
    if p.end > 0.9 * work.options.effort:
        said.append(
            f"{p.end:.3g} V keep it contracted, and the limit is {work.options.effort:.3g} V: "
            "it contracts slowly at its end. Allow a larger --effort."
        )
    width = 0.5 * (p.start + p.end - p.first - p.last)
    apart = spread(_curves(work, model))
    if apart > _DRIFT * width:
        said.append(
            f"The cooling branches of the first-order curves lie {apart:.2g} V apart, with a "
            f"loop of {width:.3g} V: the heat balance does not hold along them. Check for "
            "moving air."
        )
    if math.isclose(p.first, p.last, rel_tol=0.02):
        said.append(
            "It extends within a very small range of heat. Check whether its load is too large."
        )
    return said


def records(every: Sequence[Record], found: Wire, dt: float) -> Figure:
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
    """The model's contraction over steady effort, both ways."""
    figure, axes = new(2.8, 1)
    h = np.linspace(0.0, 1.1 * heat.end, 200)
    up = [branch((k - heat.start) / (heat.end - heat.start), heat.warming) for k in h]
    down = [branch((k - heat.last) / (heat.first - heat.last), heat.cooling) for k in h]
    line(axes[0, 0], h, heat.way * np.array(up) * 1e3, RED, "warming")
    line(axes[0, 0], h, heat.way * np.array(down) * 1e3, BLUE, "cooling")
    finish(axes[0, 0], "Loop", "steady effort [V]", "contraction [mm]", legend=True)
    return figure


def first_order(found: Curves, heat: Heat) -> Figure:
    """Contraction over heat along first-order curves, and the model's branches."""
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
        "The slow ramp and the pulses with the model's free simulation.",
        lambda work, model: records([*work["ramp"], *work["pulses"]], model, work.stand.dt),
    ),
    "loop": Drawn(
        "Hysteresis",
        "The model's contraction over steady effort.",
        lambda work, model: loop(model.heat),
    ),
    "curves": Drawn(
        "First-order curves",
        "Contraction over the heat, which the model's heat balance gives from effort and "
        "measured contraction, with the model's branches.",
        lambda work, model: first_order(_curves(work, model), model.heat),
    ),
}
