"""MAT files up to version 7: vectors, matrices, structs, Simulink outputs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from macromicro.errors import ProblemError
from macromicro.files._gathered import Gathered
from macromicro.files.naming import BESIDE, units_in
from macromicro.files.table import Table
from macromicro.schema.text import printable

_DEEPEST = 8


def table(path: Path, where: str, accepted: str) -> Table:
    """Vectors of a MAT file; struct fields as "struct.field"."""
    from scipy.io import loadmat

    try:
        content = loadmat(path, struct_as_record=False, squeeze_me=False)
    except Exception as error:  # whatever a damaged file does to the reader
        text = "the file cannot be read: " + printable(error, 80)
        raise ProblemError(where, text, "Give a MAT file as MATLAB's `save` writes it.") from None
    found = Gathered()
    for name in [n for n in content if not n.startswith("__")]:
        _walk(found, name, content.pop(name), 0)
    return told(found, where, accepted)


def told(found: Gathered, where: str, accepted: str) -> Table:
    if not found.columns:
        raise ProblemError(where, "no variable is a vector of numbers", f"Name {accepted}.")
    units, reasons = units_in(list(found.columns))
    for name, unit in found.units.items():
        units[name], reasons[name] = unit, BESIDE
    return Table(where, found.columns, units, found.constants, reasons)


def _walk(found: Gathered, name: str, value: Any, depth: int) -> None:
    """Add a variable, structs field by field."""
    if not isinstance(value, np.ndarray) or value.dtype.kind != "O":
        if hasattr(value, "_fieldnames"):
            _walk(found, name, np.array([value], dtype=object), depth)
        else:
            found.add(name, value)
        return
    items = [item for item in value.ravel() if hasattr(item, "_fieldnames")]
    for k, item in enumerate(items if depth < _DEEPEST else []):
        own = name if len(items) == 1 else f"{name}{k + 1}"
        values = getattr(item, "values", None)
        if values is not None and "values" in item._fieldnames:  # of Simulink
            label = words(getattr(item, "label", "")) or own
            _walk(found, label, values, depth + 1)
            continue
        for field in item._fieldnames:
            inner = getattr(item, field)
            if field == "signals":
                _walk(found, f"{own}.signals", inner, depth + 1)
            else:
                _walk(found, f"{own}.{field}", inner, depth + 1)


def words(value: Any) -> str:
    """A MATLAB text."""
    values = np.asarray(value)
    if values.dtype.kind == "U" and values.size:
        return str(values.ravel()[0]).strip()
    if values.dtype.kind == "u" and values.size:
        return "".join(map(chr, values.ravel())).strip("\0 ")
    return ""
