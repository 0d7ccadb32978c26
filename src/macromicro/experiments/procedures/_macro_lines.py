"""Smooth columns, such as positions at 1 kHz, as dotted and dashed lines."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from macromicro.drawing.style import BINS, line

Array = npt.NDArray[np.float64]


def smooth(ax: Any, t: Array, y: Array, color: str, label: str, **options: Any) -> None:
    """Draw every k-th sample, few enough that `line` does not thin them: the peaks that it
    keeps would fill the gaps of a dotted line, and a smooth column has none."""
    every = slice(None, None, -(-len(t) // (2 * BINS)))
    line(ax, t[every], y[every], color, label, **options)
