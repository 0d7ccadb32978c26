"""What a commissioning shows: friction along the travel, strokes beside their free runs, and the
verification."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from macromicro.commission.friction import FrictionMap
from macromicro.commission.model import Model
from macromicro.commission.stand import Record
from macromicro.drawing.style import BLACK, BLUE, RED, finish, line, new
from macromicro.identify.axis import simulate

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from macromicro.recording import Recording

FRICTION, STROKES, VERIFICATION = "friction", "strokes", "verification"
FIGURES = (FRICTION, STROKES, VERIFICATION)
_SHOWN = 4  # strokes


def friction(found: FrictionMap, model: Model) -> Figure:
    """Breakaway along the travel, and the kinetic friction of the model.

    Parameters
    ----------
    found : FrictionMap
        Breakaway both ways.
    model : Model
        Its Coulomb level and offset.

    Returns
    -------
    Figure
        One picture.
    """
    figure, axes = new(2.6, 1)
    ax, places = axes[0, 0], np.array(found.places) * 1e3
    ax.plot(places, found.forward, "o-", color=BLUE, label="starts forwards", linewidth=1.0)
    ax.plot(places, found.backward, "s--", color=RED, label="starts backwards", linewidth=1.0)
    ax.axhline(model.axis.coulomb, color=BLACK, linewidth=0.9, linestyle=":", label="sliding")
    ax.set_ylim(bottom=0.0)
    finish(ax, "Friction over position", "from the low end [mm]", "effort [V]", legend=True)
    return figure


def strokes(records: Sequence[Record], model: Model, dt: float) -> Figure:
    """Some strokes, the model's free run from the same start under the same effort, the rest.

    Parameters
    ----------
    records : Sequence[Record]
        All strokes; a few, spread over the levels of effort, are drawn.
    model : Model
        What runs free.
    dt : float
        Control period, s.

    Returns
    -------
    Figure
        One picture.
    """
    picked = [records[k] for k in np.linspace(0, len(records) - 1, _SHOWN).round().astype(int)]
    figure, axes = new(5.2, 3, _SHOWN)
    figure.subplots_adjust(wspace=0.4)
    for k, one in enumerate(picked):
        free = simulate(model.axis, one.u, dt, float(one.x[0]))
        line(axes[0, k], one.t, (one.x - one.x[0]) * 1e3, BLUE, "measured")
        line(axes[0, k], one.t, (free - one.x[0]) * 1e3, RED, "model", linestyle="--")
        line(axes[1, k], one.t, (one.x - free) * 1e6, BLACK, "")
        line(axes[2, k], one.t, one.u, BLUE, "")
        finish(
            axes[0, k],
            "" if k else "strokes",
            "",
            "way [mm]" if not k else "",
            legend=k == _SHOWN - 1,
        )
        finish(axes[1, k], "" if k else "measured less model", "", "[um]" if not k else "")
        finish(axes[2, k], "" if k else "effort", "time [s]", "[V]" if not k else "")
    return figure


def verification(recording: Recording) -> Figure:
    """Position and target, and the error, of the programme that verifies.

    Parameters
    ----------
    recording : Recording
        Of a machine of one stage.

    Returns
    -------
    Figure
        One picture.
    """
    figure, axes = new(5.0, 3, sharex=True)
    t, x, target = (np.asarray(recording[c], float) for c in ("t", "position", "target"))
    line(axes[0, 0], t, target, BLACK, "target", linestyle=":")
    line(axes[0, 0], t, x, BLUE, "position")
    line(axes[1, 0], t, (x - target) * 1e3, BLUE, "error")
    line(axes[2, 0], t, np.asarray(recording["effort"], float), RED, "effort")
    finish(axes[0, 0], "Verification: moves that were not used before", "", "[mm]", legend=True)
    finish(axes[1, 0], "error", "", "[um]")
    finish(axes[2, 0], "effort", "time [s]", "[V]")
    return figure
