"""Draws the rooms of the package in ARCHITECTURE.md from its imports.

python docs/make_architecture.py
"""

from __future__ import annotations

import ast
from collections import defaultdict
from pathlib import Path

import grimp
from measured_page import put

ROOT = Path(__file__).resolve().parent.parent
PACKAGE, PAGE = ROOT / "src" / "macromicro", ROOT / "ARCHITECTURE.md"


def imported() -> dict[str, set[str]]:
    """The rooms (folders, and files beside them) that each room imports."""
    graph = grimp.build_graph("macromicro", cache_dir=None)
    found: dict[str, set[str]] = defaultdict(set)
    for module in graph.modules:
        for other in graph.find_modules_directly_imported_by(module):
            above, below = (f"{name}.".split(".")[1] for name in (module, other))
            if above and below and above != below:
                found[above].add(below)
    return found


def levels(imports: dict[str, set[str]]) -> dict[str, int]:
    """How high each room stands above those that it imports; rooms that import each other share
    a level."""
    every = set(imports).union(*imports.values())
    reached = {room: _reached(room, imports) for room in every}
    beside = {a: {b for b in reached[a] if a in reached[b]} | {a} for a in every}
    found: dict[str, int] = {}

    def level(room: str) -> int:
        if room not in found:
            below = set().union(*(imports.get(b, set()) for b in beside[room])) - beside[room]
            height = 1 + max(map(level, below), default=0)
            found.update(dict.fromkeys(beside[room], height))
        return found[room]

    for room in every:
        level(room)
    return found


def _reached(room: str, imports: dict[str, set[str]]) -> set[str]:
    """The rooms that one needs, directly or through others."""
    found: set[str] = set()
    left = [room]
    while left:
        new = imports.get(left.pop(), set()) - found
        found |= new
        left += new
    return found


def said(room: str) -> str:
    """What a room is for: the first sentence of its package."""
    text = ast.get_docstring(ast.parse((PACKAGE / room / "__init__.py").read_text("utf-8"))) or ""
    return text.partition("\n")[0]


def drawing() -> str:
    """Rooms from top to bottom, a line each; a rule between levels."""
    height = levels(imported())
    rooms = [room for room in height if (PACKAGE / room / "__init__.py").is_file()]
    lines: list[str] = []
    before = 0
    for room in sorted(rooms, key=lambda room: (-height[room], room)):
        if lines and height[room] != before:
            lines.append("  " + "-" * 96)
        before = height[room]
        lines.append(f"  {room:<12} {said(room)}")
    return "```\n" + "\n".join(lines) + "\n```\n"


if __name__ == "__main__":
    put(PAGE, "rooms", drawing())
