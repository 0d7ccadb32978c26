"""Parameters that explain themselves: unit, meaning, source and bounds beside the value.

A parameter set is a ``NamedTuple`` whose fields are annotated with `Par`; the value
itself stays a plain float in SI (encoder counts and deg C are the two exceptions).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, get_type_hints

ASSUMED = "bench assumption"


@dataclass(frozen=True)
class Par:
    """What a parameter is.

    `unit`: the unit the value is stored in; `shown`: the unit a person reads (same
    dimension); `lo`, `hi`: inclusive bounds in the stored unit, `positive`: strictly
    above zero; `choices`: accepted words of a text parameter.
    """

    unit: str
    meaning: str
    source: str = ASSUMED
    shown: str = ""
    lo: float = -math.inf
    hi: float = math.inf
    positive: bool = False
    choices: tuple[str, ...] = ()


class Entry(NamedTuple):
    """One parameter of a tree: its dotted path, description and value."""

    path: str
    par: Par
    value: Any


def is_set(value: object) -> bool:
    """True for a parameter set (a NamedTuple with fields)."""
    return isinstance(value, tuple) and hasattr(value, "_fields")


def entries(tree: Any, prefix: str = "") -> Iterator[Entry]:
    """All parameters of a (nested) parameter set, in order, with dotted paths."""
    hints = get_type_hints(type(tree), include_extras=True)
    for name in tree._fields:
        value = getattr(tree, name)
        path = f"{prefix}{name}"
        if is_set(value):
            yield from entries(value, f"{path}.")
            continue
        for note in getattr(hints[name], "__metadata__", ()):
            if isinstance(note, Par):
                yield Entry(path, note, value)


def replaced(tree: Any, path: str, value: Any) -> Any:
    """A copy of `tree` with the parameter at the dotted `path` set to `value`."""
    name, _, rest = path.partition(".")
    if rest:
        value = replaced(getattr(tree, name), rest, value)
    return tree._replace(**{name: value})


def value_at(tree: Any, path: str) -> Any:
    """The value at the dotted `path` of `tree`."""
    for name in path.split("."):
        tree = getattr(tree, name)
    return tree


def changed(tree: Any, changes: Mapping[str, Any]) -> Any:
    """A copy of `tree` with the values of `changes`, dotted path to value, and with what is
    derived from them.

    A tree may have a method ``derived() -> tuple[(path, rule), ...]``; ``rule(tree)`` gives
    the value that belongs there, and no rule depends on a later one. Only what followed its
    rule before, and is not among `changes`, follows it now.
    """
    new = tree
    for path, value in changes.items():
        new = replaced(new, path, value)
    for path, rule in getattr(tree, "derived", tuple)():
        if path not in changes and value_at(tree, path) == rule(tree):
            value = rule(new)
            new = replaced(new, path, type(value_at(tree, path))(value))
    return new
