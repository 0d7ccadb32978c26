"""A tree of parameters from Python: values by path, changes with units, differences."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from macromicro.errors import InputError, ProblemError
from macromicro.schema import config
from macromicro.schema.keys import nearest
from macromicro.schema.par import entries, value_at
from macromicro.schema.text import printable

Tree = TypeVar("Tree")

_WHERE = "settings"
_SHOWN = 8  # changes that a line tells


def at(tree: Any, path: str) -> Any:
    """The value at a dotted path that a user wrote."""
    paths = [e.path for e in entries(tree)]
    sets = {p[:k] for p in paths for k, c in enumerate(p) if c == "."}
    if path not in sets and path not in paths:
        accepted = nearest(path, (*paths, *sorted(sets)), " (`macromicro config show` lists all)")
        raise ProblemError(
            f"{_WHERE}, {printable(path) or 'path'}", "unknown key", f"Accepted: {accepted}."
        )
    return value_at(tree, path)


def change(tree: Tree, changes: str | Mapping[str, object], value: object = None) -> Tree:
    """A tree with other values, written as in a settings file."""
    if isinstance(changes, str):
        if value is None:
            raise ProblemError(
                f"{_WHERE}, {printable(changes)}", "no value", "Give a path and its value."
            )
        changes = {changes: value}
    elif not isinstance(changes, Mapping) or value is not None:
        found = "a value beside a mapping" if isinstance(changes, Mapping) else printable(changes)
        raise InputError(_WHERE, found, "a path and its value, or a mapping of paths to values")
    return config.overridden(tree, _plain(changes), _WHERE)


def _plain(value: Any) -> Any:
    """A Python value as TOML would hold it: arrays and tuples as lists, keys as text."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):  # of numpy
        value = value.tolist()
    return list(value) if isinstance(value, tuple) else value


def describe_changes(tree: Any, default: Any) -> str:
    """The differences of a tree from another, on a line."""
    known = {e.path: e for e in entries(default)}
    differs = config.difference(tree, default)
    words = [
        f"{e.path} = {e.par.spoken(e.value)}"
        + (f" (default {e.par.spoken(known[e.path].value)})" if e.path in known else "")
        for e in entries(tree)
        if e.path in differs
    ]
    if len(words) > _SHOWN:
        words[_SHOWN:] = [f"{len(words) - _SHOWN} more"]
    return "; ".join(words) or "the defaults"
