"""Options of the commands: type and default are the function's, the words are `options.toml`'s."""

from __future__ import annotations

import inspect
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer

from macromicro.commands.group import whole

PNG = "png"
WORDS: dict[str, dict[str, Any]] = tomllib.loads(
    Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
)


def _examples() -> list[tuple[str, str]]:
    from macromicro import programme

    return [(name, "example programme") for name in programme.shipped()]


# What a shell offers as values, by the word in the table.
COMPLETIONS = {"programmes": _examples}
Function = TypeVar("Function", bound=Callable[..., None])


def command(app: typer.Typer, name: str | None = None) -> Callable[[Function], Function]:
    """Add a function as a command, by its own name or another."""

    def add(function: Function) -> Function:
        parameters = with_words(function, str(app.info.name), function.__name__.strip("_")).values()
        function.__signature__ = inspect.Signature([*parameters])  # type: ignore[attr-defined]
        app.command(name)(function)
        return function

    return add


def with_words(function: Callable[..., None], *tables: str) -> dict[str, inspect.Parameter]:
    """The parameters of a function as options and arguments, with the words of these tables."""
    words = {name: each for t in ("shared", *tables) for name, each in WORDS.get(t, {}).items()}
    parameters = inspect.signature(function, eval_str=True).parameters
    return {name: _with_words(par, words[name]) for name, par in parameters.items()}


def _with_words(par: inspect.Parameter, words: dict[str, Any]) -> inspect.Parameter:
    """A parameter as an option, or as an argument."""
    shown = {"help": words["help"], "metavar": words.get("metavar")}
    shown["show_default"] = words.get("default", True)
    if par.annotation in (int, int | None):
        shown["parser"] = whole
    if "complete" in words:
        shown["autocompletion"] = COMPLETIONS[words["complete"]]
    if words.get("argument"):
        info = typer.Argument(**shown)
    else:
        name = words.get("name", f"--{par.name.replace('_', '-')}")
        info = typer.Option(name, min=words.get("min"), max=words.get("max"), **shown)
    return par.replace(annotation=Annotated[par.annotation, info])
