"""Comments of the exported C, from annotations, with units."""

from __future__ import annotations

import inspect
import re
import textwrap
from functools import cache
from typing import Any, get_args, get_origin

from macromicro.columns import Meaning, meaning
from macromicro.export._sources import Source
from macromicro.export.kinds import hints_of

WIDTH = 96


@cache
def fields(kind: Any) -> dict[str, Meaning]:
    """Meanings of the fields of a ``NamedTuple`` class; units as stored."""
    hints = hints_of(kind, noted=True)
    return {name: meaning(hints.get(name)) for name in kind._fields}


def said(note: Meaning) -> str:
    """Meaning and unit in words."""
    return plain(", ".join(filter(None, (note.meaning, note.unit))))


def plain(words: str) -> str:
    """Text without mark-up that ends no C comment."""
    return words.replace("``", "").replace("`", "").replace("*/", "* /").strip().rstrip(".")


def summary(kind: Any) -> str:
    """First paragraph of a class' docstring."""
    return plain((inspect.getdoc(kind) or "").partition("\n\n")[0].replace("\n", " "))


def comment(text: str, indent: str = "") -> list[str]:
    lines = [
        line
        for part in re.sub(r"(?<=[^\n])\n(?=[a-z(])(?!\w+: )", " ", text).splitlines()
        for line in (textwrap.wrap(part, WIDTH - 3, subsequent_indent="  ") or [""])
    ]
    if len(lines) == 1:
        return [f"{indent}/* {lines[0]} */"]
    return [f"{indent}/* {lines[0]}", *(f"{indent} * {line}".rstrip() for line in lines[1:]),
            f"{indent} */"]  # fmt: skip


def results(source: Source) -> list[Meaning]:
    """Meanings of each part of a kernel's result."""
    hint = source.hints.get("return")
    parts = get_args(hint) if get_origin(hint) is tuple else (hint,)
    return [meaning(part) for part in parts]


def of_function(source: Source, parameters: list[str], result: list[str]) -> list[str]:
    """The comment above a function: purpose, numbers and result."""
    text = [plain(source.summary)] if source.summary else []
    hints = source.hints
    about = {name: said(meaning(hints.get(name))) for name in parameters}
    told = [f"{name}: {words}" for name, words in about.items() if words]
    if told:
        text += ["", *told]
    given = [said(note) for note in results(source)]
    if len(given) == len(result) and len(result) > 1 and any(given):
        pairs = zip(result, given, strict=True)
        text += ["Returns " + "; ".join(f"{n}: {w}" if w else n for n, w in pairs)]
    elif len(given) == 1 and given[0]:
        text += [f"Returns {given[0]}"]
    return comment("\n".join(text)) if text else []
