"""The weighted static gain (5.7)-(5.8) as printed, Figure 5.14: claim S9."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from macromicro.experiments.claim import Claim, holds
from macromicro.experiments.statements import stated
from macromicro.models.weighted_gain import Weighted, exponential, weighted

Array = npt.NDArray[np.float64]

VOLTS = (1.5, 1.6, 1.7, 1.8)
VALUES = (57.67, 82.72, 93.45, 139.1)
TOLERANCE = 0.1


def curve(low: float = 1.4, high: float = 1.9, points: int = 251) -> tuple[Array, Array]:
    """CTRL [V] and steady temperature [K above ambient], shape (points,) each."""
    volts = np.linspace(low, high, points)
    return volts, np.array([weighted(Weighted(), float(v)) for v in volts])


def exponentials(volts: Array) -> tuple[Array, Array]:
    """The two that (5.8) joins, each by itself [K above ambient]: the lower, at least 0, and
    the upper, shape of `volts` [V] each."""
    p = Weighted()
    lower = [max(0.0, exponential(p.low, float(v))) for v in volts]
    return np.array(lower), p.scale * np.exp(p.rate * (volts - p.start)) + p.offset


def claims() -> list[Claim]:
    """S9."""
    found = [weighted(Weighted(), v) for v in VOLTS]
    _, everywhere = curve(0.0, 5.0, 5001)
    close = all(abs(a - b) <= TOLERANCE for a, b in zip(found, VALUES, strict=True))
    volts, rise = curve(1.3, 1.6, 3001)
    silent = float(volts[rise < 0.05][-1])
    return [
        stated(
            "S9",
            found,
            holds(close and bool((everywhere >= 0.0).all())),
            f"the equation by itself. It is nothing up to {silent:.2f} V, where the actuator "
            f"already responds, and runs away above ({weighted(Weighted(), 1.9):.0f} K at 1.9 V).",
        )
    ]
