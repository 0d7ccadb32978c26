"""Tables of first-order curves on disk: HDF5 with the raw curves, or CSV.

HDF5: datasets `values` (n, n) and `inputs` (n,), attributes `format`, `lo`, `step`, `f_low`,
`kind`, `shape`, `smooth`, `between`, `input_unit`, `output_unit`, raw curves `raw/0000`, ..., shape
(m, 2). CSV: Figure 5.8 with the inputs m_j in the first row, M_i in the first column, f_{M,m}
between, empty for m > M; a comment line with these attributes above.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import numpy.typing as npt

from macromicro.errors import InputError, ProblemError
from macromicro.hysteresis.table import MOST_NODES, FodTable
from macromicro.schema.text import printable, read_text, write_text

FORMAT = "macromicro first-order curves 1"
_WHAT = "a table of first-order curves (.h5, .hdf5 or .csv)"
_UNITS = ("input_unit", "output_unit")
_ATTRIBUTES = ("lo", "step", "f_low", "kind", "shape", "smooth", "between", *_UNITS)
_LATER = {"between": "input", **dict.fromkeys(_UNITS, "")}  # in files written before there were any


def save_table(table: FodTable, path: str | Path) -> None:
    """Write a table to a file.

    Parameters
    ----------
    table : FodTable
        What is written.
    path : str | Path
        .h5 or .hdf5 (exact, with raw curves) or .csv (values only).

    Raises
    ------
    InputError
        Another ending.
    ProblemError
        The file cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from macromicro.hysteresis import FodTable, from_density
    >>> from macromicro.hysteresis.table_files import load_table, save_table
    >>> table = FodTable.from_everett(from_density([[1.0, 0.0], [1.0, 1.0]], lo=0.0, step=5.0, n=3))
    >>> with TemporaryDirectory() as folder:
    ...     save_table(table, f"{folder}/curves.h5")
    ...     load_table(f"{folder}/curves.h5").hi
    10.0
    """
    file = Path(path)
    ending = _ending(file)
    try:
        if ending == ".csv":
            write_text(file, _csv_text(table))
        else:
            _write_hdf5(table, file)
    except OSError as error:
        problem = f"the file cannot be written: {error.strerror or error}"
        raise ProblemError(printable(file, 300), problem, "Choose another place.") from None


def load_table(path: str | Path) -> FodTable:
    r"""Read what `save_table` wrote, or a CSV table in its layout made elsewhere.

    Parameters
    ----------
    path : str | Path
        .h5, .hdf5 or .csv.

    Returns
    -------
    FodTable
        Without raw curves if from CSV.

    Raises
    ------
    InputError
        Names the file, the line of a CSV, and the error.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from macromicro.hysteresis.table_files import load_table
    >>> with TemporaryDirectory() as folder:
    ...     text = "M,0,5,10\n0,0,,\n5,0,3,\n10,0,6,8\n"  # heading and first column in V, else um
    ...     written = Path(folder, "curves.csv").write_text(text)
    ...     load_table(Path(folder, "curves.csv")).major_loop[2].tolist()  # the falling branch
    [0.0, 6.0, 8.0]
    """
    file = Path(path)
    return _read_csv(file) if _ending(file) == ".csv" else _read_hdf5(file)


def is_table(path: str | Path) -> bool:
    """Whether a file is one that `save_table` wrote.

    Parameters
    ----------
    path : str | Path
        Any file.

    Returns
    -------
    bool
        False for a file that is not there, too.

    Examples
    --------
    >>> from macromicro.hysteresis.table_files import is_table
    >>> is_table("nowhere.h5")
    False
    """
    file = Path(path)
    if not file.is_file():
        return False
    with file.open("rb") as opened:
        begin = opened.read(len(FORMAT) + 2)
    if not begin.startswith(b"\x89HDF"):
        return begin == f"# {FORMAT}".encode()
    import h5py

    try:
        with h5py.File(file, "r") as store:
            return bool(store.attrs.get("format") == FORMAT)
    except OSError:
        return False


def _ending(file: Path) -> str:
    ending = file.suffix.lower()
    if ending not in (".h5", ".hdf5", ".csv"):
        raise InputError(printable(file, 300), ending, _WHAT)
    return ending


def _write_hdf5(table: FodTable, file: Path) -> None:
    import h5py

    with h5py.File(file, "w") as store:
        store.attrs["format"] = FORMAT
        for name in _ATTRIBUTES:
            store.attrs[name] = getattr(table, name)
        store["values"] = table.values
        store["inputs"] = table.grid
        for k, (u, f) in enumerate(table.raw):
            store[f"raw/{k:04d}"] = np.stack([u, f], axis=1)


def _read_hdf5(file: Path) -> FodTable:
    import h5py

    where = printable(file, 300)
    if not file.is_file():
        raise ProblemError(where, "no such file", f"Name {_WHAT}.")
    try:
        with h5py.File(file, "r") as store:
            said = store.attrs.get("format", "no format")
            if said != FORMAT:
                raise InputError(f"{where}, format", printable(said), FORMAT)
            raw = [
                np.asarray(store["raw"][name], dtype=np.float64) for name in store.get("raw", ())
            ]
            kept = {**_LATER, **{n: store.attrs[n] for n in _ATTRIBUTES if n in store.attrs}}
            if missing := [n for n in _ATTRIBUTES if n not in kept]:
                raise KeyError(f"no attribute {missing[0]}")
            values = np.asarray(store["values"], dtype=np.float64)
    except (OSError, KeyError, TypeError, ValueError) as error:
        problem = f"the file cannot be read: {printable(error, 120)}"
        raise ProblemError(where, problem, f"Name {_WHAT}.") from None
    if any(points.ndim != 2 or points.shape[1] != 2 for points in raw):
        remedy = "Save the table again."
        raise ProblemError(f"{where}, raw", "a curve has another shape than (m, 2)", remedy)
    return FodTable(
        float(kept["lo"]),
        float(kept["step"]),
        np.ascontiguousarray(values),
        float(kept["f_low"]),
        kept["kind"],
        tuple((points[:, 0].copy(), points[:, 1].copy()) for points in raw),
        kept["shape"],
        float(kept["smooth"]),
        kept["between"],
        kept["input_unit"],
        kept["output_unit"],
    )


def _csv_text(table: FodTable) -> str:
    settings = ",".join(f"{name}={getattr(table, name)}" for name in _ATTRIBUTES)
    lines = [f"# {FORMAT},{settings}"]
    grid = table.grid.tolist()
    lines.append(",".join(["M\\m", *map(repr, grid)]))
    for i, row in enumerate(table.first_order.tolist()):
        cells = [repr(f) for f in row[: i + 1]] + [""] * (table.n - 1 - i)
        lines.append(",".join([repr(grid[i]), *cells]))
    return "\n".join(lines) + "\n"


def _read_csv(file: Path) -> FodTable:
    where = printable(file, 300)
    lines = read_text(file, _WHAT).splitlines()
    settings: dict[str, str] = {}
    while lines and lines[0].startswith("#"):
        for part in lines.pop(0).lstrip("#").split(","):
            name, _, value = part.partition("=")
            settings[name.strip()] = value.strip()
    rows = [line.split(",") for line in lines if line.strip()]
    n = len(rows) - 1
    if not 2 <= n <= MOST_NODES or any(len(row) != n + 1 for row in rows):
        found = f"inputs and rows number {len(rows[0]) - 1 if rows else 0} and {max(n, 0)}"
        raise ProblemError(where, found, f"Give 2 to {MOST_NODES} inputs and as many full rows.")
    grid = _numbers(rows[0][1:], f"{where}, heading")
    step = float(grid[-1] - grid[0]) / (n - 1)
    first_order = np.full((n, n), np.nan)
    for i, row in enumerate(rows[1:]):
        line = f"{where}, row {i + 1}"
        first_order[i, : i + 1] = _numbers(row[1 : i + 2], line)
        if any(cell.strip() for cell in row[i + 2 :]):
            raise ProblemError(line, "there is a value for m > M", "Leave these cells empty.")
        if abs(_numbers(row[:1], line)[0] - grid[i]) > 1e-6 * abs(step):
            raise InputError(line, row[0], f"M = {grid[i]:g}, as in the heading")
    if not (step > 0.0 and np.all(np.abs(np.diff(grid) - step) < 1e-6 * step)):
        remedy = "Resample the table."
        raise ProblemError(f"{where}, inputs", "the inputs do not rise in equal steps", remedy)
    below = np.tri(n, k=-1, dtype=bool)
    values = np.where(below, np.diag(first_order)[:, None] - first_order, 0.0)
    return FodTable(
        _number(settings, "lo", float(grid[0])),
        _number(settings, "step", step),
        values,
        float(first_order[0, 0]),
        settings.get("kind", "descending"),  # type: ignore[arg-type]
        (),
        settings.get("shape", "free"),  # type: ignore[arg-type]
        _number(settings, "smooth", 0.0),
        settings.get("between", _LATER["between"]),  # type: ignore[arg-type]
        *(settings.get(name, "") for name in _UNITS),
    )


def _numbers(cells: list[str], where: str) -> npt.NDArray[np.float64]:
    for cell in cells:
        try:
            good = math.isfinite(float(cell))
        except ValueError:
            good = False
        if not good:
            raise InputError(where, printable(cell), "numbers")
    return np.array([float(cell) for cell in cells])


def _number(settings: dict[str, str], name: str, default: float) -> float:
    """A setting of the comment line, checked against the table."""
    try:
        value = float(settings[name])
    except (KeyError, ValueError):
        return default
    near = name == "smooth" or abs(value - default) <= 1e-6 * max(abs(value), abs(default))
    return value if near else default
