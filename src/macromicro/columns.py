"""Columns of a recording follow from types: a field that is annotated with a `Quantity` is one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, get_type_hints

import numpy as np
import numpy.typing as npt

from macromicro.kernel import kernel
from macromicro.place import LENGTH, Place


class Column(NamedTuple):
    """One column: its name, unit ("-" if none), meaning and numpy dtype (f4, f8, i1 ... u8)."""

    name: str
    unit: str
    meaning: str
    dtype: str = "f8"


class Quantity(NamedTuple):
    """Annotation of a field that is recorded.

    Attributes
    ----------
    unit, meaning : str
        The column's; unit "1" if there is none.
    dtype : str
        Numpy dtype of the column.
    column : str
        Name of the column, where it is not the field's.
    scale : float
        Column = scale * field: a field in m may be recorded in um.
    """

    unit: str
    meaning: str
    dtype: str = "f8"
    column: str = ""
    scale: float = 1.0


class Part(NamedTuple):
    """Where the fields of one type go in a row.

    Attributes
    ----------
    rows : ndarray, shape (fields,)
        Row of each field; -1: not recorded.
    scales : ndarray, shape (fields,)
        Column per field.
    """

    rows: npt.NDArray[np.int64]
    scales: npt.NDArray[np.float64]


class Layout(NamedTuple):
    """The columns of one period's values, and where each type's fields go in them.

    Attributes
    ----------
    columns : tuple[Column, ...]
        Of all types, in order.
    parts : tuple[Part, ...]
        One per type.
    """

    columns: tuple[Column, ...]
    parts: tuple[Part, ...]


def quantities(kind: Any, place: Place = LENGTH) -> dict[str, Quantity]:
    """The recorded fields of a ``NamedTuple`` class.

    Parameters
    ----------
    kind : Any
        The class.
    place : Place, optional
        What the places of the stage that they are of are counted in.

    Returns
    -------
    dict[str, Quantity]
        Each with its annotation, in the fields' order.
    """
    hints = get_type_hints(kind, include_extras=True)
    found = {}
    for field in kind._fields:
        for note in getattr(hints[field], "__metadata__", ()):
            if isinstance(note, Quantity):
                found[field] = place.column(note._replace(column=note.column or field))
    return found


def layout(*kinds: Any, place: Place = LENGTH) -> Layout:
    """The columns that follow from types, in their order and that of their fields.

    Parameters
    ----------
    *kinds : type
        ``NamedTuple`` classes; their fields that are annotated with a `Quantity` are recorded.
    place : Place, optional
        What the places of the stage that they are of are counted in.

    Returns
    -------
    Layout
        With one part for each type.

    Raises
    ------
    ValueError
        Two fields have one column.
    """
    columns: list[Column] = []
    parts = []
    for kind in kinds:
        known = quantities(kind, place)
        rows, scales = [], []
        for note in map(known.get, kind._fields):
            rows.append(len(columns) if note else -1)
            scales.append(note.scale if note else 1.0)
            if note:
                columns.append(Column(note.column, note.unit, note.meaning, note.dtype))
        parts.append(Part(np.array(rows, np.int64), np.array(scales)))
    names = [c.name for c in columns]
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise ValueError(f"columns of two fields: {', '.join(sorted(twice))}")
    return Layout(tuple(columns), tuple(parts))


@kernel
def put(
    out: npt.NDArray[np.float64],
    k: int,
    values: Any,
    rows: npt.NDArray[np.int64],
    scales: npt.NDArray[np.float64],
) -> None:
    """Write what is recorded of one value into a block.

    Parameters
    ----------
    out : ndarray, shape (rows, periods)
        The block.
    k : int
        Column of the block.
    values : Any
        A ``NamedTuple`` of floats.
    rows, scales : ndarray, shape (fields,)
        Those of the type's `Part`.
    """
    for j in range(len(values)):
        if rows[j] >= 0:
            out[rows[j], k] = scales[j] * values[j]


def whole(block: npt.NDArray[np.float64], columns: Sequence[Column]) -> npt.NDArray[np.float64]:
    """A block with -1 for what is no number in columns of whole numbers.

    Parameters
    ----------
    block : ndarray, shape (columns, rows)
        Changed in place.
    columns : Sequence[Column]
        What it holds.

    Returns
    -------
    ndarray, shape (columns, rows)
        `block` itself.
    """
    for k, column in enumerate(columns):
        if not column.dtype.startswith("f"):
            np.nan_to_num(block[k], copy=False, nan=-1.0, posinf=-1.0, neginf=-1.0)
    return block
