"""The programmes of a machine: moves of its only stage, moves of several, or paths in a plane."""

from __future__ import annotations

from typing import Any

from macromicro import programme as programmes
from macromicro.errors import InputError
from macromicro.machines import moves, planning
from macromicro.machines.composite import AnyMachine, Composite
from macromicro.machines.joint import course
from macromicro.machines.joint import planning as joint_planning
from macromicro.programme.moves import MAX_MOVES
from macromicro.schema import keys


def choose(machine: AnyMachine, settings: Any, name: str | None = None) -> Any:
    """A programme's file, an example by its name, or the machine's usual moves."""
    path = None if name is None else programmes.find(name)
    if not isinstance(machine, Composite):
        return planning.usual(settings) if path is None else planning.load(path, settings)
    if machine.has_plane:
        return course.usual(settings) if path is None else course.load(path)
    if path is None:
        return moves.usual(machine, settings)
    return moves.load(path, machine, settings)


def repeat(machine: AnyMachine, programme: Any, cycles: int) -> Any:
    """A programme several times, one after the other."""
    if isinstance(machine, Composite):
        keys.whole(cycles, 1, MAX_MOVES // len(programme.legs), "--cycles")
        repeat: Any = course.repeat if machine.has_plane else lambda legs, n: legs * n
        return programme._replace(legs=repeat(programme.legs, cycles))
    try:
        return programme.repeated(cycles)
    except InputError as error:
        raise error.at("--cycles") from None


def plan(machine: AnyMachine, settings: Any, programme: Any) -> Any:
    """The profiles of a programme within the machine's limits."""
    if not isinstance(machine, Composite):
        return planning.plan(programme, settings)
    if machine.has_plane:
        return joint_planning.plan(programme, settings)
    return moves.plan(machine, settings, programme)
