"""A PI with feed-forward of the speed, whose integral waits at a limit: the law of a wire."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.columns import Meaning, Quantity
from macromicro.control.pi import HIGHEST, QUICKEST, STEEPEST
from macromicro.control.stage_law import Sample, StageLaw, Target
from macromicro.kernel import kernel
from macromicro.nominal import FULL_SCALE
from macromicro.schema.par import Par

_DERIVED = "derived from the data sheet"


class StagePi(NamedTuple):
    kp: Annotated[
        float,
        Par("V/m", "proportional gain", _DERIVED, shown="V/mm", lo=0.0, hi=STEEPEST),
    ] = 3e3
    ki: Annotated[
        float,
        Par("V/(m*s)", "integral gain", _DERIVED, shown="V/(mm*s)", lo=0.0, hi=QUICKEST),
    ] = 3e4
    ahead_velocity: Annotated[
        float,
        Par("V*s/m", "feed-forward of the set point's speed", _DERIVED, shown="V*s/mm", lo=0.0),
    ] = 0.0
    low: Annotated[float, Par("V", "lower limit", _DERIVED, lo=0.0, hi=HIGHEST)] = 0.0
    high: Annotated[float, Par("V", "upper limit", _DERIVED, lo=0.0, hi=HIGHEST)] = FULL_SCALE


class Memory(NamedTuple):
    integral: Annotated[float, Quantity("V", "integral effort", column="integral")]


@kernel
def start(p: StagePi, sample: Sample) -> Memory:
    return Memory(p.low)


@kernel
def step(
    p: StagePi, s: Memory, target: Target, sample: Sample, dt: float
) -> tuple[
    Annotated[Memory, Meaning(name="memory")],
    Annotated[float, Meaning("at the D/A", "V", name="effort")],
]:
    error = target.position - sample.position
    if math.isnan(error):
        error = 0.0
    wanted = p.kp * error + s.integral + p.ahead_velocity * target.velocity
    effort = min(max(wanted, p.low), p.high)
    integral = s.integral
    # At a limit it keeps the effort of the last rest, which is near to that of the next.
    if (wanted - effort) * error <= 0.0:
        integral = min(max(integral + dt * p.ki * error, p.low), p.high)
    return Memory(integral), effort


LAW = StageLaw("pi", StagePi, Memory, start, step)
