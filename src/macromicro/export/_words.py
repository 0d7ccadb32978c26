"""Meanings and units of numbers, from annotations."""

from __future__ import annotations

from functools import cache
from typing import Any, get_args, get_origin

from macromicro.columns import Meaning, meaning
from macromicro.export._sources import Source
from macromicro.export.kinds import hints_of


@cache
def fields(kind: Any) -> dict[str, Meaning]:
    """Meanings of the fields of a ``NamedTuple`` class; units as stored."""
    hints = hints_of(kind, noted=True)
    return {name: meaning(hints.get(name)) for name in kind._fields}


def results(source: Source) -> list[Meaning]:
    """Meanings of each part of a kernel's result."""
    hint = source.hints.get("return")
    parts = get_args(hint) if get_origin(hint) is tuple else (hint,)
    return [meaning(part) for part in parts]


def said(note: Meaning) -> str:
    """Meaning and unit in words."""
    unit = "" if note.unit in ("1", "-") else note.unit
    return plain(", ".join(filter(None, (note.meaning, unit))))


def plain(words: str) -> str:
    """Text without mark-up that ends no C comment."""
    return words.replace("`", "").replace("*/", "* /").strip().rstrip(".")
