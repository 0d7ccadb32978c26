"""The D/A converter as a law has to reckon with it."""

from __future__ import annotations

import math

from macromicro.kernel import kernel


@kernel
def rounded(volts: float, step: float) -> float:
    """CTRL as the D/A gives it.

    Parameters
    ----------
    volts : float
        V.
    step : float
        Of the D/A, V; 0: none.

    Returns
    -------
    float
        V.
    """
    if step <= 0.0:
        return volts
    return math.floor(volts / step + 0.5) * step
