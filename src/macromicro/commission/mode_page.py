"""What the page of an axis shows of its chirp: the Bode plot, and what is doubtful."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from macromicro.commission import shaking
from macromicro.commission.mode import Mode
from macromicro.commission.settings import too_quick
from macromicro.drawing import phases
from macromicro.drawing.style import BLACK, BLUE, RED, finish, new
from macromicro.machines.parts import LOAD
from macromicro.place import LENGTH, Place

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_UNEXPLAINED = 20.0  # mean square of what is left, in noise


def doubts(mode: Mode | None, dt: float) -> list[str]:
    """What the chirp did not show, or shows no more than in part.

    Parameters
    ----------
    mode : Mode | None
        What was found; None: nothing was seen.
    dt : float
        Control period, s.

    Returns
    -------
    list[str]
        A sentence each.
    """
    nyquist = 0.5 / dt
    if mode is None:
        return [
            "The chirp showed nothing: whether the structure has a mode is not known. A longer "
            "way, a larger --effort or finer counts would show it."
        ]
    top = mode.seen[1]
    if not mode.found:
        if mode.left > _UNEXPLAINED:
            return [
                "Neither a stiff axis nor one mode explains the chirp: are there several, or slack?"
            ]
        if top < 0.9 * shaking.HIGH / dt:
            return [
                f"No mode was found up to {top:.3g} Hz; beyond that the encoder hardly shows the "
                f"chirp, up to {nyquist:.4g} Hz, half the loop's frequency."
            ]
        return [f"No mode below {nyquist:.4g} Hz, half the loop's frequency: a stiff axis."]
    said = []
    if mode.shape.at == LOAD:
        said.append(
            "The encoder is behind the drive that gives, and shows no antiresonance: the file's "
            "motor and load are as heavy as each other."
        )
    if too_quick(mode, dt):
        said.append(
            f"The mode of {mode.shape.resonance:.4g} Hz is too quick for a machine of this control "
            "period: the file has a stiff drive, and a notch."
        )
    return said


def bode(mode: Mode | None, place: Place = LENGTH) -> Figure:
    """Gain and phase as measured, by the model and by a stiff axis.

    Parameters
    ----------
    mode : Mode | None
        What was found; None: nothing was seen.
    place : Place, optional
        What places are counted in.

    Returns
    -------
    Figure
        One picture.
    """
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
