"""Moves within the travel of a machine, as a programme."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from macromicro.programme import Programme


def programme(
    title: str, meaning: str, shares: Sequence[float], hold: float, settings: Any
) -> Programme:
    """A move to each position, in counts."""
    n = len(shares)
    return Programme(
        title,
        np.full(n, math.nan),
        np.zeros(n, np.int64),
        np.floor(np.array(shares) * settings.travel.high / settings.encoder.pitch),
        np.full(n, hold),
        math.nan,
        meaning,
    )
