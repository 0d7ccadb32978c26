"""Writes docs/scpi.md from docs/scpi.template.md and the table of commands.

python docs/make_scpi.py
"""

from __future__ import annotations

import re
from pathlib import Path

from measured_page import table

from macromicro.serve.scpi.command import Command
from macromicro.serve.scpi.errors import TEXTS
from macromicro.serve.scpi.tree import COMMANDS

FOLDER = Path(__file__).resolve().parent
TEMPLATE, PAGE = FOLDER / "scpi.template.md", FOLDER / "scpi.md"
# Bits of the registers, which macromicro.serve.scpi.status sets.
OPERATION_BITS = {
    1: "settling: the wait between the macro- and the micro-stage",
    8: "macro-stage moving",
    9: "micro-stage moving",
    10: "homing",
    11: "holding: the micro-stage is under control",
    12: "recording",
    13: "enabled",
}
QUESTIONABLE_BITS = {
    2: "time: too many control periods were missed, or the rig's clock is wrong (fault)",
    4: "temperature: actuator too hot, heated without motion or for too long (fault)",
    8: "calibration: the position is not trusted; home",
    9: "macro-stage, or a stage of another machine: its motion, sensor, switches or drive (fault)",
    10: "micro-stage: its motion or its Hall sensor (fault)",
    11: "a fault is latched; FAULt? describes it",
    12: "the loop process does not run, or has reported nothing for a second",
}
HEAD = ("command", "parameters", "what", "answer", "who")


def row(command: Command) -> list[str]:
    """A command as a line of the table."""
    taken = "; ".join(
        f"{'[' if p.optional else ''}*{p.name}*{']' if p.optional else ''}: {p.words()}"
        for p in command.parameters
    )
    text, answer = (t.replace("*", "\\*") for t in (command.text, command.answer))
    cells = (f"`{command.header}`", taken, text, answer, command.access)
    return [cell.replace("|", "\\|") for cell in cells]


def bits(names: dict[int, str]) -> str:
    """Bits of a register."""
    rows = [(str(k), str(1 << k), text) for k, text in names.items()]
    return table(("bit", "value", "meaning"), rows)


def render() -> str:
    """The page."""
    parts = {
        "commands": table(HEAD, map(row, COMMANDS)),
        "operation": bits(OPERATION_BITS),
        "questionable": bits(QUESTIONABLE_BITS),
        "errors": table(("number", "text"), [(str(n), text) for n, text in TEXTS.items()]),
    }
    text = TEMPLATE.read_text(encoding="utf-8")
    return re.sub(r"<<(\w+)>>", lambda m: parts[m[1]].rstrip(), text)


if __name__ == "__main__":
    PAGE.write_text(render(), encoding="utf-8")
