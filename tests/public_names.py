"""The public functions and classes of the modules that the reference shows."""

from __future__ import annotations

import ast
import re
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

REFERENCE = Path(__file__).parents[1] / "docs" / "reference"


class Named(NamedTuple):
    """A function or class: its name where it is shown, and its home."""

    name: str
    home: str


def full(name: str) -> str:
    """A module's whole name, from its name within the package."""
    return name if name == "macromicro" else f"macromicro.{name}"


def shown() -> set[str]:
    """All modules of the reference, by their whole names."""
    texts = (page.read_text(encoding="utf-8") for page in REFERENCE.glob("*.rst"))
    return {name for text in texts for name in re.findall(r"automodule:: (\S+)", text)}


def public(module: str) -> list[Named]:
    """Public functions and classes of a module: its front door's, or those that it defines."""
    found = import_module(module)
    listed = getattr(found, "_HOMES", None) or getattr(found, "__all__", None)
    if listed is None:
        tree = ast.parse(Path(str(found.__file__)).read_text(encoding="utf-8"))
        kinds = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef
        listed = [n.name for n in tree.body if isinstance(n, kinds) and not n.name.startswith("_")]
    things = {name: getattr(found, name) for name in listed}
    return [
        Named(f"{module}.{name}", f"{thing.__module__}.{thing.__qualname__}")
        for name, thing in things.items()
        if callable(thing)
    ]
