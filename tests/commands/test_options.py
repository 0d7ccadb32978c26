"""The words of the commands' options: each belongs to one, and says what the code does."""

from __future__ import annotations

from typing import Any

from macromicro.cli import command_line
from macromicro.commands import calibrate, commission, compare, reproduce
from macromicro.commands.options import WORDS
from macromicro.serve.hosts import FOLDER


def parameters(command: Any, *names: str) -> dict[str, set[str]]:
    """Names of the parameters of all commands, by command, by group and of all."""
    found: dict[str, set[str]] = {}
    own = {param.name for param in command.params}
    for name in ("shared", *names):
        found.setdefault(name, set()).update(own)
    for name, each in getattr(command, "commands", {}).items():
        for inner, params in parameters(each, *names, name).items():
            found.setdefault(inner, set()).update(params)
    return found


def test_all_words_are_those_of_a_parameter() -> None:
    known = parameters(command_line())
    for table, words in WORDS.items():
        assert words.keys() <= known[table], table


def test_values_by_default_are_those_that_are_taken() -> None:
    for module in (calibrate, commission, compare, reproduce):
        table = module.__name__.rpartition(".")[2]
        assert WORDS[table]["out"]["default"] == str(module.OUT)
    said = {name: words.get("default") for name, words in WORDS["commission"].items()}
    assert said["speed"] == f"{commission.SPEED}, or {commission.TURNING[0]}"
    assert said["travel"] == f"{commission.TRAVEL}, or {commission.TURNING[1]}"
    assert said["creep"] == f"speed / {commission.CREEP:g}"
    assert WORDS["doctor"]["record"]["default"] == str(FOLDER)
    assert str(FOLDER) in WORDS["serve"]["record"]["default"]
