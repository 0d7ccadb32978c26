"""Static gain of the electro-thermal model: (5.2), (5.5) and the weighted (5.7)-(5.8).

CTRL in V, 0 to 5; temperatures in K above ambient.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.columns import Meaning
from macromicro.kernel import kernel


class Exponential(NamedTuple):
    """(5.2): y = b (1 - exp(-a (x - x0))) + y0. Default (5.5)."""

    b: Annotated[float, Meaning("", "K")] = 25.5
    a: Annotated[float, Meaning("", "1/V")] = 37.86
    x0: Annotated[float, Meaning("", "V")] = 1.5
    y0: Annotated[float, Meaning("", "K")] = 57.66


class Weighted(NamedTuple):
    """(5.7)-(5.8): `low` below, offset + scale exp(rate (x - start)) above. Default as printed."""

    low: Annotated[Exponential, Meaning("(5.2)")] = Exponential(a=37.8631)
    scale: Annotated[float, Meaning("", "K")] = 10.0
    rate: Annotated[float, Meaning("", "1/V")] = 10.0
    start: Annotated[float, Meaning("", "V")] = 1.625
    offset: Annotated[float, Meaning("", "K")] = 82.581682
    sharpness: Annotated[float, Meaning("sharpness of the transition", "1/V")] = 40.0
    join: Annotated[float, Meaning("middle of the transition", "V")] = 1.7


@kernel
def exponential(p: Exponential, ctrl: float) -> float:
    """T_d by (5.2)."""
    return p.b * (1.0 - math.exp(-p.a * (ctrl - p.x0))) + p.y0


@kernel
def weighted(p: Weighted, ctrl: float) -> float:
    """T_d by (5.7)-(5.8); the upper curve diverges: 239 K at 1.9 V."""
    # (5.7)
    gamma = 1.0 / (1.0 + math.exp(-p.sharpness * (p.join - ctrl)))
    # (5.8)
    high = p.scale * math.exp(p.rate * (ctrl - p.start)) + p.offset
    return max(gamma * max(0.0, exponential(p.low, ctrl)) + (1.0 - gamma) * high, 0.0)
