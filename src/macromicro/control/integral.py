"""Integral control with a notch, through the inverse of a hysteresis: the law of piezo stages.

The set point, led by its derivatives, and the filtered correction go through the inverse of play
operators together, so that the loop sees a stage without hysteresis. All gains are in continuous
time. The correction is a length: what is left of hysteresis, creep and drift.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, NamedTuple

from macromicro.columns import Quantity
from macromicro.control import notch
from macromicro.control.notch import Delays, Notch
from macromicro.control.stage_law import Sample, StageLaw, Target
from macromicro.hysteresis import prandtl
from macromicro.hysteresis.prandtl import Plays, Prandtl, operator
from macromicro.hysteresis.prandtl_inverse import inverse
from macromicro.kernel import kernel
from macromicro.schema.par import Par

_DERIVED = "derived from the data sheets"
_LOOP = "derived from the printed loop, or by `macromicro identify plays`"


class Integral(NamedTuple):
    """Gains of the law."""

    integral: Annotated[float, Par("1/s", "correction per error and time", _DERIVED, lo=0.0)] = 0.0
    drift: Annotated[
        float,
        Par("1/s", "of a second integral, so that creep leaves no error behind", _DERIVED, lo=0.0),
    ] = 0.0
    proportional: Annotated[float, Par("1", "correction per error", _DERIVED, lo=0.0)] = 0.0
    ahead_velocity: Annotated[
        float, Par("s", "lead over the set point's speed", _DERIVED, shown="ms", lo=0.0)
    ] = 0.0
    ahead_acceleration: Annotated[
        float, Par("s**2", "lead over the set point's acceleration", _DERIVED, lo=0.0)
    ] = 0.0
    loop_thresholds: Annotated[
        tuple[float, ...], Par("V", "thresholds of the hysteresis to invert", _LOOP, lo=0.0)
    ] = (0.0, 1.0)
    loop_weights: Annotated[
        tuple[float, ...], Par("m/V", "its weights", _LOOP, shown="um/V", lo=0.0)
    ] = (1e-6, 0.0)
    gain: Annotated[
        float,
        Par("1", "of the amplifier: V at the stack per V at the D/A", _DERIVED, positive=True),
    ] = 10.0
    low: Annotated[float, Par("V", "lowest effort", _DERIVED)] = -2.0
    high: Annotated[float, Par("V", "highest effort", _DERIVED, positive=True)] = 12.0
    notch: Notch = Notch(0.0, 0.02, 2.0)  # wide: it holds for a resonance 10 % off

    def problems(self) -> list[tuple[str, object, str]]:
        """Whether the loop is one that can be inverted.

        Returns
        -------
        list[tuple[str, object, str]]
            Path, value, and what is accepted; none if all is well.
        """
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
    """What the law remembers.

    Attributes
    ----------
    integral : float
        Of the correction, m.
    slope : float
        What the second integral adds to it, m/s.
    correction : float
        Of the last period, m.
    first, second : float
        Of the notch, m.
    offset : float
        Taken off what the inverse is given: where the stage stood at 0 V, m.
    inverse : Prandtl
        From m to V.
    plays : Plays
        Of the inverse, m; changed in place.
    """

    integral: float
    slope: float
    correction: float
    first: float
    second: float
    offset: float
    inverse: Prandtl
    plays: Plays


class Told(NamedTuple):
    """What is recorded of it."""

    correction: Annotated[
        float, Quantity("um", "what the feedback adds to the set point", scale=1e6)
    ]


def start(p: Integral, sample: Sample) -> Memory:
    """At rest at 0 V, where hysteresis and creep have left it: a target there asks for 0 V.

    Parameters
    ----------
    p : Integral
        Gains.
    sample : Sample
        The first.

    Returns
    -------
    Memory
        Its arrays are its own.
    """
    undo = inverse(operator(p.loop_thresholds, p.loop_weights))
    offset = 0.0 if math.isnan(sample.position) else sample.position
    return Memory(0.0, 0.0, 0.0, 0.0, 0.0, offset, undo, prandtl.relaxed(undo))


@kernel
def tell(s: Memory) -> Told:
    """What is recorded.

    Parameters
    ----------
    s : Memory
        State.

    Returns
    -------
    Told
        SI.
    """
    return Told(s.correction)


@kernel
def step(p: Integral, s: Memory, target: Target, sample: Sample, dt: float) -> tuple[Memory, float]:
    """One control period.

    Parameters
    ----------
    p : Integral
        Gains.
    s : Memory
        State.
    target : Target
        Where the stage is to be.
    sample : Sample
        What it shows; without a reading the correction stays.
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
    slope = s.slope + p.drift * p.integral * error * dt
    gathered = s.integral + (p.integral * error + slope) * dt
    raw = gathered + p.proportional * error
    delays, correction = notch.step(p.notch, Delays(s.first, s.second), raw, dt)
    ahead = target.position + p.ahead_velocity * target.velocity
    ahead += p.ahead_acceleration * target.acceleration
    plays, volts = prandtl.advance(s.inverse, s.plays, ahead + correction - s.offset, 0.0)
    wanted = volts / p.gain
    effort = min(max(wanted, p.low), p.high)
    # Anti-windup: beyond the range the integral only comes back.
    if (wanted - effort) * (gathered - s.integral) > 0.0:
        gathered, slope = s.integral, 0.0
    left = delays.first, delays.second
    memory = Memory(gathered, slope, correction, *left, s.offset, s.inverse, plays)
    return memory, effort


LAW = StageLaw("integral", Integral, Told, start, step, tell)
