"""Columns of a recording: every field annotated with a `Quantity`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, get_type_hints

import numpy as np
import numpy.typing as npt

from macromicro.errors import ProblemError
from macromicro.kernel import kernel
from macromicro.place import LENGTH, Place
from macromicro.schema.par import Par
from macromicro.units import convert

# Units that a recording shows in place of these, by the factor between them.
_BASE = ("m", "m/s", "s", "V", "rad", "1", "A", "degC")


class Column(NamedTuple):
    """One column: its name, unit ("-" if none), meaning and numpy dtype (f4, f8, i1 ... u8).

    Examples
    --------
    >>> from macromicro.columns import Column
    >>> Column("motor", "V", "voltage of the motor")
    Column(name='motor', unit='V', meaning='voltage of the motor', dtype='f8')
    """

    name: str
    unit: str
    meaning: str
    dtype: str = "f8"


class Quantity(NamedTuple):
    """Annotation of a field that is recorded.

    Examples
    --------
    >>> from typing import Annotated, NamedTuple
    >>> from macromicro.columns import Quantity, layout
    >>> class Reading(NamedTuple):
    ...     hall: Annotated[float, Quantity("mm", "Hall sensor", column="hall_position", scale=1e3)]
    >>> layout(Reading).columns
    (Column(name='hall_position', unit='mm', meaning='Hall sensor', dtype='f8'),)
    """

    unit: str  #: of the column; "1" if there is none
    meaning: str  #: of the column
    dtype: str = "f8"  #: numpy dtype of the column
    column: str = ""  #: name of the column, where it is not the field's
    scale: float = 1.0  #: column = scale * field: a field in m may be recorded in um


class Meaning(NamedTuple):
    """Annotation of a value that is not recorded: exported code and reference pages show it.

    Examples
    --------
    >>> from typing import Annotated, NamedTuple
    >>> from macromicro.columns import Meaning
    >>> class Spring(NamedTuple):
    ...     stiffness: Annotated[float, Meaning("of the spring", "N/m")]
    >>> Spring(2000.0)
    Spring(stiffness=2000.0)
    """

    meaning: str = ""
    unit: str = ""
    name: str = ""  #: of a part of the tuple that a kernel returns


def meaning(hint: Any) -> Meaning:
    """What an annotation says of a value beside its type, with the unit in which it is stored.

    Parameters
    ----------
    hint : Any
        Of a field or a parameter, such as ``Annotated[float, Quantity("um", "error", scale=1e6)]``.

    Returns
    -------
    Meaning
        Empty where no `Meaning`, `Par` or `Quantity` stands there.

    Examples
    --------
    >>> from typing import Annotated
    >>> from macromicro.columns import Quantity, meaning
    >>> meaning(Annotated[float, Quantity("um", "error", scale=1e6)])
    Meaning(meaning='error', unit='m', name='')
    """
    for note in getattr(hint, "__metadata__", ()):
        if isinstance(note, Meaning):
            return note
        if isinstance(note, Par):
            return Meaning(note.meaning, note.unit)
        if isinstance(note, Quantity):
            unit = _stored(note)
            return Meaning(note.meaning, "" if unit == "1" else unit)
    return Meaning()


def _stored(note: Quantity) -> str:
    """Stored unit of a recorded field."""
    if note.scale == 1.0:
        return note.unit
    for unit in _BASE:
        try:
            if abs(convert(1.0, unit, note.unit) - note.scale) < 1e-9 * abs(note.scale):
                return unit
        except (ValueError, KeyError, TypeError):
            continue
    return f"{note.unit} / {note.scale:g}"


class Part(NamedTuple):
    """Where the fields of one type go in a row."""

    rows: npt.NDArray[np.int64]  #: row of each field; -1: not recorded
    scales: npt.NDArray[np.float64]  #: column per field


class Layout(NamedTuple):
    """The columns of one period's values, and where each type's fields go in them."""

    columns: tuple[Column, ...]  #: of all types, in order
    parts: tuple[Part, ...]  #: one per type


def quantities(kind: Any, place: Place = LENGTH) -> dict[str, Quantity]:
    """The recorded fields of a ``NamedTuple`` class.

    Parameters
    ----------
    kind : Any
        The class.
    place : Place, optional
        Unit of the stage's positions.

    Returns
    -------
    dict[str, Quantity]
        Each with its annotation, in the fields' order.

    Examples
    --------
    >>> from typing import Annotated, NamedTuple
    >>> from macromicro.columns import Quantity, quantities
    >>> class Reading(NamedTuple):
    ...     force: Annotated[float, Quantity("N", "of the motor")]
    ...     count: int  # not recorded
    >>> {name: each.unit for name, each in quantities(Reading).items()}
    {'force': 'N'}
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
        Unit of the stage's positions.

    Returns
    -------
    Layout
        With one part for each type.

    Raises
    ------
    ProblemError
        Two fields have one column.

    Examples
    --------
    >>> from typing import Annotated, NamedTuple
    >>> from macromicro.columns import Quantity, layout
    >>> class Reading(NamedTuple):
    ...     count: int  # not recorded
    ...     force: Annotated[float, Quantity("N", "of the motor")]
    >>> layout(Reading).parts[0].rows.tolist()
    [-1, 0]
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
        raise ProblemError("columns", f"two fields have {', '.join(sorted(twice))}", "Rename one.")
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

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.columns import put
    >>> block = np.zeros((2, 3))  # two columns, three periods
    >>> put(block, 1, (0.004, 7.0), rows=np.array([0, 1]), scales=np.array([1e3, 1.0]))
    >>> block[:, 1].tolist()
    [4.0, 7.0]
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

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.columns import Column, whole
    >>> whole(np.array([[3.0, np.nan]]), [Column("move", "-", "index of the move", "i4")]).tolist()
    [[3.0, -1.0]]
    """
    for k, column in enumerate(columns):
        if not column.dtype.startswith("f"):
            np.nan_to_num(block[k], copy=False, nan=-1.0, posinf=-1.0, neginf=-1.0)
    return block
