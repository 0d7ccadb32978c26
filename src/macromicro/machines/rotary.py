"""The machine `rotary`: a motor that turns a load, from its data sheets.

Its equations are those of the machine `axis` with rad for m, N*m for N and kg*m^2 for kg; so are
its law, its guard, and what follows from the sheets and what they do not allow: `as_axis` gives the
settings of an axis with the same numbers, and this file has the words and units of what turns.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.control import cascade
from macromicro.control.live.leading import Touch
from macromicro.machines import axis, deriving, equipped, feasible, homing, sheets
from macromicro.machines import parts as linear
from macromicro.machines.parts import MOTOR, Homing, Timing
from macromicro.machines.rotary_parts import (
    FRICTION,
    SWITCHES,
    Arrival,
    Cascade,
    Feedback,
    Gear,
    Limits,
    Motion,
    Motor,
    Rubbing,
    Switches,
    Travel,
    Turned,
    Turntable,
)
from macromicro.machines.rounding import rounded
from macromicro.machines.stage import Kind
from macromicro.machines.tree import Problem, Rule, machine_tree, settled
from macromicro.place import ANGLE
from macromicro.plant import power
from macromicro.plant.axis import Axis as Plant
from macromicro.plant.equipped import Equipped
from macromicro.plant.power import Amplifier
from macromicro.plant.transmission import BELT, Transmission
from macromicro.schema.par import entries

NAME = "rotary"
TITLE = "one axis that a motor turns"


def as_axis(tree: Any) -> Any:
    """The settings of an axis with the same equations: a place of 1 rad is one of 1 m.

    Parameters
    ----------
    tree : Any
        Settings of an axis that turns; or of one that slides, which stay as they are.

    Returns
    -------
    Any
        Of the machine `axis`, driven by a belt on a pulley of 1 m.
    """
    if isinstance(tree, axis.Axis):
        return tree
    motor, gear, load, encoder = tree.motor, tree.drive, tree.load, tree.encoder
    return axis.DEFAULT._replace(
        law=tree.law,
        own=tree.own,
        amplifier=tree.amplifier,
        motor=power.Motor(
            constant=motor.constant,
            resistance=motor.resistance,
            inductance=motor.inductance,
            inertia=motor.inertia,
        ),
        drive=Transmission(
            kind=BELT,
            radius=1.0,
            gear=gear.ratio,
            inertia=gear.inertia,
            efficiency=gear.efficiency,
            frequency=gear.frequency,
            damping=gear.damping,
            backlash=gear.backlash,
            error=gear.error,
            error_period=gear.error_period,
            cogging=gear.cogging,
            cogging_period=gear.cogging_period,
        ),
        load=Turned(
            mass=load.inertia,
            payload=load.payload,
            incline=0.0,
            stop_low=load.stop_low,
            stop_high=load.stop_high,
            stop_stiffness=load.stop_stiffness,
            stop_damping=load.stop_damping,
            unbalance=load.unbalance,
            hangs=load.hangs,
        ),
        friction=tree.friction,
        encoder=linear.Feedback(
            at=encoder.at,
            lines=0.25 * encoder.counts,
            pitch=encoder.pitch,
            noise=encoder.noise,
            bits=encoder.bits,
            rate=encoder.rate,
            index_pulse=encoder.index_pulse,
            index_place=encoder.index_place,
        ),
        timing=tree.timing,
        travel=tree.travel,
        motion=tree.motion,
        arrival=tree.arrival,
        controller=tree.controller,
        guard=tree.guard,
        switches=tree.switches,
        homing=tree.homing,
    )


def _pitch(tree: Any) -> float:
    turns = tree.drive.ratio if tree.encoder.at == MOTOR else 1.0
    return float(2.0 * math.pi / (tree.encoder.counts * turns))


def _rule(path: str, rule: Callable[[Any], Any]) -> Rule:
    """A rule of an axis; an angle is rounded in degrees, as it is read."""

    def made(tree: Any) -> Any:
        value = rule(as_axis(tree))
        par = next(e.par for e in entries(tree) if e.path == path)
        if "deg" not in par.read_in:
            return value
        return par.taken(rounded(par.given(value)))

    return path, made


RULES: tuple[Rule, ...] = tuple(
    (path, _pitch) if path == "encoder.pitch" else _rule(path, rule)
    for path, rule in deriving.RULES
)


def problems(tree: Any) -> list[Problem]:
    """What cannot work together in settings of an axis that turns.

    Parameters
    ----------
    tree : Any
        Its settings.

    Returns
    -------
    list[Problem]
        As `feasible.problems`, whose parameters have the same paths here.
    """
    return feasible.problems(as_axis(tree))


@machine_tree(cascade.LAW, RULES, problems)
class Rotary(NamedTuple):
    """The tree behind ``machine = "rotary"``; `DEFAULT` has what is derived filled in."""

    amplifier: Amplifier = Amplifier()
    motor: Motor = Motor()
    drive: Gear = Gear()
    load: Turntable = Turntable()
    friction: Rubbing = FRICTION
    encoder: Feedback = Feedback()
    timing: Timing = Timing()
    travel: Travel = Travel()
    motion: Motion = Motion()
    arrival: Arrival = Arrival()
    controller: Cascade = Cascade()
    guard: Limits = Limits()
    switches: Switches = SWITCHES
    homing: Homing = Homing()


DEFAULT: Any = settled(Rotary())


def prepare(tree: Any) -> Plant:
    """Runtime parameters.

    Parameters
    ----------
    tree : Any
        Settings.

    Returns
    -------
    Plant
        For the kernels of `plant.axis`.
    """
    return axis.prepare(as_axis(tree))


def model(tree: Any, frequency: Array) -> npt.NDArray[np.complex128]:
    """Angle at the encoder per effort, as the sheets say.

    Parameters
    ----------
    tree : Any
        Settings.
    frequency : ndarray, shape (n,)
        Hz.

    Returns
    -------
    ndarray of complex, shape (n,)
        rad/V.
    """
    return sheets.plant(as_axis(tree), frequency)


def touch(tree: Any) -> Touch:
    """How it feels for its lower end stop.

    Parameters
    ----------
    tree : Any
        Settings.

    Returns
    -------
    Touch
        As `homing.touch`.
    """
    return homing.touch(as_axis(tree))


KIND = axis.KIND._replace(name=NAME, prepare=prepare, place=ANGLE)


def kind(tree: Any) -> Kind:
    """The kernels of an axis that turns, with the lines of its drive if it has such.

    Parameters
    ----------
    tree : Any
        Settings.

    Returns
    -------
    Kind
        `KIND` for one without lines.
    """
    found = equipped.kind(as_axis(tree))
    made = _equipped if found.lines else prepare
    return found._replace(name=NAME, prepare=made, place=ANGLE)


def _equipped(tree: Any) -> Equipped:
    return equipped.prepare(as_axis(tree))


LAW = cascade.LAW
