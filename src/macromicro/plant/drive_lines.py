"""Enable input and fault output of a drive, which trips by its heat (I^2 t)."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.columns import Meaning
from macromicro.kernel import kernel


class Wiring(NamedTuple):
    enable: Annotated[int, Meaning("1: it has an enable input; else it is always on")]
    rise: Annotated[float, Meaning("delay from the enable input to the current", "s")]
    fault: Annotated[int, Meaning("1: it has a fault output")]
    continuous: Annotated[float, Meaning("current that never trips it", "A")]
    slow: Annotated[float, Meaning("time constant of its heat", "s")]


class Drive(NamedTuple):
    asked: Annotated[float, Meaning("the enable input, 0 or 1")]
    on: Annotated[float, Meaning("for how long", "s")]
    heat: Annotated[float, Meaning("share of what trips it")]
    fault: Annotated[
        float, Meaning("0 or 1; stays until the enable input is off and it has cooled")
    ]


COOL = 0.9  # of the heat that trips it: from there on it can be switched on again


def slow(current: float, continuous: float, peak_time: float) -> float:
    """Time constant of a heat that the greatest current brings to 1 within a time.

    h' = ((i / continuous)^2 - h) / slow
    """
    share = (continuous / current) ** 2
    return -peak_time / math.log(1.0 - share) if share < 1.0 else math.inf


@kernel
def ready(p: Wiring, s: Drive) -> bool:
    """Whether the drive gives current."""
    if s.fault > 0.5:
        return False
    return p.enable == 0 or (s.asked > 0.5 and s.on >= p.rise - 1e-9)


@kernel
def advanced(p: Wiring, s: Drive, current: float, dt: float) -> Drive:
    on = s.on + dt if s.asked > 0.5 else 0.0
    if p.fault == 0:
        return Drive(s.asked, on, 0.0, 0.0)
    share, rate = current / p.continuous, dt / p.slow
    heat = (s.heat + rate * share * share) / (1.0 + rate)
    fault = s.fault
    if heat >= 1.0:
        fault = 1.0
    elif heat < COOL and (s.asked < 0.5 or p.enable == 0):
        fault = 0.0
    return Drive(s.asked, on, heat, fault)
