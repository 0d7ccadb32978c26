"""The PI with anti-windup of `control.pi` as the law of one stage: no set point's derivatives."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.columns import Meaning, Quantity
from macromicro.control import pi
from macromicro.control.pi import PiAntiWindup
from macromicro.control.stage_law import Sample, StageLaw, Target
from macromicro.kernel import kernel


class Memory(NamedTuple):
    integral: Annotated[float, Quantity("V", "integral effort", column="integral")]


@kernel
def start(p: PiAntiWindup, sample: Sample) -> Memory:
    return Memory(p.low)


@kernel
def step(
    p: PiAntiWindup, s: Memory, target: Target, sample: Sample, dt: float
) -> tuple[
    Annotated[Memory, Meaning(name="memory")],
    Annotated[float, Meaning("at the D/A", "V", name="effort")],
]:
    error = target.position - sample.position
    if math.isnan(error):
        error = 0.0
    integral, effort = pi.step(p, s.integral, error, dt)
    return Memory(integral), effort


LAW = StageLaw("pi", PiAntiWindup, Memory, start, step)
