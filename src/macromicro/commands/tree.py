"""The commands as data: what shell completion offers and docs/commands.md lists."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any, NamedTuple

PROGRAM = "macromicro"


class Option(NamedTuple):
    """An option or argument of a command.

    Attributes
    ----------
    names : tuple[str, ...]
        As they are typed, "--out"; of an argument its word in the usage, "PROGRAMME".
    takes : str
        Word for its value, "FILE"; "" for a flag.
    help : str
        What it does.
    default : str
        In words; "" where there is none.
    argument : bool
        Whether it is an argument.
    required : bool
        Whether it must be given.
    many : bool
        Whether it may be given again.
    """

    names: tuple[str, ...]
    takes: str
    help: str
    default: str
    argument: bool
    required: bool
    many: bool


class Entry(NamedTuple):
    """A command, or a group of them.

    Attributes
    ----------
    path : tuple[str, ...]
        Its words, none for the program itself.
    help : str
        Its help text; paragraphs are parted by an empty line.
    options : tuple[Option, ...]
        Arguments first, in their order; `--help` is not among them.
    commands : tuple[str, ...]
        Of a group, the names of what is in it.
    """

    path: tuple[str, ...]
    help: str
    options: tuple[Option, ...]
    commands: tuple[str, ...]

    @property
    def short(self) -> str:
        """The help's first sentence, on one line."""
        paragraph = " ".join(self.help.partition("\n\n")[0].split())
        return paragraph.partition(". ")[0].rstrip(".")


def entries(command: Any, path: tuple[str, ...] = ()) -> list[Entry]:
    """The program and all its commands.

    Parameters
    ----------
    command : Any
        A command or group of typer's, such as a context's root.
    path : tuple[str, ...], optional
        Words that lead to it.

    Returns
    -------
    list[Entry]
        Groups stand before what is in them.
    """
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
