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
from macromicro.machines import pace
from macromicro.place import LENGTH, Place
from macromicro.serve._machine import View, stage_columns
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


COLUMNS, _PARTS = layout(Sample, Command, Outputs, View, Vitals)  # of every machine
NAMES = tuple(c.name for c in COLUMNS)
INDEX = {name: k for k, name in enumerate(NAMES)}
_LINED = layout(Lines, Enable).columns
LINES = tuple(c.name for c in _LINED)
LAMPS = tuple(name for name in LINES if name != "index_count")
_FLAT_ROWS = np.concatenate([part.rows for part in _PARTS])
_recorded = itemgetter(*np.flatnonzero(_FLAT_ROWS >= 0).tolist())
_SCALED = [
    (int(row), float(scale))
    for part in _PARTS
    for row, scale in zip(part.rows, part.scales, strict=True)
    if row >= 0 and scale != 1.0
]


def telemetry(
    sample: Sample, command: Command, given: Outputs, view: View, vitals: Vitals
) -> list[float]:
    """One period as the row of `COLUMNS`; what else a machine shows comes behind them."""
    row = list(_recorded((*sample, *command, *given, *view, *vitals)))
    for k, scale in _SCALED:
        row[k] *= scale
    return row


class Telemetry(NamedTuple):
    """The columns that a machine publishes, as they are recorded, and its named stages."""

    columns: tuple[Column, ...]
    scales: Array  # of the columns against the ring: float64[columns, 1]
    stages: tuple[str, ...] = ()  # that have a status of their own; "" is the only one

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(c.name for c in self.columns)

    def kept(self, channels: Sequence[str]) -> list[int]:
        """The columns of a rig with these channels: not of the lines that it lacks."""
        each = enumerate(self.columns)
        return [k for k, c in each if c.name not in LINES or c.name in channels]


@cache
def telemetry_of(
    places: tuple[Place, ...] = (LENGTH,),
    stages: tuple[str, ...] = (),
    law: tuple[Column, ...] = (),
) -> Telemetry:
    """The columns of a machine: those of all machines, the lines of its only stage or the columns
    of each stage after the first, and those of its laws."""
    groups = [(places[0], (*COLUMNS, *_LINED) if stages == ("",) else COLUMNS)]
    groups += [(p, stage_columns(n)) for n, p in zip(stages[1:], places[1:], strict=True)]
    plain = [column for _, own in groups for column in own]
    columns = [c._replace(unit=place.named(c.unit)) for place, own in groups for c in own]
    scales = [
        1.0 if made.unit == was.unit else size(was.unit) / size(made.unit)
        for was, made in zip(plain, columns, strict=True)
    ]
    return Telemetry((*columns, *law), np.array([*scales, *[1.0] * len(law)])[:, None], stages)


PLAIN = telemetry_of()

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
_POINT = 16  # serving process: time of the newest set point, then the number of its stages
_CELLS = 64
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
    target: float = math.nan
    stages: tuple[StageStatus, ...] = ()  # of a machine of one or several stages


class StageStatus(NamedTuple):
    """What the loop reports of a stage beside the telemetry."""

    offset: float = math.nan  # encoder counts at coordinate 0
    target: float = math.nan
    lamps: tuple[float, ...] = ()  # whether each of `LAMPS` is on, 0 or 1; NaN: it has none such


_FIXED, _EACH = len(Status._fields) - 1, len(StageStatus._fields) - 1 + len(LAMPS)
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
    """The shared memory, mapped from `fd`: cells, status and ring of telemetry."""

    def __init__(self, fd: int, rows: int = ROWS, form: Telemetry = PLAIN) -> None:
        self.fd, self.rows, self.form = fd, rows, form
        self.path = ""
        width, status = len(form.columns), _FIXED + _EACH * len(form.stages)
        point = 2 * max(len(form.stages), 1)  # position and velocity of each stage
        start = _CELLS + status + point
        size = 8 * (start + width * rows)
        if os.fstat(fd).st_size != size:
            os.ftruncate(fd, size)
        memory = np.frombuffer(mmap.mmap(fd, size), np.int64)
        self.cells = memory[:_CELLS]
        self._turns = memory.data[:_CELLS]  # the same, quicker to count up
        floats = memory.view(np.float64)
        self._row, self._state = packed(width), packed(status)
        self._nothing = (math.nan,) * width
        self._status = floats[_CELLS : _CELLS + status]
        self._told = memory.data[_CELLS : _CELLS + status].cast("B")
        self._point = floats[_CELLS + status : _CELLS + status + point]
        # A row lies in one piece, so that writing it costs one copy.
        self._rows = memory.data[start:].cast("B")
        self.ring: NDArray[np.float64] = floats[start:].reshape(rows, width).T

    @classmethod
    def create(cls, rows: int = ROWS, form: Telemetry = PLAIN) -> Shared:
        """Anonymous memory, or a temporary file on systems without it."""
        if hasattr(os, "memfd_create"):
            return cls(os.memfd_create("macromicro"), rows, form)
        fd, path = tempfile.mkstemp(prefix="macromicro-")
        shared = cls(fd, rows, form)
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
        """Append a row; what it lacks at its end is NaN."""
        cells, form = self._turns, self._row
        written = cells[WRITTEN]
        form.pack_into(
            self._rows, written % self.rows * form.size, *row, *self._nothing[len(row) :]
        )
        cells[ALIVE] = time.monotonic_ns()
        fence()
        cells[WRITTEN] = written + 1

    def set_status(self, status: Sequence[float]) -> None:
        """Replace the status: the fields of `Status`, then those of each stage."""
        self.cells[STATUS_TURN] += 1
        fence()
        self._state.pack_into(self._told, 0, *status)
        fence()
        self.cells[STATUS_TURN] += 1

    def show(self, row: Sequence[float], status: Sequence[float]) -> None:
        """Append a row and replace the status together (loop process only)."""
        self._turns[STATUS_TURN] += 1
        self.put(row)  # with a fence
        self._state.pack_into(self._told, 0, *status)
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
        fence()
        cells[_POINT], cells[_POINT + 1] = at, len(point)
        self._point[: 2 * len(point)] = np.ravel(point)
        fence()
        cells[POINT] += 1

    def point(self, turn: int) -> tuple[tuple[tuple[float, float], ...], int] | None:
        """The streamed set point of this `turn` and its time, or None while another is written."""
        fence()
        at, stages = self.cells[_POINT : _POINT + 2].tolist()
        values = self._point[: 2 * stages].tolist()
        fence()
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
        own = values[_FIXED:]
        stages = []
        for k in range(0, len(own), _EACH):
            offset, target, *lamps = own[k : k + _EACH]
            stages.append(StageStatus(offset, target, tuple(lamps)))
        return written, row, Status(*values[:_FIXED])._replace(stages=tuple(stages))

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
            return np.empty((len(self.form.columns), 0))
        if start < end:
            return self.ring[:, start:end].copy()
        return np.concatenate([self.ring[:, start:], self.ring[:, :end]], axis=1)
