"""MAT, HDF5, npz, Parquet, JSON and TDMS files as columns: vectors by name, matrices by column."""

from __future__ import annotations

import json
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import ProblemError
from macromicro.extras import require
from macromicro.files.naming import BESIDE, DATES, spell_unit, units_in
from macromicro.files.table import Columns, Table
from macromicro.schema.text import printable

_WIDEST = 64  # columns of a matrix; wider ones are no records
_DEEPEST = 8
_UNITS = ("units", "unit", "Units", "Unit", "UNITS")


class OwnTimesWarning(UserWarning):
    """Columns of a file have times of their own."""


class Gathered:
    """Columns, constants and units of a file."""

    def __init__(self) -> None:
        self.columns: dict[str, Array] = {}
        self.constants: dict[str, float] = {}
        self.units: dict[str, str] = {}
        self.dates: list[str] = []

    def add(self, name: str, value: Any, unit: str = "", rows: int = 0) -> None:
        """Add an array of numbers, times or truth values, one dimension of `rows`, if given."""
        values = np.asarray(value)
        if values.dtype.kind in "mM":
            values = values.astype("datetime64[ns]" if values.dtype.kind == "M" else "m8[ns]")
            values, unit = (values - values.ravel()[:1]).astype(np.int64) * 1e-9, "s"
        if values.dtype.names:
            for field in values.dtype.names:
                self.add(f"{name}.{field}" if name else field, values[field])
            return
        if values.dtype.kind not in "fiub" or not values.size:
            return
        if rows > 1 and rows in values.shape and values.size > rows:
            values = np.moveaxis(values, values.shape.index(rows), 0).reshape(rows, -1)
        if values.size == 1:
            self.constants[name] = float(values.ravel()[0])
        elif values.size == max(values.shape):
            self._put(name, values.ravel(), unit)
        elif values.ndim == 2 and min(values.shape) <= _WIDEST:
            tall = values.shape[0] >= values.shape[1] or values.shape[1] < 3 or rows > 1
            block = values if tall else values.T
            for k in range(block.shape[1]):
                self._put(f"{name}{k + 1}", block[:, k], unit)

    def _put(self, name: str, values: Any, unit: str) -> None:
        self.columns[name] = np.ascontiguousarray(values, dtype=np.float64)
        if unit:
            self.units[name] = unit

    def texts(self, name: str, values: Sequence[Any]) -> None:
        """Add dates or times of day; other words are no column."""
        from macromicro.files._layout import TIME, kind
        from macromicro.files._times import seconds

        if all(kind(str(value).strip()) == TIME for value in values if value is not None):
            self.columns[name] = seconds(values, printable(name))
            self.dates.append(name)

    def table(self, where: str, accepted: str) -> Table:
        if not self.columns:
            raise ProblemError(where, "no variable is a vector of numbers", f"Name {accepted}.")
        units, reasons = units_in(list(self.columns))
        for name, unit in self.units.items():
            units[name], reasons[name] = unit, BESIDE
        for name in self.dates:
            units[name], reasons[name] = "s", DATES
        return Table(where, self.columns, units, self.constants, reasons)


def unreadable(where: str, error: object, remedy: str) -> ProblemError:
    return ProblemError(where, "the file cannot be read: " + printable(error, 80), remedy)


# --- MAT up to version 7


def matlab_table(path: Path, where: str, accepted: str) -> Table:
    """Vectors of a MAT file; struct fields as "struct.field", timeseries by their names."""
    from scipy.io import loadmat

    try:
        content = loadmat(path, struct_as_record=False, squeeze_me=False)
    except Exception as error:  # whatever a damaged file does to the reader
        raise unreadable(where, error, "Give a MAT file as MATLAB's `save` writes it.") from None
    found = Gathered()
    opaque = any(type(value).__name__ == "MatlabOpaque" for value in content.values())
    for name in [n for n in content if not n.startswith("__")]:
        _walk(found, name, content.pop(name), 0)
    if opaque and not found.columns:
        raise ProblemError(
            where,
            "it holds objects of MATLAB (timeseries, table, Dataset), which only MATLAB can read",
            "In MATLAB, save vectors: t = ts.Time; x = ts.Data; save('own.mat', 't', 'x').",
        )
    _compare_times(where, found.columns)
    return found.table(where, accepted)


def _walk(found: Gathered, name: str, value: Any, depth: int) -> None:
    """Add a variable, structs field by field."""
    if hasattr(value, "_fieldnames"):
        items = [value]
    elif isinstance(value, np.ndarray) and value.dtype.kind == "O":
        items = [item for item in value.ravel() if hasattr(item, "_fieldnames")]
        # A cell array of structs, as the elements of a Dataset, is an array of arrays.
        arrays = [item for item in value.ravel() if isinstance(item, np.ndarray)]
        cells = [item for item in arrays if item.dtype.kind == "O"]
        for k, item in enumerate(cells if depth < _DEEPEST else []):
            _walk(found, name if len(cells) == 1 else f"{name}{k + 1}", item, depth + 1)
    else:
        found.add(name, value)
        return
    for k, item in enumerate(items if depth < _DEEPEST else []):
        own = name if len(items) == 1 else f"{name}{k + 1}"
        fields = {field: getattr(item, field) for field in item._fieldnames}
        label = words(fields.get("label", "")) or words(fields.get("Name", ""))
        if "Time" in fields and "Data" in fields:  # a timeseries
            label, unit = label or own, _timeseries_unit(fields.get("DataInfo"))
            found.add(
                f"{label}.Time", fields["Time"], _timeseries_unit(fields.get("TimeInfo")) or "s"
            )
            found.add(label, fields["Data"], unit, np.size(fields["Time"]))
        elif "values" in fields:  # a signal of Simulink
            _walk(found, label or own, fields["values"], depth + 1)
        elif "Values" in fields and label:  # an element of a Dataset
            _walk(found, label, fields["Values"], depth + 1)
        else:
            for field, inner in fields.items():
                _walk(found, f"{own}.{field}", inner, depth + 1)


def _timeseries_unit(info: Any) -> str:
    """The unit in a timeseries' information."""
    item = next(iter(np.ravel(info)), None) if info is not None else None
    return spell_unit(words(getattr(item, "Units", "")))


def _compare_times(where: str, columns: dict[str, Array]) -> None:
    """Warn of timeseries whose times differ."""
    times = [name for name in columns if name.endswith(".Time")]
    for name in times[1:]:
        if not np.array_equal(columns[name], columns[times[0]]):
            own = name.removesuffix(".Time")
            text = f"{where}: {own} has times of its own, {name}; others have {times[0]}"
            warnings.warn(text, OwnTimesWarning, stacklevel=2)


def words(value: Any) -> str:
    """A MATLAB text."""
    values = np.asarray(value)
    if values.dtype.kind == "U" and values.size:
        return str(values.ravel()[0]).strip()
    if values.dtype.kind == "u" and values.size:
        return "".join(map(chr, values.ravel())).strip("\0 ")
    return ""


# --- NumPy and Parquet


def numpy_table(path: Path, where: str, accepted: str) -> Table:
    found = Gathered()
    try:
        content = np.load(path, allow_pickle=False)
        named = {"": content} if isinstance(content, np.ndarray) else content
        for name in named:
            found.add(name, named[name])
    except Exception as error:  # whatever a damaged file does to the reader
        text = "Give arrays of numbers, without pickled objects."
        raise unreadable(where, error, text) from None
    return found.table(where, accepted)


def parquet_table(path: Path, where: str, accepted: str) -> Table:
    require(where, "pyarrow", "sweep")
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        schema = pq.read_schema(path)
    except (OSError, pa.ArrowInvalid) as error:
        raise unreadable(where, error, "Give a Parquet file.") from None
    names, times = [], []
    for field in schema:
        number = pa.types.is_integer(field.type) or pa.types.is_floating(field.type)
        timed = pa.types.is_timestamp(field.type) or pa.types.is_duration(field.type)
        if number or timed or pa.types.is_boolean(field.type):
            names.append(field.name)
            times += [field.name] if timed else []
    if not names:
        raise ProblemError(where, "the file has no column of numbers", f"Name {accepted}.")
    units, reasons = units_in(names)
    for name in names:
        beside = {k.decode().lower(): v for k, v in (schema.field(name).metadata or {}).items()}
        said = beside.get("units", beside.get("unit", b"")).decode("utf-8", "replace")
        if unit := spell_unit(said):
            units[name], reasons[name] = unit, BESIDE
        if name in times:
            units[name], reasons[name] = "s", DATES

    def fetch(wanted: Sequence[str]) -> dict[str, Array]:
        made = {}
        for name in wanted:  # one after the other, so that each is held once
            made[name] = _values(pq.read_table(path, columns=[name])[name], name in times)
        return made

    return Table(where, Columns(names, fetch), units, {}, reasons)


def _values(column: Any, timed: bool) -> Array:
    """A column as floats, NaN for null; times in s since the first."""
    import pyarrow as pa

    if timed:
        stamps = np.asarray(column.to_numpy())
        if stamps.dtype.kind == "M":
            stamps = stamps - stamps[:1]
        return np.asarray(stamps / np.timedelta64(1, "s"), dtype=np.float64)
    return np.asarray(column.cast(pa.float64(), safe=False).to_numpy(), dtype=np.float64)


# --- JSON


def json_table(path: Path, where: str, accepted: str) -> Table:
    """Rows as a list of objects, or one a line; columns as an object of lists."""
    text = path.read_bytes().decode("utf-8-sig", "replace")
    try:
        try:
            content = json.loads(text)
        except json.JSONDecodeError:
            content = [json.loads(line) for line in text.splitlines() if line.strip()]
    except (ValueError, RecursionError) as error:
        text = "Give a list of objects, one object a line, or an object of lists."
        raise unreadable(where, error, text) from None
    found = Gathered()
    _unfold(found, "", content, 0)
    said = content.get("units", {}) if isinstance(content, dict) else {}
    for name, unit in (said if isinstance(said, dict) else {}).items():
        if name in found.columns and spell_unit(str(unit)):
            found.units[name] = spell_unit(str(unit))
    return found.table(where, accepted)


def _unfold(found: Gathered, name: str, value: Any, depth: int) -> None:
    """Add what stands in a JSON file, objects field by field."""
    if isinstance(value, dict):
        for key, inner in value.items() if depth < _DEEPEST else ():
            _unfold(found, f"{name}.{key}" if name else key, inner, depth + 1)
    elif isinstance(value, list) and value and all(isinstance(row, dict) for row in value):
        keys = dict.fromkeys(key for row in value for key in row)
        columns = {key: [row.get(key) for row in value] for key in keys}
        for key, column in columns.items():  # objects in rows: their fields in turn
            held = [{} if cell is None else cell for cell in column]
            inner = held if any(isinstance(cell, dict) and cell for cell in held) else column
            _unfold(found, f"{name}.{key}" if name else key, inner, depth + 1)
    elif isinstance(value, list) and any(isinstance(cell, str) for cell in value):
        if all(cell is None or isinstance(cell, str) for cell in value):
            found.texts(name, value)
    elif isinstance(value, list | int | float):
        try:
            found.add(name, np.array(value, dtype=np.float64))  # None is NaN
        except (ValueError, TypeError):  # of unequal lengths, or of words
            return


# --- TDMS


def tdms_table(path: Path, where: str, accepted: str) -> Table:
    """Channels of a LabVIEW file as "group.channel", with the times of its waveforms."""
    require(where, "nptdms", "tdms")
    from nptdms import TdmsFile

    found = Gathered()
    try:
        content = TdmsFile.read(path)
        for group in content.groups():
            timed = False
            for channel in group.channels():
                name, values = f"{group.name}.{channel.name}", channel[:]
                rows, step = len(values), channel.properties.get("wf_increment", 0.0)
                if step and rows > 1 and not timed:
                    first, timed = channel.properties.get("wf_start_offset", 0.0), True
                    found.add(f"{group.name}.time", first + step * np.arange(rows), "s")
                said = (str(channel.properties.get(key, "")) for key in ("unit_string", *_UNITS))
                found.add(name, values, next(filter(None, map(spell_unit, said)), ""))
    except Exception as error:  # whatever a damaged file does to the reader
        raise unreadable(where, error, "Give a TDMS file as LabVIEW writes it.") from None
    return found.table(where, accepted)


_MOST = 5000  # datasets


def hdf5_table(path: Path, where: str, accepted: str) -> Table:
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
                        said[column] = spell_unit(unit)
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
