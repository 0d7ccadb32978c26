"""Colours for families of curves in rising order."""

from __future__ import annotations

import numpy as np


def shades(count: int) -> list[str]:
    """Colours from dark to light, distinct in grey print too (part of viridis)."""
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    return [to_hex(colormaps["viridis"](v)) for v in np.linspace(0.0, 0.88, count)]
