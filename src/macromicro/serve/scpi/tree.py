"""All commands: the one table that the parser is made from, and docs/scpi.md."""

from __future__ import annotations

from macromicro.serve.requests import REQUESTS
from macromicro.serve.scpi import common, motion, queries, setting, system, waveform
from macromicro.serve.scpi.command import Command
from macromicro.serve.scpi.header import Tree

_LISTED: tuple[Command, ...] = (
    *common.COMMON,
    *system.COMMANDS,
    *motion.COMMANDS,
    *queries.COMMANDS,
    *setting.COMMANDS,
    *waveform.COMMANDS,
    *common.STATUS,
)
_HEADERS = {command.header for command in _LISTED}
# A request that has no place among those has one behind them.
COMMANDS = _LISTED + tuple(
    command
    for kind in REQUESTS
    for command in motion.commands(kind.name)
    if command.header not in _HEADERS
)
TREE = Tree(COMMANDS)
