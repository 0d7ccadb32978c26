"""Recording: named columns with units and provenance, in memory or in an HDF5 file."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from macromicro import exported, traces
from macromicro.columns import Column
from macromicro.errors import InputError, ProblemError
from macromicro.recorder import Recorder, RecordingError, check_space
from macromicro.recording_format import (
    EVENT_BYTES,
    EVENTS,
    FORMAT,
    OWN_ATTRIBUTES,
    ROWS,
    Attribute,
    Block,
    Layout,
    Noted,
    as_block,
    needed_bytes,
    parse_notes,
)

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.figure import Figure

__all__ = [
    "Column",
    "Noted",
    "Recorder",
    "Recording",
    "RecordingError",
    "check_space",
    "needed_bytes",
]

_REMEDY = "Use a recording written by macromicro (.h5)."
_DAMAGE = (KeyError, TypeError, ValueError, AttributeError, OSError, RuntimeError)


class Recording:
    """What a run recorded: ``recording["motor"]`` is one column as an array.

    ``len(recording)`` is the number of rows. From a file, a column is read when first asked for,
    and the file is open only meanwhile. Make one with `load` or `from_arrays`.

    Parameters
    ----------
    columns : tuple[Column, ...]
        Names, units and meanings, `t` among them.
    rows : int
        Number of rows.
    dt : float
        Sample time, s.
    attributes : dict[str, Attribute]
        Provenance, such as seed and version.
    source : Path | dict[str, NDArray[Any]]
        The file, or arrays of shape (rows,) by column name.

    Examples
    --------
    >>> from macromicro.recording import Column, Recording
    >>> columns = [Column("t", "s", "time"), Column("motor", "V", "voltage of the motor")]
    >>> run = Recording.from_arrays(columns, [[0.0, 0.001], [1.5, 1.25]], 0.001, {"seed": 7})
    >>> run["motor"].tolist(), run.unit("motor"), len(run)
    ([1.5, 1.25], 'V', 2)
    """

    def __init__(
        self,
        columns: tuple[Column, ...],
        rows: int,
        dt: float,
        attributes: dict[str, Attribute],
        source: Path | dict[str, NDArray[Any]],
    ) -> None:
        self.columns = columns
        self.rows = rows
        self.dt = dt
        self.attributes = attributes
        self._path = source if isinstance(source, Path) else None
        self._arrays = {} if isinstance(source, Path) else source

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """The recording in a file, without the unused rows that a killed run leaves.

        Parameters
        ----------
        path : str | os.PathLike[str]
            A file that `Recorder` wrote, or is still writing.

        Returns
        -------
        Self
            The recording; its columns are read later.

        Raises
        ------
        ProblemError
            There is no such file, or it is not a recording, or it is damaged.
        """
        place = Path(path)
        with _opened(place) as file:
            try:
                found = {key: _plain(value) for key, value in file.attrs.items()}
                if found.get("format") != FORMAT:
                    raise ProblemError(str(place), "not a recording", _REMEDY)
                columns = tuple(_column(file[n]) for n in str(found["columns"]).split())
                rows = int(file[ROWS][()])
                lengths = [len(file[c.name]) for c in columns]
                dt = float(found["sample_time_s"])
            except _DAMAGE as error:
                raise ProblemError(str(place), f"damaged: {error}", _REMEDY) from error
        if not 0 <= rows <= min(lengths, default=-1):
            raise ProblemError(str(place), f"damaged: {rows} rows", _REMEDY)
        attributes = {
            key: value
            for key, value in found.items()
            if key not in OWN_ATTRIBUTES and isinstance(value, str | int | float)
        }
        return cls(columns, rows, dt, attributes, place.absolute())

    @classmethod
    def from_arrays(
        cls,
        columns: Sequence[Column],
        arrays: Block,
        dt: float,
        attributes: Mapping[str, Attribute],
    ) -> Self:
        """A recording in memory.

        Parameters
        ----------
        columns : Sequence[Column]
            Descriptions of the arrays, in order; one of them is `t`.
        arrays : Block
            One array of shape (rows,) per column, equally long; a matrix of shape (columns, rows)
            will do. Cast as `Recorder.append` does, and shared where they need no cast.
        dt : float
            Sample time, s.
        attributes : Mapping[str, Attribute]
            Provenance; text, whole numbers or floats.

        Returns
        -------
        Self
            The recording.

        Raises
        ------
        InputError
            Columns or attributes that no recording can hold, arrays of unequal lengths, or a value
            that its column cannot hold.
        """
        where = "recording"
        layout = Layout.checked(columns, dt, attributes, where)
        done = as_block(arrays, layout.columns, where)
        named = {c.name: array for c, array in zip(layout.columns, done, strict=True)}
        return cls(layout.columns, len(done[0]), layout.dt, layout.attributes, named)

    @property
    def events(self) -> tuple[Noted, ...]:
        """Events while it was made, with their origin, oldest first: orders of clients,
        changes of mode, faults, ends of motions. Empty for a recording without events, as
        those of `macromicro run`.

        Raises
        ------
        InputError
            The file is damaged.
        """
        if self._path is None:
            return ()
        with _opened(self._path) as file:
            if EVENTS not in file:
                return ()
            try:
                return parse_notes(file[EVENTS][: int(file[EVENT_BYTES][()])].tobytes())
            except _DAMAGE as error:
                raise ProblemError(str(self._path), f"damaged: {error}", _REMEDY) from error

    def __getitem__(self, name: str) -> NDArray[Any]:
        """The column `name`; InputError names the columns there are."""
        if name not in self._arrays:
            column = self._find(name)
            assert self._path is not None
            with _opened(self._path) as file:
                values = file[name][: self.rows] if name in file else np.empty(0)
            if len(values) != self.rows:
                problem = "the file has changed since it was loaded"
                raise ProblemError(str(self._path), problem, "Load it again.")
            self._arrays[name] = np.asarray(values, column.dtype)
        return self._arrays[name]

    def __contains__(self, name: object) -> bool:
        """True for the name of a column."""
        return any(c.name == name for c in self.columns)

    def __len__(self) -> int:
        return self.rows

    def unit(self, name: str) -> str:
        """Unit of a column.

        Parameters
        ----------
        name : str
            Name of the column.

        Returns
        -------
        str
            As text, "-" or "1" if it has none.

        Raises
        ------
        InputError
            There is no such column; names those there are.
        """
        return self._find(name).unit

    def save(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
        """Write this recording to a new file.

        Parameters
        ----------
        path : str | os.PathLike[str]
            The file, in a folder that exists.
        overwrite : bool, optional
            Whether an existing file may be replaced.

        Raises
        ------
        InputError
            The file exists, or the folder is unfit.
        RecordingError
            The file cannot be written.
        """
        arrays = [self[c.name] for c in self.columns]
        capacity = max(self.rows, 1)
        with Recorder(
            path, self.columns, capacity, self.dt, self.attributes, overwrite=overwrite
        ) as recorder:
            recorder.append(arrays)

    def to_xarray(self) -> xarray.Dataset:
        """An xarray Dataset with the coordinate `t`, units as attributes.

        Returns
        -------
        xarray.Dataset
            A variable of dimension `t` per column.

        Raises
        ------
        MacromicroError
            xarray is not installed; with the remedy.
        """
        return exported.as_xarray(self)

    def to_dataframe(self) -> pandas.DataFrame:
        """A pandas DataFrame with the index `t` in s.

        Returns
        -------
        pandas.DataFrame
            A column per column; ``attrs["units"]`` has the units by name.

        Raises
        ------
        MacromicroError
            pandas is not installed; with the remedy.
        """
        return exported.as_dataframe(self)

    def to_mat(self, path: str | os.PathLike[str]) -> None:
        """Write a MAT file (version 5) for MATLAB's `load`; docs/running.md.

        Parameters
        ----------
        path : str | os.PathLike[str]
            The file; an existing one is replaced.

        Raises
        ------
        InputError
            Columns that such a file cannot hold.
        """
        exported.as_mat(self, path)

    def part(self, start: float | None = None, end: float | None = None) -> Recording:
        """The rows of a span of time, in memory.

        Parameters
        ----------
        start, end : float | None, optional
            First and last time, s as in `t`; by default its own.

        Returns
        -------
        Recording
            With the same columns and attributes.

        Raises
        ------
        InputError
            No row lies within.
        """
        return exported.part(self, start, end)

    def plot(self, *columns: str) -> Figure:
        """Draw columns over time; those of one unit share a panel.

        Several recordings on top of each other: `macromicro.overlay`.

        Parameters
        ----------
        *columns : str
            Names; by default references, positions, laser and efforts.

        Returns
        -------
        Figure
            Of matplotlib, in no window: ``run.plot("laser").savefig("laser.svg")``.

        Raises
        ------
        InputError
            There is no such column; names those there are.
        """
        return traces.overlay(self, columns=columns)

    @property
    def label(self) -> str:
        """A short name: folder or file; in memory, programme and seed."""
        if self._path is None:
            return exported.origin(self) or "recording"
        return self._path.parent.name if self._path.stem == "recording" else self._path.stem

    def __repr__(self) -> str:
        """Rows, duration, programme and seed, columns with units."""
        return exported.describe(self, "" if self._path is None else str(self._path))

    def _find(self, name: str) -> Column:
        for column in self.columns:
            if column.name == name:
                return column
        where = str(self._path) if self._path else "recording"
        names = ", ".join(c.name for c in self.columns)
        raise InputError(f"{where}, column", name, names)


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    import h5py

    found = ""
    if path.is_dir():
        found = "a folder"
    elif not path.is_file():
        found = "no such file" if not path.exists() else "not a file"
    elif not os.access(path, os.R_OK):
        found = "not readable"
    elif not h5py.is_hdf5(path):
        found = "not a recording"
    if found:
        raise ProblemError(str(path), found, _REMEDY)
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise ProblemError(str(path), f"cannot be opened: {error}", _REMEDY) from error
    with file:
        yield file


def _column(dataset: Any) -> Column:
    unit, meaning = str(dataset.attrs["units"]), str(dataset.attrs["long_name"])
    return Column(dataset.name.lstrip("/"), unit, meaning, dataset.dtype.str[1:])


def _plain(value: Any) -> Any:
    """A numpy scalar as a plain Python number."""
    return value.item() if isinstance(value, np.generic) else value
