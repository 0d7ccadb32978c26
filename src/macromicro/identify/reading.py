"""Files that people have, as columns by name: recordings, CSV, MAT.

A column's unit stands in its name ("x_mm", "u [V]", "speed (mm/s)") or, in a recording,
beside it. `macromicro.identify.picking` finds the columns that a procedure needs.
"""

from __future__ import annotations

import csv
import io
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.recording import Recording
from macromicro.schema.text import printable, read_text

WHAT = "a recording (.h5), CSV with a heading, MAT (version 7 or older) or MicroMag file"
_HDF5, _MATLAB = b"\x89HDF\r\n\x1a\n", b"MATLAB 5.0 MAT-file"
_TEXTS = (".csv", ".txt", ".tsv", ".dat", "")
_BRACKETS = re.compile(r"(.+?)\s*[\[(](.*)[\])]")
_SUFFIXES = (re.compile(r"(.+?)_([^_]+_per_[^_]+)"), re.compile(r"(.+)_([^_]+)"))
_ENDINGS = {"C": "degC", "count": "counts", "counts": "counts"}


class Table(NamedTuple):
    """What a file holds.

    Attributes
    ----------
    file : str
        Name, for messages.
    columns : dict[str, Array]
        Shape (n,) by name; n may differ.
    units : dict[str, str]
        By name, "" where unknown.
    constants : dict[str, float]
        Scalars of a MAT file, numbers among a recording's attributes.
    """

    file: str
    columns: dict[str, Array]
    units: dict[str, str]
    constants: dict[str, float]


def is_forc(path: Path) -> bool:
    """Whether a file begins as the MicroMag format does.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    bool
        False where it cannot be read, too.
    """
    return _begin(path).startswith(b"MicroMag")


def read(path: Path) -> Table:
    """The columns of a recording, CSV or MAT file, recognised by content first, then by its name.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    Table
        Columns by name.

    Raises
    ------
    InputError
        Names file and line of what cannot be read.
    """
    begin, where = _begin(path), printable(path, 300)
    suffix = path.suffix.lower()
    if begin.startswith(_MATLAB) or suffix == ".mat":
        return _mat(path, where)
    if begin.startswith(_HDF5) or suffix in (".h5", ".hdf5"):
        return _recording(path, where)
    if suffix not in _TEXTS:
        raise InputError(where, f"{printable(suffix)}, a kind that is not known", WHAT)
    return _csv(path, where)


def _begin(path: Path) -> bytes:
    """The file's first bytes; nothing where it cannot be read, which reading it explains."""
    if not path.is_file():
        if path.is_dir():
            raise InputError(printable(path, 300), "a directory", f"files: {WHAT}")
        found = "not a file" if path.exists() else "no such file"
        raise InputError(printable(path, 300), found, WHAT)
    with path.open("rb") as file:
        return file.read(32)


def _recording(path: Path, where: str) -> Table:
    recording = Recording.load(path)
    names = [c.name for c in recording.columns if not c.name.startswith("true_")]
    columns = {n: np.asarray(recording[n], np.float64) for n in names}
    units = {n: {"1": "", "-": "", "count": "counts"}.get(u := recording.unit(n), u) for n in names}
    numbers = {k: float(v) for k, v in recording.attributes.items() if not isinstance(v, str)}
    return Table(where, columns, units, numbers)


def _mat(path: Path, where: str) -> Table:
    from scipy.io import loadmat

    try:
        content = loadmat(path)
    except Exception as error:  # whatever a damaged file does to the reader
        found = "cannot be read: " + printable(error, 80)
        raise InputError(where, found, "a MAT file saved with -v7 or older") from None
    columns, constants = {}, {}
    for name, value in content.items():
        good = isinstance(value, np.ndarray) and value.dtype.kind in "fiub" and value.size
        if not good or name.startswith("__"):
            continue
        if value.size == 1:
            constants[name] = float(value.ravel()[0])
        elif value.size == max(value.shape):
            columns[name] = value.ravel().astype(np.float64)
        else:
            for k in range(value.shape[1] if value.ndim == 2 else 0):
                columns[f"{name}{k + 1}"] = value[:, k].astype(np.float64)
    if not columns:
        raise InputError(where, "no variable that is a vector of numbers", WHAT)
    return Table(where, columns, {n: parted(n)[1] for n in columns}, constants)


def _csv(path: Path, where: str) -> Table:
    lines = read_text(path, WHAT).splitlines()
    kept = [(k, text) for k, text in enumerate(lines, 1) if text.strip() and text[0] != "#"]
    if not kept:
        raise InputError(where, "nothing but comments", WHAT)
    mark = max(",;\t", key=kept[0][1].count)
    rows = [next(csv.reader(io.StringIO(text), delimiter=mark)) for _, text in kept]
    names = [cell.strip() for cell in rows[0]]
    if all(_number(cell, mark) is not None for cell in names):
        raise InputError(
            f"{where}, line {kept[0][0]}",
            "numbers",
            "a heading with the columns' names, such as t_s,u_V,x_mm",
        )
    if len(set(names)) < len(names) or "" in names:
        twice = next((n for n in names if names.count(n) > 1), "")
        found = f"{printable(twice)!r} twice" if twice else "a column without a name"
        raise InputError(f"{where}, heading", found, "a name of its own for each column")
    block = np.empty((len(rows) - 1, len(names)))
    for k, (row, (line, _)) in enumerate(zip(rows[1:], kept[1:], strict=True)):
        if len(row) != len(names):
            found = f"{len(row)} cells"
            raise InputError(f"{where}, line {line}", found, f"{len(names)}, as in the heading")
        for j, cell in enumerate(row):
            value = _number(cell, mark)
            if value is None:
                place = f"{where}, line {line}, {printable(names[j])}"
                raise InputError(place, printable(cell), "a number, nan, or nothing")
            block[k, j] = value
    columns = {n: block[:, j].copy() for j, n in enumerate(names)}
    return Table(where, columns, {n: parted(n)[1] for n in names}, {})


def _number(cell: str, mark: str) -> float | None:
    """A cell as a number, NaN if empty, None if it is none; 1,5 where no comma parts cells."""
    text = cell.strip() if mark == "," else cell.strip().replace(",", ".")
    try:
        return float(text or "nan")
    except ValueError:
        return None


def parted(name: str) -> tuple[str, str]:
    """A column's name as name and unit.

    Parameters
    ----------
    name : str
        "x_mm" or "x [mm]".

    Returns
    -------
    name : str
        "x".
    unit : str
        "mm"; "" if it names none.
    """
    if match := _BRACKETS.fullmatch(name.strip()):
        return match[1].strip(), match[2].strip()
    for suffix in _SUFFIXES:
        if match := suffix.fullmatch(name.strip()):
            unit = _ENDINGS.get(match[2], match[2].replace("_per_", "/"))
            if _known(unit):
                return match[1], unit
    return name.strip(), ""


def _known(unit: str) -> bool:
    from macromicro.units import convert

    try:
        convert(1.0, unit, unit)
    except ValueError:
        return False
    return True
