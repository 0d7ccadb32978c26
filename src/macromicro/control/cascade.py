"""Cascaded position (P) and velocity (PI) control with feed-forward, in continuous-time gains."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.columns import Meaning, Quantity
from macromicro.control import notch
from macromicro.control.notch import Delays, Notch
from macromicro.control.stage_law import Sample, StageLaw, Target
from macromicro.kernel import kernel
from macromicro.schema.par import Par

_DERIVED = "derived from the data sheets"


class Cascade(NamedTuple):
    """Gains of the law; efforts in V at the D/A."""

    position: Annotated[
        float, Par("1/s", "commanded speed per position error", _DERIVED, lo=0.0)
    ] = 0.0
    velocity: Annotated[float, Par("V*s/m", "effort per velocity error", _DERIVED, lo=0.0)] = 0.0
    integral: Annotated[
        float, Par("1/s", "inverse of the velocity loop's integral time", _DERIVED, lo=0.0)
    ] = 0.0
    observer: Annotated[
        float, Par("1/s", "bandwidth of the velocity's observer", _DERIVED, positive=True)
    ] = 1000.0
    ahead_velocity: Annotated[
        float, Par("V*s/m", "effort per target velocity", _DERIVED, lo=0.0)
    ] = 0.0
    ahead_acceleration: Annotated[
        float, Par("V*s^2/m", "effort per target acceleration", _DERIVED, lo=0.0)
    ] = 0.0
    ahead_friction: Annotated[
        float, Par("V", "effort against Coulomb friction while the target moves", _DERIVED, lo=0.0)
    ] = 0.0
    loosen: Annotated[
        float,
        Par("V", "effort against friction at rest, back to the target", _DERIVED, lo=0.0),
    ] = 0.0
    ahead_gravity: Annotated[float, Par("V", "effort against the weight", _DERIVED)] = 0.0
    ahead_unbalance: Annotated[
        float, Par("V", "greatest effort against an eccentric load that turns", _DERIVED)
    ] = 0.0
    hangs: Annotated[
        float, Par("rad", "angle at which an eccentric load hangs", _DERIVED, shown="deg")
    ] = 0.0
    rest: Annotated[
        float,
        Par(
            "m",
            "position error that is not corrected at a resting target",
            _DERIVED,
            shown="um",
            lo=0.0,
        ),
    ] = 0.0
    limit: Annotated[float, Par("V", "maximum effort", _DERIVED, positive=True)] = 10.0
    notch: Notch = Notch()


class Memory(NamedTuple):
    place: Annotated[float, Meaning("of the observer: its prediction for this period", "m")]
    velocity: Annotated[
        float, Quantity("mm/s", "speed by the law's observer", column="speed", scale=1e3)
    ]
    integral: Annotated[float, Quantity("V", "integral effort", column="integral")]
    first: Annotated[float, Meaning("of the notch", "V")]
    second: float
    rested: Annotated[float, Meaning("1: the target has been at rest")]


@kernel
def start(p: Cascade, sample: Sample) -> Memory:
    place = 0.0 if math.isnan(sample.position) else sample.position
    return Memory(place, 0.0, 0.0, 0.0, 0.0, 1.0)


@kernel
def observed(
    bandwidth: Annotated[float, Meaning("bandwidth", "1/s")],
    place: Annotated[float, Meaning("predicted", "m")],
    velocity: Annotated[float, Meaning("predicted", "m/s")],
    sample: Sample,
    dt: float,
) -> tuple[
    Annotated[float, Meaning("", "m", name="place")],
    Annotated[float, Meaning("", "m/s", name="velocity")],
]:
    """Position and velocity by a Luenberger observer with both poles at exp(-bandwidth dt)."""
    off = sample.position - place
    if math.isnan(off):
        return place, velocity
    pole = math.exp(-bandwidth * dt)
    return place + (1.0 - pole * pole) * off, velocity + (1.0 - pole) * (1.0 - pole) / dt * off


@kernel
def step(
    p: Cascade, s: Memory, target: Target, sample: Sample, dt: float
) -> tuple[
    Annotated[Memory, Meaning(name="memory")],
    Annotated[float, Meaning("at the D/A", "V", name="effort")],
]:
    place, velocity = observed(p.observer, s.place, s.velocity, sample, dt)
    error = target.position - sample.position
    if math.isnan(error):
        error = target.position - place
    resting = target.velocity == 0.0 and target.acceleration == 0.0
    if resting and abs(error) <= p.rest:
        error = 0.0
    slip = target.velocity + p.position * error - velocity
    ahead = p.ahead_velocity * target.velocity + p.ahead_acceleration * target.acceleration
    ahead += p.ahead_gravity
    if p.ahead_unbalance != 0.0:
        ahead += p.ahead_unbalance * math.sin(target.position - p.hangs)
    # Friction in the commanded direction; at rest in the direction of the target.
    if target.velocity != 0.0:
        ahead += math.copysign(p.ahead_friction, target.velocity)
    elif resting and error != 0.0:
        ahead += math.copysign(p.loosen, error)
    before = s.integral
    # An integral against the commanded direction was friction of the other direction.
    if s.rested > 0.5 and before * target.velocity < 0.0:
        before = 0.0
    gathered = before + p.velocity * p.integral * slip * dt
    if resting and error == 0.0:
        gathered = before
    wanted = ahead + p.velocity * slip + gathered
    delays, out = notch.step(p.notch, Delays(s.first, s.second), wanted, dt)
    effort = min(max(out, -p.limit), p.limit)
    # Anti-windup: beyond the limit the integral only comes back.
    if effort != out and (out - effort) * (gathered - before) > 0.0:
        gathered = before
    # The set point's acceleration carries the prediction on; what differs is corrected.
    ahead_place = place + dt * (velocity + 0.5 * dt * target.acceleration)
    speed = velocity + dt * target.acceleration
    rested = 1.0 if resting else 0.0
    memory = Memory(ahead_place, speed, gathered, delays.first, delays.second, rested)
    return memory, effort


LAW = StageLaw("cascade", Cascade, Memory, start, step)
