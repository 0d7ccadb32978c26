"""The PI with anti-windup of `control.pi` as the law of one stage: no set point's derivatives."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.columns import Quantity
from macromicro.control import pi
from macromicro.control.pi import PiAntiWindup
from macromicro.control.stage_law import Sample, StageLaw, Target
from macromicro.kernel import kernel


class Memory(NamedTuple):
    """What the law remembers."""

    integral: Annotated[float, Quantity("V", "integral effort", column="integral")]


@kernel
def start(p: PiAntiWindup, sample: Sample) -> Memory:
    """No integral yet.

    Parameters
    ----------
    p : PiAntiWindup
        Gains.
    sample : Sample
        The first.

    Returns
    -------
    Memory
        At the lower limit, where nothing is driven.
    """
    return Memory(p.low)


@kernel
def step(
    p: PiAntiWindup, s: Memory, target: Target, sample: Sample, dt: float
) -> tuple[Memory, float]:
    """One control period.

    Parameters
    ----------
    p : PiAntiWindup
        Gains.
    s : Memory
        State.
    target : Target
        Where the stage is to be.
    sample : Sample
        What it shows; without a reading the integral drives alone.
    dt : float
        Control period, s.

    Returns
    -------
    memory : Memory
        New state.
    effort : float
        V at the D/A.
    """
    error = target.position - sample.position
    if math.isnan(error):
        error = 0.0
    integral, effort = pi.step(p, s.integral, error, dt)
    return Memory(integral), effort


LAW = StageLaw("pi", PiAntiWindup, Memory, start, step)
