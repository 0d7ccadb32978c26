"""Static gain of the electro-thermal model: (5.2), (5.5) and the weighted (5.7)-(5.8).

As printed, or with fitted numbers. CTRL in V, 0 to 5; temperatures in K above ambient.
`electrothermal.gain` is the printed (5.8) made whole at both ends.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from macromicro.kernel import kernel


class Exponential(NamedTuple):
    """(5.2): y = b (1 - exp(-a (x - x0))) + y0. Default (5.5).

    Attributes
    ----------
    b : float
        K.
    a : float
        1/V.
    x0 : float
        V.
    y0 : float
        K.
    """

    b: float = 25.5
    a: float = 37.86
    x0: float = 1.5
    y0: float = 57.66


class Weighted(NamedTuple):
    """(5.7)-(5.8): `low` below, offset + scale exp(rate (x - start)) above. Default as printed.

    Attributes
    ----------
    low : Exponential
        (5.2).
    scale : float
        K.
    rate : float
        1/V.
    start : float
        V.
    offset : float
        K.
    sharpness : float
        Sharpness of the transition, 1/V.
    join : float
        Middle of the transition, V.
    """

    low: Exponential = Exponential(a=37.8631)
    scale: float = 10.0
    rate: float = 10.0
    start: float = 1.625
    offset: float = 82.581682
    sharpness: float = 40.0
    join: float = 1.7


@kernel
def exponential(p: Exponential, ctrl: float) -> float:
    """T_d by (5.2).

    Parameters
    ----------
    p : Exponential
        Parameters of the curve.
    ctrl : float
        CTRL, V.

    Returns
    -------
    float
        K above ambient.
    """
    return p.b * (1.0 - math.exp(-p.a * (ctrl - p.x0))) + p.y0


@kernel
def weighted(p: Weighted, ctrl: float) -> float:
    """T_d by (5.7)-(5.8). The upper curve runs away: 239 K at 1.9 V.

    Parameters
    ----------
    p : Weighted
        Parameters of the curve.
    ctrl : float
        CTRL, V.

    Returns
    -------
    float
        K above ambient, at least 0.
    """
    # (5.7)
    gamma = 1.0 / (1.0 + math.exp(-p.sharpness * (p.join - ctrl)))
    # (5.8)
    high = p.scale * math.exp(p.rate * (ctrl - p.start)) + p.offset
    return max(gamma * max(0.0, exponential(p.low, ctrl)) + (1.0 - gamma) * high, 0.0)
