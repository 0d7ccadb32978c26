"""Dead-zone inverse (Section 4.2.3, Figure 4.9): lifts an effort over the friction."""

from __future__ import annotations

import math

from macromicro.kernel import kernel


@kernel
def inverse(width: float, effort: float) -> float:
    """An effort lifted over the dead zone in its own direction; zero stays zero.

    Parameters
    ----------
    width : float
        Width of the dead zone, V.
    effort : float
        Effort, V.

    Returns
    -------
    float
        V.
    """
    # One expression without a branch: many variants side by side stay in vector registers.
    return effort + math.copysign(width, effort) if abs(effort) > 0.0 else 0.0
