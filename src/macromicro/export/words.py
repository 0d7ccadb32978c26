"""Comments of the exported C: what docstrings, `Par` and `Quantity` say, with units."""

from __future__ import annotations

import ast
import inspect
import re
import textwrap
from functools import cache
from typing import Any, get_type_hints

from macromicro.columns import Quantity
from macromicro.export.sources import Doc, Source
from macromicro.schema.par import Par
from macromicro.units import convert

WIDTH = 96
# Units that a recording shows in place of these, by the factor between them.
_BASE = ("m", "m/s", "s", "V", "rad", "1", "A", "degC")


@cache
def fields(kind: Any) -> dict[str, str]:
    """Words for each field of a ``NamedTuple`` class: meaning and unit as it is stored."""
    try:
        hints = get_type_hints(kind, include_extras=True)
    except (NameError, TypeError):
        hints = {}
    told = Doc(inspect.getdoc(kind) or "").attributes
    beside = _beside(kind)
    found = {}
    for name in kind._fields:
        words = told.get(name) or beside.get(name, "")
        for note in getattr(hints.get(name), "__metadata__", ()):
            if isinstance(note, Par):
                words = f"{note.meaning}, {note.unit}" if note.unit else note.meaning
            elif isinstance(note, Quantity):
                unit = base(note)
                words = note.meaning if unit in ("1", "") else f"{note.meaning}, {unit}"
        found[name] = plain(words)
    return found


def base(note: Quantity) -> str:
    """Unit of a recorded field as it is stored, not as it is shown."""
    if note.scale == 1.0:
        return note.unit
    for unit in _BASE:
        try:
            if abs(convert(1.0, unit, note.unit) - note.scale) < 1e-9 * abs(note.scale):
                return unit
        except (ValueError, KeyError, TypeError):
            continue
    return f"{note.unit} / {note.scale:g}"


def _beside(kind: Any) -> dict[str, str]:
    """Comments beside the fields of a class."""
    try:
        text = textwrap.dedent(inspect.getsource(kind))
    except (OSError, TypeError):
        return {}
    lines, found = text.splitlines(), {}
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            _, mark, words = lines[(node.end_lineno or 1) - 1].partition("  # ")
            if mark:
                found[node.target.id] = words
    return found


def plain(words: str) -> str:
    """Words that end no comment and carry no mark-up."""
    return words.replace("``", "").replace("`", "").replace("*/", "* /").strip().rstrip(".")


def summary(kind: Any) -> str:
    """First words of a class' docstring."""
    return plain(Doc(inspect.getdoc(kind) or "").summary.split("\n\n")[0].replace("\n", " "))


def comment(text: str, indent: str = "") -> list[str]:
    """A comment of one line or several."""
    lines = [
        line
        for part in re.sub(r"(?<=[^\n])\n(?=[a-z(])(?!\w+: )", " ", text).splitlines()
        for line in (textwrap.wrap(part, WIDTH - 3, subsequent_indent="  ") or [""])
    ]
    if len(lines) == 1:
        return [f"{indent}/* {lines[0]} */"]
    return [f"{indent}/* {lines[0]}", *(f"{indent} * {line}".rstrip() for line in lines[1:]),
            f"{indent} */"]  # fmt: skip


def of_function(source: Source, parameters: list[str], result: list[str]) -> list[str]:
    """The comment above a function: its docstring."""
    doc = source.doc
    text = [plain(doc.summary)] if doc.summary else []
    told = [f"{n}: {_lower(doc.parameters[n])}" for n in parameters if doc.parameters.get(n)]
    if told:
        text += ["", *told]
    given = list(doc.returns.values())
    if len(given) == len(result) and len(result) > 1:
        pairs = zip(result, given, strict=True)
        text += ["Returns " + "; ".join(f"{n}: {_lower(w)}" for n, w in pairs)]
    elif given and given[0]:
        text += [f"Returns {_lower(given[0])}"]
    return comment("\n".join(text)) if text else []


def _lower(words: str) -> str:
    found = plain(words)
    # Not "V", "K" or "D/A".
    return found[0].lower() + found[1:] if found[1:2].islower() and len(found) > 3 else found
