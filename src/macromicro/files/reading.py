"""Any measured file as a table; its format is recognised by content, then by name."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from macromicro.errors import ProblemError
from macromicro.files.table import Columns, Table
from macromicro.recording import Recording
from macromicro.recording_format import FORMAT
from macromicro.schema.text import printable

WHAT = "a recording or other HDF5 file, text of columns, MAT, npz, Parquet, JSON or TDMS file"
_HDF5, _MATLAB, _MATLAB_HDF5 = b"\x89HDF\r\n\x1a\n", b"MATLAB", b"MATLAB 7.3"
_HDF5_NAMES = (".h5", ".hdf5")
_PARQUET = b"PAR1"
_TEXTS = (".csv", ".txt", ".tsv", ".dat", ".lvm", ".asc", ".log", ".prn", ".data", ".xy", "")
_JSON = (".json", ".jsonl", ".ndjson")
_OBJECTS = re.compile(rb'(?:\xef\xbb\xbf)?\s*\[?\s*\{\s*"')  # a list of objects, or an object
_UNITS = {"1": "", "-": "", "count": "counts"}


def is_forc(path: Path) -> bool:
    """Whether a file begins like the MicroMag format."""
    return _begin(path).lstrip(b'\xef\xbb\xbf" ').startswith(b"MicroMag")


def read_table(path: Path) -> Table:
    begin, where, suffix = _begin(path), printable(path, 300), path.suffix.lower()
    if is_recording(path):
        return _recording(path, where)
    if begin.startswith((_HDF5, _MATLAB_HDF5)) or suffix in _HDF5_NAMES:
        kind = "hdf5"
    elif begin.startswith(_MATLAB) or suffix == ".mat":
        kind = "matlab"
    elif begin.startswith(_PARQUET) or suffix == ".parquet":
        kind = "parquet"
    elif suffix in (".npz", ".npy"):
        kind = "numpy"
    elif begin.startswith(b"TDSm") or suffix == ".tdms":
        kind = "tdms"
    elif suffix in _JSON or _OBJECTS.match(begin):
        kind = "json"
    elif suffix in _TEXTS:
        from macromicro.files import _text

        return _text.table(path, where)
    else:
        raise ProblemError(where, f"the format {printable(suffix)} is not known", f"Name {WHAT}.")
    from macromicro.files import _containers

    made: Table = getattr(_containers, f"{kind}_table")(path, where, WHAT)
    return made


def is_recording(path: Path) -> bool:
    """Whether `Recording.load` handles a file; it says what is wrong with a damaged one."""
    begin = _begin(path)
    named = path.suffix.lower() in _HDF5_NAMES and not begin.startswith(_MATLAB_HDF5)
    if not (begin.startswith(_HDF5) or named):
        return False
    import h5py

    try:
        with h5py.File(path, "r") as file:
            return bool(file.attrs.get("format") == FORMAT)
    except OSError:
        return True


def _begin(path: Path) -> bytes:
    """The file's first bytes; InputError without a file."""
    if not path.is_file():
        if path.is_dir():
            raise ProblemError(printable(path, 300), "this is a directory", f"Name a file: {WHAT}.")
        found = "this is not a file" if path.exists() else "no such file"
        raise ProblemError(printable(path, 300), found, f"Name {WHAT}.")
    with path.open("rb") as file:
        return file.read(32)


def _recording(path: Path, where: str) -> Table:
    recording = Recording.load(path)
    names = [c.name for c in recording.columns if not c.name.startswith("true_")]
    columns = Columns(
        names, lambda wanted: {n: np.asarray(recording[n], np.float64) for n in wanted}
    )
    units = {n: _UNITS.get(u := recording.unit(n), u) for n in names}
    numbers = {k: float(v) for k, v in recording.attributes.items() if not isinstance(v, str)}
    reasons = {n: "the recording's" for n, unit in units.items() if unit}
    return Table(where, columns, units, numbers, reasons)
