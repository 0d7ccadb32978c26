"""HDF5 files other than recordings: plain ones, and MAT files of version 7.3."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import ProblemError
from macromicro.files._containers import words
from macromicro.files.naming import BESIDE, spelled, units_in
from macromicro.files.table import Columns, Table
from macromicro.schema.text import printable

_UNITS = ("units", "unit", "Units", "Unit", "UNITS")
_MOST = 5000  # datasets


def table(path: Path, where: str, accepted: str) -> Table:
    """Datasets of an HDF5 file; within groups as "group.name"."""
    import h5py

    places: dict[str, tuple[str, int | str | None]] = {}
    said: dict[str, str] = {}
    constants: dict[str, float] = {}
    with h5py.File(path, "r") as file:
        found: list[Any] = []
        file.visititems(lambda _, item: found.append(item) if len(found) < _MOST else None)
        matlab = any("MATLAB_class" in item.attrs for item in found)
        for item in found:
            if not isinstance(item, h5py.Dataset) or item.name.startswith("/#"):
                continue
            name = item.name.strip("/").replace("/", ".")
            for own, dataset in _targets(file, name, item):
                _note(own, dataset, matlab, places, constants)
                unit = next((u for key in _UNITS if (u := _text(dataset.attrs.get(key)))), "")
                for column in places:
                    if unit and column not in said and places[column][0] == dataset.name:
                        said[column] = spelled(unit)
    if not places:
        raise ProblemError(where, "no dataset is a vector of numbers", f"Name {accepted}.")
    units, reasons = units_in(list(places))
    for name, unit in said.items():
        if unit:
            units[name], reasons[name] = unit, BESIDE

    def fetch(names: Sequence[str]) -> dict[str, Array]:
        with h5py.File(path, "r") as file:
            return {name: _column(file, *places[name]) for name in names}

    return Table(where, Columns(places, fetch), units, constants, reasons)


def _targets(file: Any, name: str, item: Any) -> list[tuple[str, Any]]:
    """A dataset, or those that it references (values and labels of a struct array)."""
    import h5py

    if h5py.check_ref_dtype(item.dtype) is None:
        if name.endswith(".signals.values") and (parent := item.parent):
            label = words(parent["label"][()]) if "label" in parent else ""
            return [(label or name, item)]
        if name.endswith(".Data") and "Time" in item.parent:  # of a timeseries
            name = name.removesuffix(".Data")
        return [(name, item)]
    refs = [ref for ref in np.asarray(item).ravel() if ref]
    labels = [""] * len(refs)
    if name.endswith(".values") and "label" in item.parent:
        labels = [words(file[r][()]) for r in np.asarray(item.parent["label"]).ravel()]
    stem = name.removesuffix(".values")
    targets = [file[ref] for ref in refs]
    return [
        (label or f"{stem}{k + 1}", target)
        for k, (label, target) in enumerate(zip(labels, targets, strict=False))
        if isinstance(target, h5py.Dataset)
    ]


def _note(
    name: str,
    item: Any,
    matlab: bool,
    places: dict[str, tuple[str, int | str | None]],
    constants: dict[str, float],
) -> None:
    """Note the columns of a dataset; a scalar is a constant."""
    if item.dtype.names:
        places |= {
            f"{name}.{field}": (item.name, field)
            for field in item.dtype.names
            if item.dtype[field].kind in "fiub" and item.ndim == 1
        }
        return
    if item.dtype.kind not in "fiub" or not item.size or item.attrs.get("MATLAB_empty", 0):
        return
    if matlab and _text(item.attrs.get("MATLAB_class")) in ("char", "cell"):
        return
    if item.size == 1:
        constants[name] = float(np.asarray(item).ravel()[0])
    elif item.size == max(item.shape):
        places[name] = (item.name, None)
    elif item.ndim == 2 and min(item.shape) <= 64:
        places |= {f"{name}{k + 1}": (item.name, k) for k in range(min(item.shape))}


def _column(file: Any, place: str, part: int | str | None) -> Array:
    item = file[place]
    if isinstance(part, str):
        values = item[part]
    elif part is None:
        values = item[()]
    else:
        values = item[:, part] if item.shape[0] >= item.shape[1] else item[part, :]
    return np.ascontiguousarray(np.ravel(values), dtype=np.float64)


def _text(value: Any) -> str:
    if isinstance(value, np.ndarray) and value.size:
        value = value.ravel()[0]
    text = value.decode("utf-8", "replace") if isinstance(value, bytes) else value
    return printable(text) if isinstance(text, str) else ""
