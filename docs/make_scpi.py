"""Writes docs/scpi.md from docs/scpi.template.md and the table of commands.

python docs/make_scpi.py
"""

from __future__ import annotations

import re
from pathlib import Path

from measured_page import table

from macromicro.serve.scpi.command import Command
from macromicro.serve.scpi.errors import TEXTS
from macromicro.serve.scpi.status import OPERATION_BITS, QUESTIONABLE_BITS
from macromicro.serve.scpi.tree import COMMANDS

FOLDER = Path(__file__).resolve().parent
TEMPLATE, PAGE = FOLDER / "scpi.template.md", FOLDER / "scpi.md"
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
