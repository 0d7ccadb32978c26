"""Docstrings as reStructuredText: parameters with their units, examples, letters and bars."""

from __future__ import annotations

import re
from typing import get_type_hints

from macromicro.schema.par import NO_UNIT, Par, is_set


def fields(kind: type) -> list[str]:
    """Lines of reStructuredText: the parameters of a set with default, unit and meaning."""
    lines = []
    for name, hint in get_type_hints(kind, include_extras=True).items():
        par = next((n for n in getattr(hint, "__metadata__", ()) if isinstance(n, Par)), None)
        default = getattr(kind, "_field_defaults", {}).get(name)
        if par is None or is_set(default):
            continue
        value = "" if default is None else f" = {par.spoken(default)}"
        unit = f" [{par.unit}]" if par.unit not in NO_UNIT and default is None else ""
        lines += [f"``{name}``{value}{unit}", f"    {par.meaning} ({par.source})", ""]
    return ["", ".. rubric:: Parameters", "", *lines] if lines else []


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
