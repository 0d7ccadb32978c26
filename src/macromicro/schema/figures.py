"""Figures of other data sheets, which a set of parameters turns into its own.

A set may have two methods. ``figures()`` are the keys that it accepts beside its own, each with its
`Par`. ``of_figures(given, where)`` are the values of its own parameters that follow from those of a
file; it raises `ProblemError` if one is missing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from macromicro.errors import ProblemError
from macromicro.schema.par import Entry, is_set


def entries(tree: Any) -> dict[str, Entry]:
    """Every such key of a tree by its path."""
    return {
        f"{prefix}{name}": Entry(f"{prefix}{name}", par, math.nan)
        for prefix, each in _sets(tree)
        for name, par in each.figures().items()
    }


def resolve_figures(tree: Any, changes: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Changes with the parameters that follow in place of figures."""
    left = dict(changes)
    for prefix, each in _sets(tree):
        keys = [f"{prefix}{name}" for name in each.figures() if f"{prefix}{name}" in left]
        if not keys:
            continue
        given = {key.removeprefix(prefix): left.pop(key) for key in keys}
        place = f"{where}, {prefix.removesuffix('.')}"
        for name, value in each.of_figures(given, place).items():
            if f"{prefix}{name}" in left:
                problem = f"set, and it also follows from {', '.join(given)}"
                raise ProblemError(f"{where}, {prefix}{name}", problem, "Give one of them.")
            left[f"{prefix}{name}"] = value
    return left


def _sets(tree: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name in tree._fields:
        each = getattr(tree, name)
        if is_set(each):
            if hasattr(each, "figures"):
                yield f"{prefix}{name}.", each
            yield from _sets(each, f"{prefix}{name}.")
