"""Docstrings as reStructuredText: parameters with their units, examples, letters and bars."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, get_type_hints

from macromicro.columns import meaning
from macromicro.schema.par import NO_UNIT, Par, is_set


def fields(kind: type, comments: Mapping[str, str] = MappingProxyType({})) -> list[str]:
    """Lines of reStructuredText: the fields of a class with default, unit and meaning.

    What their annotations do not say, the comments beside them (`#:`) do.
    """
    lines = []
    for name, hint in _hints(kind).items():
        default = getattr(kind, "_field_defaults", {}).get(name)
        found, value = meaning(hint), ""
        words, unit = found.meaning or comments.get(name, ""), found.unit
        for par in getattr(hint, "__metadata__", ()):
            if isinstance(par, Par) and not is_set(default):
                words = f"{par.meaning} ({par.source})"
                value = "" if default is None else f" = {par.spoken(default)}"
                unit = par.unit if par.unit not in NO_UNIT and default is None else ""
        if words or unit:
            lines += [
                f"``{name}``{value}{f' [{unit}]' if unit else ''}",
                escaped(f"    {words}"),
                "",
            ]
    return ["", ".. rubric:: Fields", "", *lines] if lines else []


def _hints(kind: type) -> dict[str, Any]:
    """Annotations, as they are written where a name in them is for type checkers only."""
    try:
        return get_type_hints(kind, include_extras=True)
    except NameError:
        return dict(kind.__annotations__)


def literal(lines: list[str]) -> list[str]:
    """Indented examples of a module's docstring, marked as code."""
    text = "\n".join(lines)
    return re.sub(r"(?m)^(\S.*[^:])(:?)\n\n(?=    \S)", r"\1\2\n\n::\n\n", text).split("\n")


def escaped(line: str) -> str:
    """A line as reStructuredText means it: "V." is no number of a list, |v| no substitution."""
    if "``" in line:
        return line
    line = re.sub(r"^(\s*)(\w{1,4}\.)$", r"\1\\\2", line)
    line = re.sub(r"(`[\w.]+`)(?=\w)", r"\1\\ ", line)
    return re.sub(r"(?<! )\||\|(?! )", r"\\|", line)
