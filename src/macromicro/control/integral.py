"""Integral control with a notch, through the inverse of a hysteresis: the law of piezo stages."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, NamedTuple

from macromicro.columns import Meaning, Quantity
from macromicro.control import notch
from macromicro.control.notch import Delays, Notch
from macromicro.control.stage_law import Sample, StageLaw, Target
from macromicro.hysteresis import prandtl
from macromicro.hysteresis.prandtl import Plays, Prandtl, inverse, operator
from macromicro.kernel import kernel
from macromicro.schema.par import Par

_DERIVED = "derived from the data sheets"
_LOOP = "derived from the printed loop, or by `macromicro identify plays`"


class Integral(NamedTuple):
    integral: Annotated[float, Par("1/s", "correction per error and time", _DERIVED, lo=0.0)] = 0.0
    drift: Annotated[
        float,
        Par("1/s", "gain of a second integral, which removes the error of creep", _DERIVED, lo=0.0),
    ] = 0.0
    proportional: Annotated[float, Par("1", "correction per error", _DERIVED, lo=0.0)] = 0.0
    ahead_velocity: Annotated[
        float, Par("s", "lead over the set point's speed", _DERIVED, shown="ms", lo=0.0)
    ] = 0.0
    ahead_acceleration: Annotated[
        float, Par("s^2", "lead over the set point's acceleration", _DERIVED, lo=0.0)
    ] = 0.0
    loop_thresholds: Annotated[
        tuple[float, ...], Par("V", "thresholds of the hysteresis to invert", _LOOP, lo=0.0)
    ] = (0.0, 1.0)
    loop_weights: Annotated[
        tuple[float, ...], Par("m/V", "its weights", _LOOP, shown="um/V", lo=0.0)
    ] = (1e-6, 0.0)
    invert: Annotated[
        int,
        Par(
            "",
            "1: through the inverse of this hysteresis; 0: through its mean slope, not compensated",
            "choice",
            lo=0,
            hi=1,
        ),
    ] = 1
    gain: Annotated[
        float,
        Par("1", "of the amplifier: V at the stack per V at the D/A", _DERIVED, positive=True),
    ] = 10.0
    low: Annotated[float, Par("V", "lowest effort", _DERIVED)] = -2.0
    high: Annotated[float, Par("V", "highest effort", _DERIVED, positive=True)] = 12.0
    notch: Annotated[Notch, Meaning("wide: it holds for a resonance 10 % off")] = Notch(
        0.0, 0.02, 2.0
    )

    def problems(self) -> list[tuple[str, object, str]]:
        found: list[tuple[str, object, str]] = []
        r, w = self.loop_thresholds, self.loop_weights
        if not r or r[0] != 0.0 or any(a >= b for a, b in pairwise(r)):
            found.append(("loop_thresholds", r, "0 V first, then rising"))
        if len(w) != len(r):
            accepted = f"{len(r)} weights, one for each of loop_thresholds"
            found.append(("loop_weights", f"{len(w)} weights", accepted))
        elif not (w and w[0] > 0.0):
            found.append(("loop_weights", w, "the first above 0: it follows at once"))
        return found


class Memory(NamedTuple):
    integral: Annotated[float, Meaning("of the correction", "m")]
    slope: Annotated[float, Meaning("what the second integral adds to it", "m/s")]
    correction: Annotated[float, Meaning("of the last period", "m")]
    first: Annotated[float, Meaning("of the notch", "m")]
    second: Annotated[float, Meaning("of the notch", "m")]
    offset: Annotated[
        float, Meaning("taken off what the inverse is given: where the stage stood at 0 V", "m")
    ]
    inverse: Annotated[Prandtl, Meaning("from m to V")]
    plays: Annotated[Plays, Meaning("of the inverse; changed in place", "m")]
    mean: Annotated[float, Meaning("in place of the inverse", "V/m")]


class Told(NamedTuple):
    correction: Annotated[
        float, Quantity("um", "correction of the set point by the feedback", scale=1e6)
    ]


def start(p: Integral, sample: Sample) -> Memory:
    """At rest at 0 V, where a target asks for 0 V whatever hysteresis and creep have left."""
    undo, span = inverse(operator(p.loop_thresholds, p.loop_weights)), p.gain * (p.high - p.low)
    pairs = zip(p.loop_thresholds, p.loop_weights, strict=True)
    # Over a cycle through all volts a play of threshold r moves by the span less 2 r.
    stroke = sum(w * max(span - 2.0 * r, 0.0) for r, w in pairs)
    offset = 0.0 if math.isnan(sample.position) else sample.position
    return Memory(
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        offset,
        undo,
        prandtl.relaxed(undo),
        span / stroke if stroke else 0.0,
    )


@kernel
def tell(s: Memory) -> Told:
    return Told(s.correction)


@kernel
def step(
    p: Integral, s: Memory, target: Target, sample: Sample, dt: float
) -> tuple[
    Annotated[Memory, Meaning(name="memory")],
    Annotated[float, Meaning("at the D/A", "V", name="effort")],
]:
    error = target.position - sample.position
    if math.isnan(error):
        error = 0.0
    slope = s.slope + p.drift * p.integral * error * dt
    gathered = s.integral + (p.integral * error + slope) * dt
    raw = gathered + p.proportional * error
    delays, correction = notch.step(p.notch, Delays(s.first, s.second), raw, dt)
    ahead = target.position + p.ahead_velocity * target.velocity
    ahead += p.ahead_acceleration * target.acceleration
    place = ahead + correction - s.offset
    plays, volts = prandtl.advance(s.inverse, s.plays, place, 0.0)
    if p.invert == 0:
        volts = place * s.mean
    wanted = volts / p.gain
    effort = min(max(wanted, p.low), p.high)
    # Anti-windup: beyond the range the integral only comes back.
    if (wanted - effort) * (gathered - s.integral) > 0.0:
        gathered, slope = s.integral, 0.0
    left = delays.first, delays.second
    memory = Memory(gathered, slope, correction, *left, s.offset, s.inverse, plays, s.mean)
    return memory, effort


LAW = StageLaw("integral", Integral, Told, start, step, tell)
