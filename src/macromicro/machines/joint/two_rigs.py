"""Both axes of a machine on two user rigs: checks, and the way to the start."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from macromicro.errors import InputError
from macromicro.machines import on_rig
from macromicro.machines.joint.machine import XY_MACHINE, Joint
from macromicro.machines.joint.on_rig import Pair, driven
from macromicro.machines.joint.planning import JointPlan
from macromicro.machines.joint.runs import Outcome
from macromicro.machines.joint.settings import AXES, of
from macromicro.rig.opening import OPTION, TWIN
from macromicro.rig.session import Fixture
from macromicro.schema.text import printable
from macromicro.simulate import Sink

AND = "+"  # between the names of two rigs
ACCEPTED = f"{TWIN}, or the rigs of both axes, x first: mylab:x{AND}mylab:y"
Two = tuple[Fixture, Fixture]


def found(name: str, settings: Any, seed: int, what: str = "a programme") -> Two | None:
    if name == TWIN:
        return None
    made = [
        on_rig.found(one, own, seed + k, what)
        for k, (one, own) in enumerate(zip(named(name), of(settings), strict=True))
    ]
    first, second = (one for one in made if one is not None)
    return first, second


def several(name: str) -> bool:
    return AND in name and not Path(name).is_file()


def named(name: str) -> list[str]:
    names = [one.strip() for one in name.split(AND)]
    if len(names) != len(AXES) or TWIN in names:
        raise InputError(OPTION, printable(name), ACCEPTED)
    return names


def opened(rigs: Two, seed: int) -> Pair:
    """Both rigs on one clock, for one run."""
    return Pair([rig.open(seed + k) for k, rig in enumerate(rigs)])


def perform(
    machine: Joint,
    settings: Any,
    plan: JointPlan,
    sink: Sink,
    pair: Pair,
    rests: tuple[float, float] = (0.0, 0.0),
    progress: Callable[[float, int], None] | None = None,
) -> Outcome:
    """Run a plan on two rigs: each goes to the start of the plan, then both run in step."""
    halves = (pair.halves[0], pair.halves[1])
    each = zip(machine.axes, of(settings), plan.plans, halves, rests, strict=True)

    def run(behind: Sink) -> Outcome:
        pair.together = True
        return driven(machine, settings, plan, halves, behind, progress)

    return on_rig.from_start([on_rig.Standing(*one) for one in each], sink, run)


def said(settings: Any, plan: JointPlan, title: str, rigs: Two, expected: float) -> list[str]:
    """What a run will move, how far and how hard."""
    lines = [f"{title or 'a programme'}, about {expected:.0f} s, both axes in step:"]
    for name, own, each, rig in zip(AXES, of(settings), plan.plans, rigs, strict=True):
        told = on_rig.said(XY_MACHINE.axes[0], own, each, "", f"{name} on {rig.name}", expected)
        lines += ["  " + line for line in told]
    return lines
