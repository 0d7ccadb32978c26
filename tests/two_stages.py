"""A machine of two stages that a file describes, its moves and a sweep of it."""

from __future__ import annotations

from pathlib import Path

MACHINE = """
machine = { stages = { x = "axis", z = "piezo" }, order = "together" }
"""
MOVES = """
[[moves]]
x = "2 mm"
z = "5 um"
hold = "0.02 s"
"""
SWEEP = """
job = "machine.toml"
metrics = ["missed", "settling"]

[options]
programme = "{moves}"

[parameters.x.friction]
coulomb = ["2 N", "3 N"]
"""


def write(folder: Path) -> None:
    """machine.toml, moves.toml and sweep.toml."""
    (folder / "machine.toml").write_text(MACHINE, encoding="utf-8")
    (folder / "moves.toml").write_text(MOVES, encoding="utf-8")
    text = SWEEP.format(moves=(folder / "moves.toml").as_posix())
    (folder / "sweep.toml").write_text(text, encoding="utf-8")
