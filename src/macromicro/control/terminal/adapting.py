"""Learned friction for the next run."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from macromicro.arrays import Array
from macromicro.control.terminal.model import Terminal

LEAST = 50  # periods of motion; fewer tell too little


def adapt(p: Terminal, run: Mapping[str, Array]) -> Terminal:
    """The model with the Coulomb friction that the law found: the median over motion of a run."""
    moving = run["friction"][np.abs(run["speed"]) > 0.0]
    if len(moving) < LEAST:
        return p
    return p._replace(coulomb=max(round(p.coulomb + float(np.median(moving)), 4), 0.0))
