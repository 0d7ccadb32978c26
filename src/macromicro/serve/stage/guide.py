"""Parameters of the live machine from the settings of a single-stage machine."""

from __future__ import annotations

import math
from typing import Any

from macromicro.control.live.leading import Guide, Ready
from macromicro.control.live.messages import MACRO
from macromicro.control.live.parameters import (
    Brake,
    Edges,
    Homing,
    Jogging,
    Live,
    LiveParameters,
    SoftLimits,
    prepare,
)
from macromicro.machines import lines
from macromicro.machines.machine import Machine

WIDE = 8.0  # standard deviations of the noise in a count: a stage at rest shows one or two counts
JOG = 0.25  # of the greatest speed


def count(tree: Any) -> float:
    """Travel per count of the live machine, by the encoder's resolution."""
    return float(max(tree.encoder.pitch, WIDE * tree.encoder.noise))


def guide(machine: Machine, tree: Any, *, switched: bool = False) -> Guide:
    arrival, motion, guard = tree.arrival, tree.motion, tree.guard
    touch = None if machine.touch is None else machine.touch(tree)
    return Guide(
        motion.velocity,
        motion.acceleration,
        motion.jerk,
        Ready(arrival.tolerance, arrival.dwell, arrival.patience),
        guard.low,
        guard.high,
        touch,
        lines.leaving(tree),
        lines.rise(tree) if switched else 0.0,
        guard.heat > 0.0,
        guard.lean > 0.0 and guard.heat == 0.0,
    )


def live(machine: Machine, tree: Any) -> Live:
    pitch, travel, motion = count(tree), tree.travel, tree.motion
    plain, lead = Live(), guide(machine, tree)
    slow = motion.velocity * JOG if lead.touch is None else lead.touch.speed
    low, high = (math.floor(end / pitch + 0.5) for end in (travel.low, travel.high))
    return plain._replace(
        pitch=pitch,
        limits=SoftLimits(
            macro_low=float(low),
            macro_high=float(high),
            whole_low=travel.low,
            whole_high=travel.high,
        ),
        homing=Homing(),
        jogging=Jogging(macro=motion.velocity * JOG, slow=slow),
        brake=Brake(motion.acceleration, 2.0 * tree.guard.speed / pitch),
        edges=Edges(use=0, bounce=0.0),
        turns=int(machine.kind.place.turns),
    )


def parameters(machine: Machine, tree: Any) -> LiveParameters:
    return prepare(live(machine, tree), stages=(MACRO,))
