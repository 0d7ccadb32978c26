"""Format of a recording's file: plain HDF5 that MATLAB and netCDF readers accept."""

from __future__ import annotations

import errno
import io
import json
import math
import os
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from macromicro import portable
from macromicro.columns import Column
from macromicro.errors import InputError, ProblemError

FORMAT = "macromicro recording 1"
ROWS = "rows"
EVENTS, EVENT_BYTES = "events", "event_bytes"
TIME = "t"
OWN_ATTRIBUTES = ("format", "sample_time_s", "columns")
Attribute = str | int | float
Block = NDArray[Any] | Sequence[NDArray[Any]]

_METADATA_BYTES = 1 << 20
_OWN_NAMES = (ROWS, EVENTS, EVENT_BYTES)


class Noted(NamedTuple):
    """Something that happened while a recording was made.

    Examples
    --------
    >>> from macromicro.recording import Noted
    >>> print(Noted(1.5, "fault", "", "overspeed", {"speed_mm_s": 310}).line().decode(), end="")
    {"t": 1.5, "kind": "fault", "who": "", "what": "overspeed", "facts": {"speed_mm_s": 310}}
    """

    t: float  #: when, s as in the recording's column `t`; NaN where that is not known
    kind: str  #: kind of event
    who: str  #: who caused it; "" for the machine
    what: str  #: what happened, in words
    facts: Mapping[str, Any]  #: details, by name

    def line(self) -> bytes:
        """As it stands in a file.

        Returns
        -------
        bytes
            A line of JSON, with its newline.
        """
        t = self.t if math.isfinite(self.t) else None
        return json.dumps({**self._asdict(), "t": t}, default=str).encode() + b"\n"


def parse_notes(text: bytes) -> tuple[Noted, ...]:
    return tuple(_parse_note(json.loads(line)) for line in text.splitlines())


def _parse_note(entry: dict[str, Any]) -> Noted:
    t = math.nan if entry["t"] is None else float(entry["t"])
    return Noted(t, str(entry["kind"]), str(entry["who"]), str(entry["what"]), entry["facts"])


def _columns(columns: Sequence[Column], where: str) -> tuple[Column, ...]:
    """`columns` with short dtypes, checked."""
    done: dict[str, Column] = {}
    for column in columns:
        place = f"{where}, column {column.name!r}"
        plain = column.name.isidentifier() and column.name.isascii()
        if not plain or column.name in _OWN_NAMES or column.name in done:
            raise InputError(place, "", f"unique names of letters, digits and _, not {ROWS!r}")
        for text in (column.unit, column.meaning):
            if not _is_text(text):
                raise InputError(place, text, "a unit and a meaning in plain text")
        try:
            kind = np.dtype(column.dtype)
        except (TypeError, ValueError):
            kind = np.dtype("O")
        if kind.kind not in "fiu" or kind.itemsize > 8 or kind == np.float16:
            raise InputError(f"{place}, dtype", column.dtype, "f4, f8, i1 to i8, u1 to u8")
        done[column.name] = column._replace(dtype=kind.str[1:])
    if TIME not in done:
        raise InputError(where, tuple(done), f"columns that include {TIME!r}")
    return tuple(done.values())


def _attributes(attributes: Mapping[str, Attribute], where: str) -> dict[str, Attribute]:
    """A copy of `attributes` with plain values, checked for HDF5."""
    done: dict[str, Attribute] = {}
    for key, value in attributes.items():
        place = f"{where}, attribute {key!r}"
        if not key.isprintable() or not key or key in OWN_ATTRIBUTES:
            raise InputError(place, "", f"a printable name, none of {', '.join(OWN_ATTRIBUTES)}")
        if isinstance(value, str) and _is_text(value):
            done[key] = str(value)
        elif isinstance(value, int | np.integer | np.bool_) and -(2**63) <= value < 2**63:
            done[key] = int(value)
        elif isinstance(value, float | np.floating):
            done[key] = float(value)
        else:
            raise InputError(place, value, "text without NUL, a 64-bit integer or a float")
    return done


def _is_text(text: str) -> bool:
    """Whether HDF5 can hold `text`: UTF-8 without NUL."""
    if "\0" in text:
        return False
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True


def as_column(values: Any, column: Column, where: str) -> NDArray[Any]:
    given = np.asarray(values)
    kind = np.dtype(column.dtype)
    if given.ndim != 1 or given.dtype.kind not in "fiub":
        found = f"it is {given.dtype} of shape {given.shape}"
        raise ProblemError(f"{where}, column {column.name!r}", found, "Give a row of numbers.")
    if given.dtype == kind:
        return np.ascontiguousarray(given)
    if kind.kind == "f":
        with np.errstate(over="ignore"):
            cast = given.astype(kind)
        bad = np.isinf(cast) & np.isfinite(given)
        accepted = f"numbers that fit {column.dtype}"
    else:
        limits = np.iinfo(kind)
        rounded = np.rint(given) if given.dtype.kind == "f" else given
        bad = ~((rounded >= limits.min) & (rounded < limits.max + 1))
        with np.errstate(invalid="ignore"):
            cast = rounded.astype(kind)
        accepted = f"whole numbers from {limits.min} to {limits.max}"
    if bad.any():
        row = int(np.argmax(bad))
        place = f"{where}, column {column.name!r}, row {row} of the block"
        raise InputError(place, given[row].item(), accepted)
    return cast


def as_block(arrays: Block, columns: Sequence[Column], where: str) -> list[NDArray[Any]]:
    if len(arrays) != len(columns):
        found = f"{len(arrays)} arrays were given for {len(columns)} columns"
        raise ProblemError(where, found, "Give one for each.")
    done = [as_column(a, c, where) for a, c in zip(arrays, columns, strict=True)]
    lengths = sorted({len(a) for a in done})
    if len(lengths) > 1:
        raise ProblemError(where, f"the columns have {lengths} rows", "Give as many in each.")
    return done


def needed_bytes(columns: Sequence[Column], capacity: int, events: int = 0) -> int:
    """Disk space of a recording, with a margin for the metadata.

    Parameters
    ----------
    columns : Sequence[Column]
        Whose types count.
    capacity : int
        Number of rows.
    events : int, optional
        Bytes of events.

    Returns
    -------
    int
        Bytes.

    Examples
    --------
    >>> from macromicro.recording import Column, needed_bytes
    >>> columns = [Column("t", "s", "time"), Column("motor", "V", "voltage of the motor", "f4")]
    >>> needed_bytes(columns, 60_000) - needed_bytes(columns, 0)  # a minute at 1 kHz
    720000
    """
    rows = capacity * sum(np.dtype(c.dtype).itemsize for c in columns)
    return rows + events + _METADATA_BYTES


class Places(NamedTuple):
    """Offsets in a recording's file."""

    rows: int  # offset of the number of rows, bytes
    columns: tuple[int, ...]  # offset of each column, bytes
    event_bytes: int = -1  # offset of the number of bytes of events; -1 where there are none
    events: int = -1  # offset of the events; -1 where there are none


class Layout(NamedTuple):
    """What stays the same when a file is laid out again."""

    columns: tuple[Column, ...]  # columns with dtypes in their short form
    dt: float  # sample time, s
    attributes: dict[str, Attribute]  # plain values that HDF5 can hold

    @classmethod
    def checked(
        cls,
        columns: Sequence[Column],
        dt: float,
        attributes: Mapping[str, Attribute],
        where: str,
    ) -> Self:
        if not (math.isfinite(dt) and dt > 0.0):
            raise InputError(f"{where}, sample time", dt, "a time above 0 s")
        return cls(_columns(columns, where), float(dt), _attributes(attributes, where))

    def write(self, fd: int, capacity: int, events: int | None = None) -> Places:
        """Lay out an empty open file and reserve its disk space."""
        import h5py

        _reserve(fd, needed_bytes(self.columns, capacity, events or 0))
        steady = _SteadyFile(fd)
        with h5py.File(steady, "w", libver=("earliest", "v108")) as file:
            file.attrs["format"] = FORMAT
            file.attrs["sample_time_s"] = self.dt
            file.attrs["columns"] = " ".join(c.name for c in self.columns)
            for key, value in self.attributes.items():
                file.attrs[key] = value
            places = self._write_datasets(file, capacity, events)
        if steady.error:
            raise steady.error
        os.ftruncate(fd, steady.end)
        _reserve(fd, steady.end)
        return places

    def _write_datasets(self, file: Any, capacity: int, events: int | None) -> Places:
        import h5py

        plan = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        plan.set_layout(h5py.h5d.CONTIGUOUS)
        plan.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
        plan.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
        plan.set_obj_track_times(False)  # the same run gives the same file
        space = h5py.h5s.create_simple((capacity,))
        count = file.create_dataset(ROWS, data=np.int64(0))
        count.attrs["long_name"] = "rows recorded; what columns hold beyond them is unused"
        made = []
        for column in self.columns:
            kind = h5py.h5t.py_create(np.dtype(column.dtype))
            name = column.name.encode()
            dataset = h5py.Dataset(h5py.h5d.create(file.id, name, kind, space, dcpl=plan))
            dataset.attrs["units"] = column.unit
            dataset.attrs["long_name"] = column.meaning
            made.append(dataset)
        time = file[TIME]
        time.make_scale(TIME)
        for dataset in made:
            if dataset != time:
                dataset.dims[0].attach_scale(time)
        # With a capacity of no rows a dataset has no place, and nothing is written there.
        places = Places(count.id.get_offset(), tuple(d.id.get_offset() or 0 for d in made))
        if events is None:
            return places
        used = file.create_dataset(EVENT_BYTES, data=np.int64(0))
        used.attrs["long_name"] = "bytes of events; what lies beyond them is unused"
        kind, space = h5py.h5t.NATIVE_UINT8, h5py.h5s.create_simple((events,))
        text = h5py.Dataset(h5py.h5d.create(file.id, EVENTS.encode(), kind, space, dcpl=plan))
        text.attrs["long_name"] = "what happened, and who caused it: a line of JSON each"
        return places._replace(event_bytes=used.id.get_offset(), events=text.id.get_offset() or 0)


class _SteadyFile(io.RawIOBase):
    """A file that never fails to HDF5, which crashes at close after a failed write; see `error`."""

    def __init__(self, fd: int) -> None:
        super().__init__()
        self.error: OSError | None = None
        self.end = 0
        self._fd = fd
        self._position = 0

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        start = {os.SEEK_SET: 0, os.SEEK_CUR: self._position, os.SEEK_END: self.end}
        self._position = start[whence] + offset
        return self._position

    def tell(self) -> int:
        return self._position

    def readinto(self, buffer: Any) -> int:
        piece = portable.read_at(self._fd, len(buffer), self._position)
        buffer[:] = piece.ljust(len(buffer), b"\0")
        self._position += len(buffer)
        return len(buffer)

    def write(self, data: Any) -> int:
        try:
            write_all(self._fd, data, self._position)
        except OSError as error:
            self.error = self.error or error
        self._position += len(data)
        self.end = max(self.end, self._position)
        return len(data)

    def truncate(self, size: int | None = None) -> int:
        self.end = self._position if size is None else size
        return self.end


def _reserve(fd: int, size: int) -> None:
    """Reserve disk space for the whole file, so that a full disk shows now, not midway."""
    if not hasattr(os, "posix_fallocate"):
        return
    try:
        os.posix_fallocate(fd, 0, size)
    except OSError as error:
        if error.errno not in (errno.EOPNOTSUPP, errno.EINVAL):
            raise


def write_all(fd: int, data: memoryview | bytes, offset: int) -> None:
    """Write all data, which the system may take in parts."""
    rest = memoryview(data)
    while rest:
        done = portable.write_at(fd, rest, offset)
        rest, offset = rest[done:], offset + done
