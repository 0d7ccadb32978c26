"""Any measured file as a table; its format is recognised by content, then by name."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from macromicro.errors import ProblemError
from macromicro.files.table import Columns, Table
from macromicro.recording import Recording
from macromicro.schema.text import printable

WHAT = "a recording or other HDF5 file, text of columns, MAT, npz, Parquet or MicroMag file"
_HDF5, _MATLAB, _MATLAB_HDF5 = b"\x89HDF\r\n\x1a\n", b"MATLAB", b"MATLAB 7.3"
_PARQUET = b"PAR1"
_TEXTS = (".csv", ".txt", ".tsv", ".dat", ".lvm", ".asc", ".log", ".prn", ".data", ".xy", "")
_UNITS = {"1": "", "-": "", "count": "counts"}


def is_forc(path: Path) -> bool:
    """Whether a file begins like the MicroMag format."""
    return _begin(path).lstrip(b'\xef\xbb\xbf" ').startswith(b"MicroMag")


def read(path: Path) -> Table:
    begin, where, suffix = _begin(path), printable(path, 300), path.suffix.lower()
    if begin.startswith(_HDF5) or suffix in (".h5", ".hdf5") or begin.startswith(_MATLAB_HDF5):
        return _hdf5(path, where, begin)
    if begin.startswith(_MATLAB) or suffix == ".mat":
        from macromicro.files import _matlab

        return _matlab.table(path, where, WHAT)
    if begin.startswith(_PARQUET) or suffix in (".parquet", ".npz", ".npy"):
        from macromicro.files import _archives

        inner = _archives.parquet_table if suffix not in (".npz", ".npy") else _archives.numpy_table
        return inner(path, where, WHAT)
    if suffix not in _TEXTS:
        raise ProblemError(where, f"the format {printable(suffix)} is not known", f"Name {WHAT}.")
    from macromicro.files import _delimited

    return _delimited.table(path, where)


def _hdf5(path: Path, where: str, begin: bytes) -> Table:
    """A recording, or another program's HDF5 file."""
    from macromicro.files import _hdf5 as hdf5

    if not begin.startswith(_MATLAB_HDF5) and hdf5.is_recording(path):
        return _recording(path, where)
    return hdf5.table(path, where, WHAT)


def _begin(path: Path) -> bytes:
    """The file's first bytes; InputError without a file."""
    if not path.is_file():
        if path.is_dir():
            raise ProblemError(printable(path, 300), "this is a directory", f"Name a file: {WHAT}.")
        found = "this is no file" if path.exists() else "no such file"
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
