"""Chirp section of an axis' page: the Bode plot and points to check."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from macromicro.commission import _shaking
from macromicro.commission._mode import Mode
from macromicro.commission._settings import too_quick
from macromicro.drawing import phases
from macromicro.drawing.style import BLACK, BLUE, RED, finish, new
from macromicro.machines.parts import LOAD
from macromicro.place import LENGTH, Place

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_UNEXPLAINED = 20.0  # mean square of what is left, in noise


def doubts(mode: Mode | None, dt: float) -> list[str]:
    """What the chirp did not show or showed in part."""
    nyquist = 0.5 / dt
    if mode is None:
        return [
            (
                "The chirp gave no result, so structural modes are unknown. A longer travel, a "
                "larger --effort or a finer encoder would help."
            )
        ]
    top = mode.seen[1]
    if not mode.found:
        if mode.left > _UNEXPLAINED:
            return [
                (
                    "Neither a rigid axis nor one mode explains the chirp. Check for several "
                    "modes or backlash."
                )
            ]
        if top < 0.9 * _shaking.HIGH / dt:
            return [
                (
                    f"No mode was found up to {top:.3g} Hz; beyond that the encoder hardly "
                    f"resolves the chirp, up to {nyquist:.4g} Hz, half the control frequency."
                )
            ]
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
