"""Figures of every commissioning: its verification."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from macromicro.drawing.style import BLACK, BLUE, RED, finish, line, new
from macromicro.place import LENGTH, Place

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from macromicro.recording import Recording


def verification(recording: Recording, place: Place = LENGTH) -> Figure:
    figure, axes = new(5.0, 3, sharex=True)
    t, x, target = (np.asarray(recording[c], float) for c in ("t", "position", "target"))
    line(axes[0, 0], t, target, BLACK, "target", linestyle=":")
    line(axes[0, 0], t, x, BLUE, "position")
    line(axes[1, 0], t, (x - target) * 1e3, BLUE, "error")
    line(axes[2, 0], t, np.asarray(recording["effort"], float), RED, "effort")
    finish(
        axes[0, 0],
        "Verification: moves that were not used before",
        "",
        f"[{place.unit}]",
        legend=True,
    )
    finish(axes[1, 0], "error", "", f"[{place.fine}]")
    finish(axes[2, 0], "effort", "time [s]", "[V]")
    return figure
