"""Parts of other packages in the settings of a machine."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from macromicro import place
from macromicro.errors import ProblemError
from macromicro.plant import own_part
from macromicro.plant.own_part import BRISTLES
from macromicro.plant.rubbing import FrictionPart
from macromicro.schema.text import printable
from macromicro.uncertainty.table import Uncertain, read

SET, PART, OWN = "friction", "part", "own"  # a set of settings, and its fields


def named(tree: Any, table: Mapping[str, object], where: str) -> dict[str, Any]:
    """The settings of the part that a table names."""
    rubbing = getattr(tree, SET, None)
    if not hasattr(rubbing, PART):
        return {}
    inner = table.get(SET)
    name = inner.get(PART) if isinstance(inner, Mapping) else table.get(f"{SET}.{PART}")
    if not isinstance(name, str) or name in (BRISTLES, getattr(rubbing, PART)):
        return {}  # the reader of the table refuses what is no text
    there = f"{where}, {SET}.{PART}"
    part = own_part.find(name, there)
    if part.place != place.of(tree):
        units = part.place.base, place.of(tree).base
        problem = f"the part {printable(name)} is in {units[0]}"
        raise ProblemError(there, problem, f"Choose a part in {units[1]}.")
    return {f"{SET}.{PART}": name, f"{SET}.{OWN}": part.settings()}


def of(tree: Any) -> FrictionPart | None:
    name = getattr(getattr(tree, SET, None), PART, BRISTLES)
    return None if name == BRISTLES else own_part.find(name, f"{SET}.{PART}")


def plain(tree: Any) -> bool:
    """Whether the chosen part is plain Python."""
    part = of(tree)
    return part is not None and not own_part.compiles(part)


def digests(tree: Any) -> Iterator[tuple[str, str]]:
    """Digests of the chosen parts."""
    if of(tree) is not None:
        name = getattr(tree, SET).part
        yield f"part {name}", own_part.digest(name)


def uncertain(tree: Any, rows: tuple[Uncertain, ...]) -> tuple[Uncertain, ...]:
    """Uncertain settings of a machine, with those of its part."""
    part = of(tree)
    if part is None:
        return rows
    before = f"{SET}.{OWN}."
    kept = [r for r in rows if not all(path.startswith(f"{SET}.") for path, _ in r.parts)]
    for row in read(part.spread) if part.spread is not None else ():
        parts = tuple((before + path.removeprefix(before), weight) for path, weight in row.parts)
        kept.append(row._replace(parts=parts))
    return tuple(kept)
