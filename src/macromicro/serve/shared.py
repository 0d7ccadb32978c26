"""Memory shared by the serving and the loop process: flags, status, telemetry.

Each 64-bit cell has one writer. A row of the ring is complete before the count that makes it
visible, also on processors that reorder memory accesses (`fence`). Times are monotonic ns.
"""

from __future__ import annotations

import contextlib
import math
import mmap
import os
import tempfile
import threading
import time
from collections.abc import Sequence
from functools import cache
from operator import itemgetter
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from macromicro.arrays import Array, packed
from macromicro.columns import Column, Quantity, layout
from macromicro.control.live.alone import SENSORS
from macromicro.machines import pace
from macromicro.place import Place
from macromicro.serve._machine import SECONDLY, Second, View
from macromicro.types import Command, Enable, Lines, Outputs, Sample
from macromicro.units import size

RING_S = 60.0
ROWS = round(RING_S / pace.LEAST)  # longer ones have as many rows


class Vitals(NamedTuple):
    """Fault code, lateness and computing time of one period."""

    temperature_estimate: Annotated[
        float, Quantity("degC", "wire temperature estimated from CTRL by the guard")
    ]
    fault: Annotated[float, Quantity("1", "code of the latched fault, 0 for none", "i2")]
    late: Annotated[float, Quantity("us", "how late this period began", scale=1e6)]
    work: Annotated[float, Quantity("us", "time the period before took to compute", scale=1e6)]


_COLUMNS, _PARTS = layout(Sample, Command, Outputs, View, Vitals, Lines, Enable, Second)
OWN = 12  # columns that a law may have of its own, at most
COLUMNS = (*_COLUMNS, *(Column(f"law_{k}", "1", "of the law") for k in range(1, OWN + 1)))
_SHARED = len(_COLUMNS)
_ALWAYS = len(layout(Sample, Command, Outputs, View, Vitals).columns)
_LINED = len(layout(Sample, Command, Outputs, View, Vitals, Lines, Enable).columns)
NO_LINES = (math.nan,) * (_LINED - _ALWAYS)
_NOTHING = (math.nan,) * OWN
_FLAT_ROWS = np.concatenate([part.rows for part in _PARTS])
_recorded = itemgetter(*np.flatnonzero(_FLAT_ROWS >= 0).tolist())
_SCALED = [
    (int(row), float(scale))
    for part in _PARTS
    for row, scale in zip(part.rows, part.scales, strict=True)
    if row >= 0 and scale != 1.0
]


def telemetry(
    sample: Sample,
    command: Command,
    given: Outputs,
    view: View,
    vitals: Vitals,
    lines: tuple[float, ...] = NO_LINES,
    second: Second = SECONDLY,
    own: Sequence[float] | None = None,
) -> list[float]:
    """One period as a row of telemetry, as `COLUMNS` say; `own` are the law's columns."""
    row = list(_recorded((*sample, *command, *given, *view, *vitals, *lines, *second)))
    for k, scale in _SCALED:
        row[k] *= scale
    if own is not None:
        row.extend(own[:OWN])
        row.extend(_NOTHING[len(own) :])
    return row


def columns(channels: Sequence[str], own: Sequence[Column] = ()) -> list[int]:
    """The columns of a machine with these channels, this second axis and the law's `own`."""
    two = SENSORS["y"] in channels
    found = [
        k
        for k, c in enumerate(_COLUMNS)
        if k < _ALWAYS or (two if k >= _LINED else c.name in channels)
    ]
    return [*found, *range(_SHARED, _SHARED + len(own[:OWN]))]


@cache
def shown(place: Place, own: tuple[Column, ...] = ()) -> tuple[tuple[Column, ...], Array]:
    """The columns in display units, and their scale against the ring: float64[columns, 1]."""
    columns = tuple(c._replace(unit=place.named(c.unit)) for c in _COLUMNS)
    scales = [
        1.0 if made.unit == was.unit else size(was.unit) / size(made.unit)
        for was, made in zip(_COLUMNS, columns, strict=True)
    ]
    every = (*columns, *own[:OWN], *COLUMNS[_SHARED + len(own) :])
    return every, np.array([*scales, *[1.0] * OWN])[:, None]


NAMES = tuple(c.name for c in COLUMNS)
LINES = NAMES[_ALWAYS:_LINED]
INDEX = {name: k for k, name in enumerate(NAMES)}

# Cells, and who writes each.
(
    WRITTEN,  # loop: rows of telemetry written so far
    STATUS_TURN,  # loop: odd while the status is being written
    SAFE_SINCE,  # loop: time at which the last emergency stop had made the outputs safe
    SEEN,  # loop: stamp of the last emergency stop that it honoured
    ALIVE,  # loop: time of the newest row
    EMERGENCY,  # serving process: stamp of the last emergency stop asked for, 0 for none
    COMMANDS,  # serving process: messages sent so far
    HEARTBEAT,  # serving process: counts up while it lives
    LEAVE,  # serving process: 1 orders the loop to go safe and end
    RENEWED,  # serving process: counts up while the client of a jog is alive
    POINT,  # serving process: counts streamed set points twice, odd while one is written
) = range(11)
# Serving process: time of the newest set point, stages, then position and velocity of each.
_POINT, POINT_STAGES = 16, 8
BINS, BIN_S = 5000, 1e-6  # of the histograms; the last bin takes all that is longer
_CELLS = 64
_ROW, _SHORT = packed(len(COLUMNS)), packed(_SHARED)
_LOOKS, _LOOK_S = 200, 5e-5


class Status(NamedTuple):
    """What the loop reports beside the telemetry."""

    periods: float = 0.0
    missed: float = 0.0
    share: float = 0.0
    latest: float = 0.0  # greatest lateness of a period
    longest: float = 0.0  # longest computing time
    fault: float = 0.0
    value: float = 0.0
    limit: float = 0.0
    time: float = 0.0
    offset: float = math.nan  # encoder counts at coordinate 0
    macro_low: float = 0.0
    macro_high: float = 0.0
    micro_low: float = 0.0
    micro_high: float = 0.0
    whole_low: float = 0.0
    whole_high: float = 0.0
    second_offset: float = 0.0
    lamps: float = 0.0  # lines of two axes, as `lamps.packed`
    target: float = math.nan
    second_target: float = math.nan


_STATUS = packed(len(Status._fields))


_turn = threading.Lock()


def fence() -> None:
    """Memory accesses before this call come before those after it, as another process sees them.

    x86-64 keeps their order anyway, ARM does not. What is before a release of a lock stays before
    it, and what is after an acquisition stays after it.
    """
    with _turn:
        pass
    with _turn:
        pass


class Shared:
    """The shared memory, mapped from `fd`: cells, ring of telemetry and timing histograms."""

    def __init__(self, fd: int, rows: int = ROWS) -> None:
        self.fd = fd
        self.path = ""
        self.rows = rows
        status = len(Status._fields)
        size = 8 * (2 * _CELLS + 2 * BINS + len(COLUMNS) * rows)
        if os.fstat(fd).st_size != size:
            os.ftruncate(fd, size)
        memory = np.frombuffer(mmap.mmap(fd, size), np.int64)
        self.cells = memory[:_CELLS]
        self._point = memory.view(np.float64)[_POINT + 2 : _POINT + 2 + 2 * POINT_STAGES]
        self._turns = memory.data[:_CELLS]  # the same, quicker to count up
        floats = memory.view(np.float64)
        self._status = floats[_CELLS : _CELLS + status]
        self._told = memory.data[_CELLS : _CELLS + status].cast("B")
        start = 2 * _CELLS + 2 * BINS
        self.histograms = memory[2 * _CELLS : start].reshape(2, BINS)
        # A row lies in one piece, so that writing it costs one copy.
        self._rows = memory.data[start:].cast("B")
        self.ring: NDArray[np.float64] = floats[start:].reshape(rows, len(COLUMNS)).T

    @classmethod
    def create(cls, rows: int = ROWS) -> Shared:
        """Anonymous memory, or a temporary file on systems without it."""
        if hasattr(os, "memfd_create"):
            return cls(os.memfd_create("macromicro"), rows)
        fd, path = tempfile.mkstemp(prefix="macromicro-")
        shared = cls(fd, rows)
        if os.name == "nt":  # no process inherits the file: it is opened by its name
            shared.path = path
        else:
            os.unlink(path)
        return shared

    def close(self) -> None:
        """Close the descriptor; the mapping lives as long as its arrays."""
        if self.fd >= 0:
            os.close(self.fd)
            self.fd = -1
        if self.path:
            with contextlib.suppress(OSError):  # the other process still has it
                os.unlink(self.path)

    def put(self, row: Sequence[float]) -> None:
        cells = self._turns
        written = cells[WRITTEN]
        form = _SHORT if len(row) == _SHARED else _ROW
        form.pack_into(self._rows, written % self.rows * _ROW.size, *row)
        cells[ALIVE] = time.monotonic_ns()
        fence()
        cells[WRITTEN] = written + 1

    def set_status(self, status: Sequence[float]) -> None:
        self.cells[STATUS_TURN] += 1
        fence()
        _STATUS.pack_into(self._told, 0, *status)
        fence()
        self.cells[STATUS_TURN] += 1

    def show(self, row: Sequence[float], status: Sequence[float]) -> None:
        """Append a row and replace the status together (loop process only)."""
        self._turns[STATUS_TURN] += 1
        self.put(row)  # with a fence
        _STATUS.pack_into(self._told, 0, *status)
        fence()
        self._turns[STATUS_TURN] += 1

    def now(self) -> tuple[int, NDArray[np.float64], Status] | None:
        """The newest row with its number, and the status of that instant; None before the first."""
        written, row, status = self._steady()
        return None if row is None else (written, row, status)

    def set_point(self, point: Sequence[tuple[float, float]], at: int) -> None:
        """Replace the streamed set point (serving process only); `at` is its time."""
        cells = self.cells
        cells[POINT] += 1
        cells[_POINT], cells[_POINT + 1] = at, len(point)
        self._point[: 2 * len(point)] = np.ravel(point)
        cells[POINT] += 1

    def point(self, turn: int) -> tuple[tuple[tuple[float, float], ...], int] | None:
        """The streamed set point of this `turn` and its time, or None while another is written."""
        at, stages = self.cells[_POINT : _POINT + 2].tolist()
        values = self._point[: 2 * stages].tolist()
        if turn % 2 or turn != self.cells[POINT]:
            return None
        return tuple(zip(values[::2], values[1::2], strict=True)), at

    def motion(self) -> int:
        """Number of the motion under way, 0 for none."""
        written = int(self.cells[WRITTEN])
        return int(self.ring[INDEX["motion"], (written - 1) % self.rows]) if written else 0

    def status(self) -> Status:
        return self._steady()[2]

    def _steady(self) -> tuple[int, NDArray[np.float64] | None, Status]:
        for _ in range(_LOOKS):
            turn = int(self.cells[STATUS_TURN])
            fence()
            written, row, values = int(self.cells[WRITTEN]), self.last(), self._status.tolist()
            fence()
            if turn % 2 == 0 and turn == int(self.cells[STATUS_TURN]):
                break
            time.sleep(_LOOK_S)
        return written, row, Status(*values)

    def since(self, count: int) -> tuple[int, int, NDArray[np.float64]]:
        """Rows after the first `count`: (lost, new count, copy float64[columns, rows])."""
        written = int(self.cells[WRITTEN])
        margin = min(self.rows // 4, 1000)
        first = max(count, written - self.rows + margin)
        while True:
            fence()
            block = self._block(first, written)
            fence()
            oldest = int(self.cells[WRITTEN]) - self.rows + 1
            if first >= oldest or first >= written:
                return first - count, written, block
            first = min(oldest + margin, written)  # overtaken while copying

    def last(self) -> NDArray[np.float64] | None:
        written = int(self.cells[WRITTEN])
        return self.ring[:, (written - 1) % self.rows].copy() if written else None

    def _block(self, first: int, stop: int) -> NDArray[np.float64]:
        start, end = first % self.rows, stop % self.rows
        if first >= stop:
            return np.empty((len(COLUMNS), 0))
        if start < end:
            return self.ring[:, start:end].copy()
        return np.concatenate([self.ring[:, start:], self.ring[:, :end]], axis=1)
