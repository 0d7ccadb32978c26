"""The commands as data, for commands.md."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any, NamedTuple

PROGRAM = "macromicro"


class Option(NamedTuple):
    # as they are typed, "--out"; of an argument its word in the usage, "PROGRAMME"
    names: tuple[str, ...]
    takes: str  # word for its value, "FILE"; "" for a flag
    help: str  # what it does
    default: str  # in words; "" where there is none
    argument: bool  # whether it is an argument
    required: bool  # whether it must be given
    many: bool  # whether it may be given again


class Entry(NamedTuple):
    """A command, or a group of them."""

    path: tuple[str, ...]  # its words, none for the program itself
    help: str  # its help text; paragraphs are parted by an empty line
    options: tuple[Option, ...]  # arguments first, in their order; `--help` is not among them
    commands: tuple[str, ...]  # of a group, the names of what is in it

    @property
    def short(self) -> str:
        paragraph = " ".join(self.help.partition("\n\n")[0].split())
        return paragraph.partition(". ")[0].rstrip(".")


def entries(command: Any, path: tuple[str, ...] = ()) -> list[Entry]:
    inner = dict(getattr(command, "commands", {}))
    options = [_option(p) for p in command.params if p.name != "help"]
    options.sort(key=lambda option: not option.argument)
    found = [Entry(path, inspect.cleandoc(command.help or ""), tuple(options), tuple(inner))]
    for name, each in inner.items():
        found += entries(each, (*path, name))
    return found


def _option(param: Any) -> Option:
    argument = param.param_type_name == "argument"
    word = str(param.metavar or param.name.upper())
    flag = bool(getattr(param, "is_flag", False))
    shown = param.show_default
    if isinstance(shown, str):
        default = shown
    elif flag or shown is False or param.default in (None, [], ()):
        default = ""
    else:
        default = str(param.default)
    names = (word,) if argument else (*param.opts, *param.secondary_opts)
    many = bool(param.multiple) or param.nargs == -1
    takes = "" if flag or argument else str(param.metavar or _kind(param))
    return Option(names, takes, _line(param.help), default, argument, bool(param.required), many)


def _kind(param: Any) -> str:
    """A word for a value whose option names none."""
    kind = getattr(getattr(param, "type_descriptor", None), "annotation", str)
    return {int: "N", float: "X", Path: "PATH"}.get(kind, "TEXT")


def _line(text: str | None) -> str:
    return " ".join((text or "").split())
