"""Page of an axis: values, figures and points to check."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from macromicro.commission import _exciting
from macromicro.commission._axis_fit import Model, shows_time_constant
from macromicro.commission._mode import Mode
from macromicro.commission._probing import FrictionMap
from macromicro.commission._settings import too_quick
from macromicro.commission.procedure import Drawn, Estimate, Work
from macromicro.commission.stand import Record
from macromicro.drawing import phases
from macromicro.drawing.style import BLACK, BLUE, RED, finish, line, new
from macromicro.identify.clusters import NORMAL
from macromicro.machines.parts import LOAD
from macromicro.models.mass import simulate
from macromicro.place import LENGTH, Place

if TYPE_CHECKING:
    from matplotlib.figure import Figure

QUANTITIES = {  # meaning, unit
    "mass": ("mass", "V*s^2/m"),
    "viscous": ("viscous friction and back-EMF", "V*s/m"),
    "coulomb": ("sliding friction", "V"),
    "offset": ("constant force", "V"),
    "lag": ("lag of the effort", "s"),
    "sine": ("gravity, by the angle's sine", "V"),
    "cosine": ("gravity, by its cosine", "V"),
    "resonance": ("resonance of the structure", "Hz"),
    "antiresonance": ("antiresonance, the load on the drive", "Hz"),
    "damping": ("damping ratio of the load on the drive", "1"),
}
_WIDE = 0.2  # an interval that is a larger part of its value is doubtful
_UNEVEN = 0.3  # friction that differs by more along the travel
_SHOWN = 4  # strokes


def estimates(found: Model) -> dict[str, Estimate]:
    known = [(name, getattr(found.whole, name), found.half_width(name)) for name in found.names]
    if (mode := found.limber) is not None:
        known += [
            (name, mode.values[name], NORMAL[1] * error) for name, error in mode.errors.items()
        ]
    told = {}
    for name, value, half in known:
        meaning, unit = QUANTITIES[name]
        told[name] = Estimate(meaning, value, half, unit)
    return told


def rows(work: Work) -> list[tuple[str, ...]]:
    ends, direction, weight = work["ends"], work["direction"], work["weight"]
    p = work.stand.place
    held = [("effort to hold the weight", f"{weight.hold:.4g}", "", "V")] if weight.hold else []
    return [
        *held,
        ("travel", f"{ends.travel * p.per:.5g}", "", p.unit),
        ("breakaway forwards", f"{direction.forward:.3g}", "", "V"),
        ("breakaway backwards", f"{direction.backward:.3g}", "", "V"),
    ]


def doubts(work: Work, model: Model) -> list[str]:
    """Points to check before the result is used."""
    said = []
    if work["weight"].hold:
        said.append(
            "Only the motor holds the weight: the axis sinks when the drive is off or a "
            "guard stops a run. A brake or a counterweight would hold it."
        )
    if not work["ends"].found and not work.options.endless:
        said.append("The window was given; the end stops were not searched.")
    friction = work["friction"]
    known = [e for e in (*friction.forward, *friction.backward) if not math.isnan(e)]
    spread = (max(known) - min(known)) / friction.mean
    if spread > _UNEVEN:
        said.append(
            f"The breakaway force varies by {spread:.0%} along the travel and between the "
            "directions. Check for dirt, a bent rail or a weight."
        )
    if model.axis.limit < work.options.effort:
        said.append(
            f"The current of the drive limits the force to {model.axis.limit:.3g} V of "
            f"{work.options.effort:.3g} V."
        )
    for name in ("mass", "coulomb"):
        value, half = getattr(model.axis, name), model.half_width(name)
        if half > _WIDE * value:
            said.append(
                f"The {QUANTITIES[name][0]} is known to {half / value:.0%} only. A longer travel "
                "or a larger effort would improve it."
            )
    if not shows_time_constant(model.axis, work.stand.dt):
        said.append(
            "The strokes do not determine the time constant (mass over viscous friction); "
            f"the mass is the smallest that suits a period of {work.stand.dt * 1e3:.3g} ms. A "
            "shorter period or a finer encoder would show it."
        )
    said += mode_doubts(model.mode, work.stand.dt)
    if model.axis.lag > 3.0 * work.stand.dt:
        said.append(
            f"The effort acts {model.axis.lag * 1e3:.2g} ms late "
            f"({model.axis.lag / work.stand.dt:.2g} control periods): the drive or the bus is "
            "slow, which limits the gains."
        )
    return said


def friction(found: FrictionMap, model: Model, place: Place = LENGTH) -> Figure:
    """Breakaway along the travel, and the kinetic friction of the model."""
    figure, axes = new(2.6, 1)
    ax, places = axes[0, 0], np.array(found.places) * place.per
    ax.plot(places, found.forward, "o-", color=BLUE, label="starts forwards", linewidth=1.0)
    ax.plot(places, found.backward, "s--", color=RED, label="starts backwards", linewidth=1.0)
    ax.axhline(model.axis.coulomb, color=BLACK, linewidth=0.9, linestyle=":", label="sliding")
    ax.set_ylim(bottom=0.0)
    finish(
        ax, "Friction over position", f"from the low end [{place.unit}]", "effort [V]", legend=True
    )
    return figure


def strokes(records: Sequence[Record], model: Model, dt: float, place: Place = LENGTH) -> Figure:
    """Some strokes with free simulations from the same start, and the difference."""
    picked = [records[k] for k in np.linspace(0, len(records) - 1, _SHOWN).round().astype(int)]
    figure, axes = new(5.2, 3, _SHOWN)
    figure.subplots_adjust(wspace=0.4)
    labels = [f"travel [{place.unit}]", f"[{place.fine}]", "[V]"]
    titles = ["strokes", "measured less model", "effort"]
    for k, one in enumerate(picked):
        free = simulate(model.axis, one.u, dt, float(one.x[0]))
        line(axes[0, k], one.t, (one.x - one.x[0]) * place.per, BLUE, "measured")
        line(axes[0, k], one.t, (free - one.x[0]) * place.per, RED, "model", linestyle="--")
        line(axes[1, k], one.t, (one.x - free) * place.fines, BLACK, "")
        line(axes[2, k], one.t, one.u, BLUE, "")
        for row, (title, label) in enumerate(zip(titles, labels, strict=True)):
            said = ("", "") if k else (title, label)
            time = "time [s]" if row == 2 else ""
            legend = row == 0 and k == _SHOWN - 1
            finish(axes[row, k], said[0], time, said[1], legend=legend)
    return figure


FIGURES = {
    "friction": Drawn(
        "Friction over position",
        "Breakaway effort in both directions, and the model's sliding friction.",
        lambda work, model: friction(work["friction"], model, work.stand.place),
    ),
    "strokes": Drawn(
        "Strokes and model",
        "Some strokes with the model's free simulation from the same start under the same effort.",
        lambda work, model: strokes(work["strokes"], model, work.stand.dt, work.stand.place),
    ),
    "modes": Drawn(
        "Chirp and mode",
        "Measured position per effort, with the model including the mode and with a rigid axis.",
        lambda work, model: bode(model.mode, work.stand.place),
    ),
}


_UNEXPLAINED = 20.0  # mean square of what is left, in noise


def mode_doubts(mode: Mode | None, dt: float) -> list[str]:
    """What the chirp did not show or showed in part."""
    nyquist = 0.5 / dt
    if mode is None:
        unknown = "The chirp gave no result, so structural modes are unknown."
        return [f"{unknown} A longer travel, a larger --effort or a finer encoder would help."]
    top = mode.seen[1]
    if not mode.found and mode.left > _UNEXPLAINED:
        unknown = "Neither a rigid axis nor one mode explains the chirp."
        return [f"{unknown} Check for several modes or backlash."]
    if not mode.found and top < 0.9 * _exciting.HIGH / dt:
        beyond = f"beyond that the encoder hardly resolves the chirp, up to {nyquist:.4g} Hz"
        return [f"No mode was found up to {top:.3g} Hz; {beyond}, half the control frequency."]
    if not mode.found:
        return [f"No mode below {nyquist:.4g} Hz, half the control frequency: the axis is rigid."]
    said = []
    if mode.shape.at == LOAD:
        said.append(
            "The encoder is behind a compliant drive train and shows no antiresonance, so "
            "the file assumes equal masses of motor and load."
        )
    if too_quick(mode, dt):
        said.append(
            f"The mode at {mode.shape.resonance:.4g} Hz is too fast for this control period: "
            "the file has a rigid drive train and a notch."
        )
    return said


def bode(mode: Mode | None, place: Place = LENGTH) -> Figure:
    """Measured gain and phase with those of the model and of a rigid axis."""
    figure, axes = new(5.2, 2, sharex=True)
    gain, phase = axes[0, 0], axes[1, 0]
    if mode is not None:
        f = mode.frequency
        whole = 2j * math.pi * f
        rows = ((mode.measured, BLUE, "measured", ""), (mode.stiff, BLACK, "stiff axis", ":"))
        for values, color, name, line in (*rows, (mode.model, RED, "model", "--")):
            dots = {"marker": ".", "markersize": 2} if not line else {"linewidth": 1.1}
            gain.loglog(f, np.abs(values / whole), line, color=color, label=name, **dots)
            phase.semilogx(
                f, phases.degrees(values / whole, mode.model / whole), line, color=color, **dots
            )
        for name in {"resonance", "antiresonance"} & set(mode.errors):
            for ax in (gain, phase):
                ax.axvline(mode.values[name], color=BLACK, linewidth=0.7)
    finish(gain, "Position per effort", "", f"gain [{place.base}/V]", legend=mode is not None)
    finish(phase, "", "frequency [Hz]", "phase [deg]")
    figure.subplots_adjust(hspace=0.15)
    return figure
