"""The machine `axis`: one motor-driven axis, from its data sheets."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from macromicro.arrays import Array
from macromicro.control import cascade
from macromicro.control.cascade import Cascade
from macromicro.kernel import kernel
from macromicro.machines import deriving, feasible, sheets
from macromicro.machines.guarding import Limits
from macromicro.machines.parts import (
    LOAD,
    Feedback,
    Homing,
    Load,
    Motion,
    Switches,
    Timing,
    Travel,
)
from macromicro.machines.sequence import Arrival
from macromicro.machines.signals import Sample
from macromicro.machines.stage import Kind
from macromicro.machines.tree import derive_all, machine_tree
from macromicro.plant import axis, power
from macromicro.plant.axis import Body, Reading
from macromicro.plant.carriage import Carriage
from macromicro.plant.climate import Climate
from macromicro.plant.encoder import Encoder
from macromicro.plant.friction import AxisFriction
from macromicro.plant.power import Amplifier, Motor
from macromicro.plant.transmission import Transmission

NAME = "axis"
TITLE = "one motor-driven axis"


@machine_tree(cascade.LAW, deriving.RULES, feasible.problems)
class Axis(NamedTuple):
    """Settings of ``machine = "axis"``; `DEFAULT` has derived values filled in."""

    amplifier: Amplifier = Amplifier()
    motor: Motor = Motor()
    drive: Transmission = Transmission()
    load: Load = Load()
    friction: AxisFriction = AxisFriction()
    encoder: Feedback = Feedback()
    timing: Timing = Timing()
    travel: Travel = Travel()
    motion: Motion = Motion()
    arrival: Arrival = Arrival()
    controller: Cascade = Cascade()
    guard: Limits = Limits()
    switches: Switches = Switches()
    homing: Homing = Homing()
    climate: Climate = Climate()


DEFAULT: Any = derive_all(Axis())


def prepare(tree: Any) -> axis.Axis:
    """The physics of an axis, or of a rotary one."""
    drive, moved = tree.drive, tree.load.mass + tree.load.payload
    stiffness = moved * (2.0 * math.pi * drive.frequency) ** 2
    rotor = sheets.turning(tree)
    body = Body(
        rotor,
        stiffness,
        2.0 * drive.damping * math.sqrt(stiffness * moved),
        drive.backlash,
        sheets.weight(tree),
        drive.error,
        drive.error_period,
        drive.cogging,
        drive.cogging_period,
        *sheets.eccentric_load(tree),
    )
    reading = Reading(
        Encoder(tree.encoder.pitch, tree.encoder.bits),
        int(tree.encoder.at == LOAD),
        tree.encoder.noise,
    )
    return axis.Axis(
        power.prepare(tree.amplifier, tree.motor, sheets.constant(tree), drive.efficiency),
        Carriage(moved, *_stops(tree), tree.load.stop_stiffness, tree.load.stop_damping),
        body,
        AxisFriction(*tree.friction),
        reading,
        tree.timing.delay,
        tree.timing.steps,
        getattr(tree, "climate", Climate()),
    )


def _stops(tree: Any) -> tuple[float, float]:
    return (-math.inf, math.inf) if sheets.endless(tree) else sheets.ends(tree)


@kernel
def measure(p: axis.Axis, s: axis.State, t: float, noise: Array, k: int) -> Sample:
    return Sample(t, axis.measured(p, s, noise, k) * p.reading.encoder.pitch)


KIND = Kind(NAME, axis.NOISES, axis.Truth, prepare, axis.at_rest, measure, axis.advance, axis.truth)
LAW = cascade.LAW
