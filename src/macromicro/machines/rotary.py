"""The machine `rotary`: a machine `axis` with rad for m, N*m for N and kg*m^2 for kg."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.control import cascade
from macromicro.control.live.leading import Touch
from macromicro.machines import axis, deriving, equipped, feasible, homing, sheets
from macromicro.machines import parts as linear
from macromicro.machines._rounding import rounded
from macromicro.machines.parts import INDEX, MARK, MOTOR, NONE, START, STOP, Timing
from macromicro.machines.rotary_parts import (
    FRICTION,
    SWITCHES,
    Arrival,
    Cascade,
    Feedback,
    Gear,
    Homing,
    Limits,
    Motion,
    Motor,
    Rubbing,
    Switches,
    Travel,
    Turned,
    Turntable,
)
from macromicro.machines.stage import Kind
from macromicro.machines.tree import Checked, Problem, Rule, machine_tree, settled
from macromicro.place import ANGLE
from macromicro.plant import power
from macromicro.plant.axis import Axis as Plant
from macromicro.plant.equipped import Equipped
from macromicro.plant.power import Amplifier
from macromicro.plant.transmission import BELT, Transmission
from macromicro.schema.par import entries

NAME = "rotary"
TITLE = "one axis that a motor turns"
TURN = 2.0 * math.pi  # rad


def as_axis(tree: Any) -> Any:
    """Settings of an axis with the same equations: 1 rad becomes 1 m."""
    if isinstance(tree, axis.Axis):
        return tree
    motor, gear, load, encoder = tree.motor, tree.drive, tree.load, tree.encoder
    low, high, endless = load.stop_low, load.stop_high, load.ends == NONE
    if endless:  # what is watched, and a turn beyond
        low = min(tree.travel.low, tree.guard.low) - TURN
        high = max(tree.travel.high, tree.guard.high) + TURN
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
            stop_low=low,
            stop_high=high,
            stop_stiffness=load.stop_stiffness,
            stop_damping=load.stop_damping,
            unbalance=load.unbalance,
            hangs=load.hangs,
            endless=endless,
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
    """A rule of an axis, with angles rounded in degrees."""
    return path, lambda tree: _in_degrees(tree, path, rule(as_axis(tree)))


def _in_degrees(
    tree: Any, path: str, value: Any, as_read: Callable[[float], float] = rounded
) -> Any:
    par = next(e.par for e in entries(tree) if e.path == path)
    if "deg" not in par.read_in:
        return value
    return par.taken(as_read(par.given(value)))


def _unless(path: str, plain: Callable[[Any], Any], endless: Callable[[Any], Any]) -> Rule:
    """The rule of an axis with stops, or its replacement for continuous rotation."""
    stopped = _rule(path, plain)[1]

    def made(tree: Any) -> Any:
        if tree.load.ends != NONE:
            return stopped(tree)
        return _in_degrees(tree, path, endless(tree), lambda degrees: round(degrees, 6))

    return path, made


def _named(tree: Any) -> str:
    """Default of `homing.on`."""
    if tree.load.ends != NONE:
        return STOP
    return INDEX if tree.encoder.index_pulse == MARK else START


_ENDLESS: dict[str, Callable[[Any], float]] = {
    "travel.low": lambda tree: -TURN,
    "travel.high": lambda tree: TURN,
    "guard.low": lambda tree: tree.travel.low - 0.5 * TURN,
    "guard.high": lambda tree: tree.travel.high + 0.5 * TURN,
    "encoder.index_place": lambda tree: 0.0,
}


def _rules() -> Iterator[Rule]:
    yield "homing.on", _named
    for path, rule in deriving.RULES:
        if path == "encoder.pitch":
            yield path, _pitch
        elif path in _ENDLESS:
            yield _unless(path, rule, _ENDLESS[path])
        else:
            yield _rule(path, rule)


RULES: tuple[Rule, ...] = tuple(_rules())


def problems(tree: Any) -> list[Problem]:
    broken = [(path, value, words) for wrong, path, value, words in _ends(tree) if wrong]
    return broken or feasible.problems(as_axis(tree))


def _ends(tree: Any) -> Iterator[Checked]:
    """Settings that need an end of the travel, and those that need none."""
    on, endless = tree.homing.on, tree.load.ends == NONE
    remedy = f'"{START}", or "{INDEX}" with encoder.index_pulse = "{MARK}": continuous rotation'
    yield endless and on not in (START, INDEX), "homing.on", on, remedy
    yield (
        on == START and not endless,
        "homing.on",
        on,
        f'what it has; "{START}" is for ends = "none"',
    )
    for name in ("limits", "home"):
        what = getattr(tree.switches, name)
        yield endless and what != NONE, f"switches.{name}", what, f'"{NONE}": continuous rotation'


@machine_tree(cascade.LAW, RULES, problems)
class Rotary(NamedTuple):
    """Settings of ``machine = "rotary"``; `DEFAULT` has derived values filled in."""

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
    return axis.prepare(as_axis(tree))


def model(tree: Any, frequency: Array) -> npt.NDArray[np.complex128]:
    """Angle at the encoder per effort, by the sheets."""
    return sheets.plant(as_axis(tree), frequency)


def touch(tree: Any) -> Touch | None:
    """Homing at the lower end stop."""
    return homing.touch(as_axis(tree))


KIND = axis.KIND._replace(name=NAME, prepare=prepare, place=ANGLE)


def kind(tree: Any) -> Kind:
    found = equipped.kind(as_axis(tree))
    made = _equipped if found.lines else prepare
    return found._replace(name=NAME, prepare=made, place=ANGLE)


def _equipped(tree: Any) -> Equipped:
    return equipped.prepare(as_axis(tree))


LAW = cascade.LAW
