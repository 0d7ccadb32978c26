"""Parts of other packages in the settings of a machine: which a table names, and what joins."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from macromicro import place
from macromicro.errors import InputError
from macromicro.plant import own_part
from macromicro.plant.own_part import BRISTLES
from macromicro.plant.rubbing import FrictionPart
from macromicro.schema.text import printable
from macromicro.uncertainty.table import Uncertain, read

SET, PART, OWN = "friction", "part", "own"  # a set of settings, and its fields


def named(tree: Any, table: Mapping[str, object], where: str) -> dict[str, Any]:
    """What joins settings by the part that a table names.

    Parameters
    ----------
    tree : Any
        Settings of a machine of one stage.
    table : Mapping[str, object]
        Of a file; paths dotted or nested.
    where : str
        The file, for messages.

    Returns
    -------
    dict[str, Any]
        Path to value: the part's name and its default parameters; empty where none joins.

    Raises
    ------
    InputError
        There is no such part, or it is counted in other units.
    """
    rubbing = getattr(tree, SET, None)
    if not hasattr(rubbing, PART):
        return {}
    inner = table.get(SET)
    name = inner.get(PART) if isinstance(inner, Mapping) else table.get(f"{SET}.{PART}")
    if not isinstance(name, str) or name in (BRISTLES, getattr(rubbing, PART)):
        return {}  # what is no text is refused where the table is read
    there = f"{where}, {SET}.{PART}"
    part = own_part.find(name, there)
    if part.place != place.of(tree):
        units = part.place.base, place.of(tree).base
        raise InputError(there, f"{printable(name)}, in {units[0]}", f"a part in {units[1]} here")
    return {f"{SET}.{PART}": name, f"{SET}.{OWN}": part.settings()}


def of(tree: Any) -> FrictionPart | None:
    """The part that settings choose.

    Parameters
    ----------
    tree : Any
        Settings of a machine of one stage.

    Returns
    -------
    FrictionPart | None
        None for those of this package.
    """
    name = getattr(getattr(tree, SET, None), PART, BRISTLES)
    return None if name == BRISTLES else own_part.find(name, f"{SET}.{PART}")


def plain(tree: Any) -> bool:
    """Whether a part that settings choose is plain Python.

    Parameters
    ----------
    tree : Any
        Settings of a machine of one stage.

    Returns
    -------
    bool
        False for kernels, and for the parts of this package.
    """
    part = of(tree)
    return part is not None and not own_part.compiles(part)


def digests(tree: Any) -> Iterator[tuple[str, str]]:
    """What stands for the parts that settings choose: an edit makes another digest.

    Parameters
    ----------
    tree : Any
        Settings of a machine of one stage.

    Yields
    ------
    tuple[str, str]
        Name of a part, and its digest.
    """
    if of(tree) is not None:
        name = getattr(tree, SET).part
        yield f"part {name}", own_part.digest(name)


def uncertain(tree: Any, rows: tuple[Uncertain, ...]) -> tuple[Uncertain, ...]:
    """What is not known about a machine, with what is not known about its own part.

    Parameters
    ----------
    tree : Any
        Settings of a machine of one stage.
    rows : tuple[Uncertain, ...]
        Of the machine's table.

    Returns
    -------
    tuple[Uncertain, ...]
        Under a part of another package without the rows of the friction that it replaces, and with
        those of its own table.
    """
    part = of(tree)
    if part is None:
        return rows
    before = f"{SET}.{OWN}."
    kept = [r for r in rows if not all(path.startswith(f"{SET}.") for path, _ in r.parts)]
    for row in read(part.spread) if part.spread is not None else ():
        parts = tuple((before + path.removeprefix(before), weight) for path, weight in row.parts)
        kept.append(row._replace(parts=parts))
    return tuple(kept)
