"""The machine `rotary`: a machine `axis` with rad for m, N*m for N and kg*m^2 for kg."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any, NamedTuple

from macromicro.control import cascade
from macromicro.machines import axis, deriving, equipped, feasible
from macromicro.machines._rounding import round_to
from macromicro.machines.parts import INDEX, MARK, MOTOR, NONE, START, STOP, Timing
from macromicro.machines.rotary_parts import (
    FRICTION,
    SWITCHES,
    Arrival,
    Cascade,
    Feedback,
    Friction,
    Gear,
    Homing,
    Limits,
    Motion,
    Motor,
    Switches,
    Travel,
    Turntable,
)
from macromicro.machines.sheets import TURN
from macromicro.machines.stage import Kind
from macromicro.machines.tree import Checked, Problem, Rule, derive_all, machine_tree
from macromicro.place import ANGLE
from macromicro.plant.power import Amplifier
from macromicro.schema.par import Par, entries

NAME = "rotary"
TITLE = "one axis that a motor turns"
LAW = cascade.LAW


def _pitch(tree: Any) -> float:
    turns = tree.drive.ratio if tree.encoder.at == MOTOR else 1.0
    return float(2.0 * math.pi / (tree.encoder.counts * turns))


def _usual_homing(tree: Any) -> str:
    """Default of `homing.on`."""
    if not tree.load.endless:
        return STOP
    return INDEX if tree.encoder.index_pulse == MARK else START


_ENDLESS: dict[str, Callable[[Any], float]] = {
    "travel.low": lambda tree: -TURN,
    "travel.high": lambda tree: TURN,
    "guard.low": lambda tree: tree.travel.low - 0.5 * TURN,
    "guard.high": lambda tree: tree.travel.high + 0.5 * TURN,
    "encoder.index_place": lambda tree: 0.0,
}


@cache
def _parameters(kind: Any) -> dict[str, Par]:
    """The parameters of a tree by path; each rule asks for its own, again for every variant."""
    return {e.path: e.par for e in entries(kind())}


def _rule(path: str, rule: Callable[[Any], Any]) -> Rule:
    """The rule of an axis, or its replacement for continuous rotation; angles round in degrees."""

    def made(tree: Any) -> Any:
        endless = _ENDLESS.get(path) if tree.load.endless else None
        value = rule(tree) if endless is None else endless(tree)
        kind: Any = type(tree)
        par = _parameters(kind)[path]
        if "deg" not in par.read_in:
            return value
        degrees = par.given(value)
        return par.taken(round_to(degrees) if endless is None else round(degrees, 6))

    return path, made


RULES: tuple[Rule, ...] = (
    ("homing.on", _usual_homing),
    *(
        (path, _pitch) if path == "encoder.pitch" else _rule(path, rule)
        for path, rule in deriving.RULES
    ),
)


def problems(tree: Any) -> list[Problem]:
    broken = [(path, value, words) for wrong, path, value, words in _ends(tree) if wrong]
    return broken or feasible.problems(tree)


def _ends(tree: Any) -> Iterator[Checked]:
    """Settings that need an end of the travel, and those that need none."""
    on, endless = tree.homing.on, tree.load.endless
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


@machine_tree(LAW, RULES, problems)
class Rotary(NamedTuple):
    """Settings of ``machine = "rotary"``; `DEFAULT` has derived values filled in."""

    amplifier: Amplifier = Amplifier()
    motor: Motor = Motor()
    drive: Gear = Gear()
    load: Turntable = Turntable()
    friction: Friction = FRICTION
    encoder: Feedback = Feedback()
    timing: Timing = Timing()
    travel: Travel = Travel()
    motion: Motion = Motion()
    arrival: Arrival = Arrival()
    controller: Cascade = Cascade()
    guard: Limits = Limits()
    switches: Switches = SWITCHES
    homing: Homing = Homing()


DEFAULT: Any = derive_all(Rotary())


KIND = axis.KIND._replace(name=NAME, place=ANGLE)


def kind(tree: Any) -> Kind:
    return equipped.kind(tree)._replace(name=NAME, place=ANGLE)
