"""A notch filter."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.columns import Meaning
from macromicro.kernel import kernel
from macromicro.schema.par import Par


class Notch(NamedTuple):
    """(s^2 + 2 depth width w s + w^2) / (s^2 + 2 width w s + w^2)."""

    frequency: Annotated[
        float, Par("Hz", "middle of the notch; 0: no notch", "machine choice", lo=0.0)
    ] = 0.0
    depth: Annotated[
        float, Par("1", "what passes at the middle", "machine choice", lo=0.0, hi=1.0)
    ] = 0.1
    width: Annotated[
        float, Par("1", "damping ratio of its poles", "machine choice", positive=True, hi=5.0)
    ] = 0.5


class Delays(NamedTuple):
    first: float
    second: float


@kernel
def step(
    p: Notch, s: Delays, u: Annotated[float, Meaning("to be filtered")], dt: float
) -> tuple[
    Annotated[Delays, Meaning(name="state")], Annotated[float, Meaning("filtered", name="out")]
]:
    """One period by the bilinear transform, prewarped to the notch frequency."""
    if p.frequency <= 0.0 or 2.0 * p.frequency * dt >= 1.0:
        return Delays(0.0, 0.0), u
    # s = (1 - 1/z) / (1 + 1/z) / k, k = tan(w dt / 2) / w: w stays where it is.
    k = math.tan(math.pi * p.frequency * dt)
    wide, deep = 2.0 * p.width * k, 2.0 * p.width * p.depth * k
    whole = 1.0 + wide + k * k
    b0, b1, b2 = 1.0 + deep + k * k, 2.0 * (k * k - 1.0), 1.0 - deep + k * k
    a1, a2 = b1 / whole, (1.0 - wide + k * k) / whole
    b0, b1, b2 = b0 / whole, b1 / whole, b2 / whole
    # Direct form 2, transposed.
    out = b0 * u + s.first
    return Delays(b1 * u - a1 * out + s.second, b2 * u - a2 * out), out
