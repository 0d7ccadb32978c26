"""The table of all commands, behind the parser and docs/scpi.md."""

from __future__ import annotations

from functools import cache

from macromicro.control.live.messages import AXES
from macromicro.place import ANGLE, Place
from macromicro.serve.requests import REQUESTS
from macromicro.serve.scpi import _common, _motion, _queries, _setting, _system, _waveform
from macromicro.serve.scpi._message import Tree
from macromicro.serve.scpi._parameters import Number, Parameter
from macromicro.serve.scpi.command import Command

_LISTED: tuple[Command, ...] = (
    *_common.COMMON,
    *_system.COMMANDS,
    *_motion.COMMANDS,
    *_queries.COMMANDS,
    *_setting.COMMANDS,
    *_waveform.WAVEFORMS,
    *_waveform.CAPTURES,
    *_common.STATUS,
)
_HEADERS = {command.header for command in _LISTED}
# A request that has no place among those has one behind them.
COMMANDS = _LISTED + tuple(
    command
    for kind in REQUESTS
    for command in _motion.commands(kind.name)
    if command.header not in _HEADERS
)
_FARTHER = 1e3  # angles are as many radians, where lengths are less than so many metres


def as_rotary(command: Command) -> Command:
    """A command for a rotary machine: its positions are angles."""

    def made(parameter: Parameter) -> Parameter:
        unit = ANGLE.named(getattr(parameter, "unit", ""))
        if not isinstance(parameter, Number) or unit == parameter.unit:
            return parameter
        lo, hi = _FARTHER * parameter.lo, _FARTHER * parameter.hi
        return parameter._replace(unit=unit, lo=lo, hi=hi)

    return command._replace(parameters=tuple(map(made, command.parameters)))


TREE = Tree(COMMANDS)


@cache
def commands(axes: tuple[str, ...] = ()) -> tuple[Command, ...]:
    """The commands of a machine of these named stages."""
    if axes in ((), AXES):
        return COMMANDS
    named = {command.header for command in _of_stages(AXES)}
    return (*(c for c in COMMANDS if c.header not in named), *_of_stages(axes))


def _of_stages(axes: tuple[str, ...]) -> tuple[Command, ...]:
    return (*_motion.of_stages(axes), *_queries.of_stages(axes))


@cache
def tree(place: Place, axes: tuple[str, ...] = ()) -> Tree:
    """The commands of a machine of these named stages, with positions in `place`."""
    own = commands(axes)
    return Tree(map(as_rotary, own) if place.turns else own)
