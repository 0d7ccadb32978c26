"""A figure that the thesis prints, and what the bench shows instead."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
DT = 1e-3


class Figure(NamedTuple):
    """One figure of the thesis: claim, meaning, text as printed, accepted range, measured."""

    claim: str
    what: str
    printed: str
    low: float
    high: float
    measured: float
    unit: str

    @property
    def within(self) -> bool:
        """Is the measured value in the accepted range?"""
        return self.low <= self.measured <= self.high

    @property
    def accepted(self) -> str:
        """The accepted range in words."""
        low, high = (f"{x:.{4 if abs(x) >= 1.0 else 5}g}" for x in (self.low, self.high))
        if self.low == -math.inf:
            return "-" if self.high == math.inf else f"at most {high}"
        return f"at least {low}" if self.high == math.inf else f"{low} to {high}"
