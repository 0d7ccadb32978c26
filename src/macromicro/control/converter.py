"""D/A rounding as seen by a law."""

from __future__ import annotations

import math

from macromicro.kernel import kernel


@kernel
def rounded(volts: float, step: float) -> float:
    if step <= 0.0:
        return volts
    return math.floor(volts / step + 0.5) * step
