"""Recorder: writes a run to disk so that a killed process or a full disk loses nothing."""

from __future__ import annotations

import errno
import os
import shutil
import sys
import threading
import time
from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from macromicro import portable
from macromicro.columns import Column
from macromicro.errors import InputError, MacromicroError, ProblemError
from macromicro.recording_format import (
    Attribute,
    Block,
    Layout,
    Noted,
    Places,
    as_block,
    needed_bytes,
    write_all,
)

_MB = 1_000_000
_COPY_BYTES = 1 << 20
EVENT_BYTES_A_ROW = 4  # reserved: about ten events a second


class RecordingError(MacromicroError):
    """Writing a recording failed. The message says how many rows are safe, and where."""


def check_space(folder: str | os.PathLike[str], needed: int) -> None:
    """Refuse a folder in which a file of some size cannot be written.

    A folder that does not exist yet is judged by the nearest one above it that does.

    Parameters
    ----------
    folder : str | os.PathLike[str]
        Where the file is to be.
    needed : int
        Space needed, bytes.

    Raises
    ------
    ProblemError
        Not a folder, not writable, or too little space.

    Examples
    --------
    >>> from macromicro.recording import check_space
    >>> check_space(".", needed=10**18)  # bytes
    Traceback (most recent call last):
        ...
    macromicro.errors.ProblemError: .: only ... MB free. ...
    """
    given = Path(folder)
    place = given.absolute()
    while not os.path.lexists(place) and place != place.parent:
        place = place.parent
    if not place.is_dir():
        raise ProblemError(str(given), "not a folder", "Choose a folder, or a place for a new one.")
    if not os.access(place, os.W_OK | os.X_OK):
        raise ProblemError(str(given), "not writable", "Choose a folder that you may write to.")
    free = shutil.disk_usage(place).free
    if free < needed:
        problem = f"only {free / _MB:.1f} MB free"
        remedy = f"Choose a folder with at least {needed / _MB:.1f} MB free."
        raise ProblemError(str(given), problem, remedy)


class Recorder:
    """Writes a recording, block by block; a context manager that closes it.

    What `append` was given is in the file when it returns, and a process killed at any instant
    leaves a file that opens in h5py as it is. `Recording.load` shows its rows; other readers see
    the unused rows up to the capacity too, until `close` cuts them off.

    Disk space for `capacity` rows is reserved at once. A longer run grows the file by copying it to
    twice the capacity, so choose a capacity that suffices.

    Parameters
    ----------
    path : str | os.PathLike[str]
        The new file, in a folder that exists.
    columns : Sequence[Column]
        Names, units, meanings and types, `t` among them.
    capacity : int
        Rows to reserve space for, at least 1.
    dt : float
        Sample time, s.
    attributes : Mapping[str, Attribute]
        Provenance, such as seed and version.
    overwrite : bool, optional
        Whether an existing file may be replaced.
    events : bool, optional
        Whether it also takes events (`note`).

    Raises
    ------
    InputError
        The path exists already, the folder is unfit, or HDF5 cannot hold the columns or attributes.
    RecordingError
        The file cannot be made.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from macromicro.recording import Column, Recorder, Recording
    >>> columns = [Column("t", "s", "time"), Column("motor", "V", "voltage of the motor")]
    >>> with TemporaryDirectory() as folder:
    ...     with Recorder(f"{folder}/run.h5", columns, 1000, 0.001, {"seed": 7}) as recorder:
    ...         recorder.append([[0.0, 0.001], [1.5, 1.25]])
    ...     Recording.load(f"{folder}/run.h5")["motor"].tolist()
    [1.5, 1.25]
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        columns: Sequence[Column],
        capacity: int,
        dt: float,
        attributes: Mapping[str, Attribute],
        *,
        overwrite: bool = False,
        events: bool = False,
    ) -> None:
        where = os.fspath(path)
        self.path = Path(path).absolute()
        if capacity < 1:
            raise InputError(f"{where}, capacity", capacity, "at least 1 row")
        self._layout = Layout.checked(columns, dt, attributes, where)
        if os.path.lexists(self.path) and not (overwrite and self.path.is_file()):
            remedy = "Choose another name; overwrite=True replaces a file."
            raise ProblemError(where, "the path already exists", remedy)
        if not self.path.parent.is_dir():
            remedy = "Choose a file in an existing folder."
            raise ProblemError(where, "its folder does not exist", remedy)
        check_space(self.path.parent, needed_bytes(self.columns, capacity))
        self._widths = [np.dtype(c.dtype).itemsize for c in self.columns]
        self._places = Places(0, ())
        self._capacity = 0
        self._has_events, self._room, self._used = events, 0, 0  # bytes of events
        self._rows = 0
        self._fd = -1
        self._closed = self._noted = False
        try:
            self._lay_out(capacity)
        except (OSError, RuntimeError) as error:
            raise RecordingError(f"{where}: cannot be made: {_reason(error)}") from error

    @property
    def columns(self) -> tuple[Column, ...]:
        """The columns, in the order of a block's rows."""
        return self._layout.columns

    @property
    def rows(self) -> int:
        """Rows that are safe in the file."""
        return self._rows

    def append(self, block: Block) -> None:
        """Write a block behind the earlier rows.

        Whatever is raised, the earlier rows stay as they are, nothing of this block counts, and
        `append` may be tried again.

        Parameters
        ----------
        block : Block
            Shape (columns, rows), or one array per column.

        Raises
        ------
        InputError
            Another shape, or values that a column cannot hold.
        RecordingError
            The disk refuses, or the recorder is closed.
        """
        if self._closed:
            raise RecordingError(f"{self.path}: is closed; {self._rows} rows are in it")
        arrays = as_block(block, self.columns, str(self.path))
        total = self._rows + len(arrays[0])
        try:
            if total > self._capacity:
                self._lay_out(max(total, 2 * self._capacity))
            places = zip(arrays, self._places.columns, self._widths, strict=True)
            for array, place, width in places:
                write_all(self._fd, array.view(np.uint8).data, place + self._rows * width)
            write_all(self._fd, np.int64(total).tobytes(), self._places.rows)
        except (OSError, RuntimeError) as error:
            raise self._failed(error) from error
        self._rows = total

    def note(self, entries: Sequence[Noted]) -> None:
        """Append events, in a recording with `events`.

        Parameters
        ----------
        entries : Sequence[Noted]
            In time order.

        Raises
        ------
        RecordingError
            The disk refuses, or the recorder is closed or takes no events.
        """
        if self._closed or not self._has_events:
            raise RecordingError(f"{self.path}: takes no events")
        text = b"".join(entry.line() for entry in entries)
        used = self._used + len(text)
        try:
            if used > self._room:
                self._lay_out(self._capacity, 2 * used)
            write_all(self._fd, text, self._places.events + self._used)
            write_all(self._fd, np.int64(used).tobytes(), self._places.event_bytes)
        except (OSError, RuntimeError) as error:
            raise self._failed(error) from error
        self._used = used

    def _failed(self, error: Exception) -> RecordingError:
        return RecordingError(
            f"{self.path}: writing failed: {_reason(error)}; "
            f"the first {self._rows} rows are safe in this file"
        )

    def attribute(self, name: str, value: Attribute) -> None:
        """Add an attribute; it is in the file once `close` has laid it out for the last time.

        Parameters
        ----------
        name : str
            Name of the attribute.
        value : Attribute
            Replaces an earlier one of this name.

        Raises
        ------
        InputError
            HDF5 cannot hold it.
        """
        layout = self._layout
        attributes = {**layout.attributes, name: value}
        self._layout = Layout.checked(layout.columns, layout.dt, attributes, str(self.path))
        self._noted = True

    def flush(self) -> None:
        """Force all appended rows onto the disk itself, against a power failure.

        Slow, and not needed against a killed process.

        Raises
        ------
        RecordingError
            The disk refuses.
        """
        try:
            os.fsync(self._fd)
        except OSError as error:
            raise RecordingError(f"{self.path}: cannot be flushed: {_reason(error)}") from error

    def close(self) -> None:
        """Cut off the unused rows and close the file.

        Where the disk has no room for the shorter copy, the file stays as it is, all rows
        in it, as after a kill.
        """
        if self._closed:
            return
        self._closed = True
        try:
            if self._rows < self._capacity or self._used < self._room or self._noted:
                self._lay_out(self._rows, self._used)
        except (OSError, RuntimeError):
            pass  # all rows are safe already
        finally:
            os.close(self._fd)
            self._fd = -1

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _lay_out(self, capacity: int, room: int | None = None) -> None:
        """Replace the file by one of `capacity` rows, and `room` bytes of events, that holds
        all of them so far."""
        if room is None:
            room = max(self._room, EVENT_BYTES_A_ROW * capacity)
        part = self.path.with_name(f"{self.path.name}.part")
        fd = os.open(part, portable.READ_WRITE | os.O_TRUNC, 0o666)
        try:
            places = self._layout.write(fd, capacity, room if self._has_events else None)
            if self._rows:
                columns = zip(self._places.columns, places.columns, self._widths, strict=True)
                for source, target, width in columns:
                    _copy(self._fd, source, fd, target, self._rows * width)
                write_all(fd, np.int64(self._rows).tobytes(), places.rows)
            if self._used:
                _copy(self._fd, self._places.events, fd, places.events, self._used)
                write_all(fd, np.int64(self._used).tobytes(), places.event_bytes)
            fd = portable.replace_open(part, self.path, fd, self._fd)
        except BaseException:
            os.close(fd)
            part.unlink(missing_ok=True)
            raise
        self._fd = fd
        self._capacity, self._places = capacity, places
        self._room = room if self._has_events else 0


class Behind:
    """A sink that writes on another thread, so that a real-time loop never waits for a file.

    It appends every 0.1 s and syncs every second; an error is raised by the next `append`.
    """

    EVERY, FLUSHED = 0.1, 1.0  # s
    SWITCH = 1e-4  # s: so long the loop waits at most for the thread's own Python code

    def __init__(self, sink: Any, most: int = 5000) -> None:
        self._sink, self._most = sink, most
        self._blocks: deque[NDArray[np.float64]] = deque()
        self._enough = threading.Event()
        self._error: Exception | None = None
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        self._before = sys.getswitchinterval()

    def append(self, block: NDArray[np.float64]) -> None:
        """Take a block, which must not change later."""
        if self._error is not None:
            raise self._error
        self._blocks.append(block)

    def __enter__(self) -> Self:
        sys.setswitchinterval(min(self._before, self.SWITCH))
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._enough.set()
        self._thread.join()
        sys.setswitchinterval(self._before)
        if self._error is not None and kind is None:
            raise self._error

    def _run(self) -> None:
        flush, due = getattr(self._sink, "flush", None), time.monotonic() + self.FLUSHED
        try:
            while not self._enough.wait(self.EVERY):
                self._drain()
                if flush is not None and time.monotonic() >= due:
                    flush()
                    due = time.monotonic() + self.FLUSHED
            self._drain()
        except Exception as error:  # the loop must be informed
            self._error = error

    def _drain(self) -> None:
        blocks = [self._blocks.popleft() for _ in range(len(self._blocks))]
        if not blocks:
            return
        rows = np.concatenate(blocks, axis=1)
        for k in range(0, rows.shape[1], self._most):
            self._sink.append(rows[:, k : k + self._most])


def _reason(error: Exception) -> str:
    """The system's message, such as "No space left on device"."""
    number = getattr(error, "errno", None)
    return os.strerror(number) if number else str(error)


def _copy(source: int, start: int, target: int, to: int, length: int) -> None:
    """Copy `length` bytes between open files."""
    done = 0
    while done < length:
        piece = portable.read_at(source, min(_COPY_BYTES, length - done), start + done)
        if not piece:
            raise OSError(errno.EIO, os.strerror(errno.EIO))  # someone else shortened the file
        write_all(target, piece, to + done)
        done += len(piece)
