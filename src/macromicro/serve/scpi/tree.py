"""All commands: the one table that the parser is made from, and docs/scpi.md."""

from __future__ import annotations

from macromicro.serve.scpi import common, motion, setting, system, watching, waveform
from macromicro.serve.scpi.command import Command
from macromicro.serve.scpi.header import Tree

COMMANDS: tuple[Command, ...] = (
    *common.COMMON,
    *system.COMMANDS,
    *motion.COMMANDS,
    *watching.COMMANDS,
    *setting.COMMANDS,
    *waveform.COMMANDS,
    *common.STATUS,
)
TREE = Tree(COMMANDS)
