"""Triggered captures: some signals around an event, at the loop's rate, out of the telemetry."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from macromicro.arrays import Array
from macromicro.columns import Column
from macromicro.control.live.messages import LIMIT, Finished
from macromicro.errors import InputError, ProblemError
from macromicro.schema.par import finite
from macromicro.serve.shared import ROWS, WRITTEN, Shared

if TYPE_CHECKING:
    from macromicro.serve._loop_connection import LoopConnection
    from macromicro.serve.settings import AnySettings

NOW, EDGE, LEVEL, BEGIN, END, FAULT, AT_LIMIT = (
    "now", "edge", "level", "begin", "end", "fault", "limit",
)  # fmt: skip
TRIGGERS = (NOW, EDGE, LEVEL, BEGIN, END, FAULT, AT_LIMIT)
RISING, FALLING, EITHER = SLOPES = ("rising", "falling", "either")
WAITING, TRIGGERED, COMPLETE = STATES = ("waiting", "triggered", "complete")
MOST_SIGNALS = 8
SPARE = 4000  # rows of the ring that may be written until a capture is fetched
_SWITCHES = ("limit_low", "limit_high")


class Trigger(NamedTuple):
    """What begins a capture.

    Examples
    --------
    >>> from macromicro.serve.capturing import Trigger
    >>> Trigger("edge", "position", "rising", 12.5).threshold  # in the signal's unit
    12.5
    """

    kind: str = NOW  # one of `TRIGGERS`
    signal: str = ""  # of an edge or a level
    slope: str = RISING  # of an edge; a level is at least (rising) or at most (falling) that
    threshold: float = 0.0  # in the unit of the signal


class Wanted(NamedTuple):
    signals: tuple[str, ...]  # names of telemetry columns
    trigger: Trigger = Trigger()
    before: float = 0.0  # s
    after: float = 1.0  # s
    repeat: bool = False  # whether it begins again once complete


class Captured(NamedTuple):
    """The rows of a capture."""

    number: int  # 1, 2, ...
    names: tuple[str, ...]  # of `values`; the first is "t", the time from the trigger on, s
    units: tuple[str, ...]
    time: float  # of the trigger by the machine, s
    values: Array  # shape (names, rows)


Ends = Callable[[int], Finished | None]


def check(wanted: Wanted, columns: Sequence[Column], period: float) -> Wanted:
    """Refuse what cannot be captured, saying what can."""
    known = {column.name for column in columns}
    if not wanted.signals or len(wanted.signals) > MOST_SIGNALS:
        raise InputError("signals", len(wanted.signals), f"1 to {MOST_SIGNALS} names")
    trigger = wanted.trigger
    watches = trigger.kind in (EDGE, LEVEL)
    for where, name in (
        *(("signals", name) for name in wanted.signals),
        *((("trigger, signal", trigger.signal),) if watches else ()),
    ):
        if name not in known:
            raise InputError(where, name, f"one of {', '.join(sorted(known))}")
    if trigger.kind not in TRIGGERS:
        raise InputError("trigger", trigger.kind, f"one of {', '.join(TRIGGERS)}")
    slopes = SLOPES[:2] if trigger.kind == LEVEL else SLOPES
    if trigger.slope not in slopes:
        raise InputError("trigger, slope", trigger.slope, f"one of {', '.join(slopes)}")
    if not finite(trigger.threshold):
        raise InputError("trigger, threshold", trigger.threshold, "a finite number")
    longest = (ROWS - SPARE) * period
    for where, value in (("before", wanted.before), ("after", wanted.after)):
        if not finite(value) or not 0.0 <= value <= longest:
            raise InputError(where, value, f"0 to {longest:g} s")
    if wanted.before + wanted.after > longest:
        both = wanted.before + wanted.after
        raise InputError("before and after", f"{both:g} s", f"at most {longest:g} s together")
    return wanted


class Capture:
    """One capture under way; `look` is to be called more often than the ring is filled."""

    def __init__(
        self, wanted: Wanted, columns: Sequence[Column], scales: Array, period: float, count: int
    ) -> None:
        """`columns` and `scales` of the whole ring; `count` of its rows when it begins."""
        self.wanted = wanted
        self.state, self.number = WAITING, 0
        self.captured: Captured | None = None
        self._index = {column.name: k for k, column in enumerate(columns)}
        self._switches = [k for name, k in self._index.items() if name in _SWITCHES]
        self._columns, self._scales = columns, scales
        self._before = round(wanted.before / period)
        self._after = round(wanted.after / period)
        self._seen, self._last = count, np.full(len(columns), math.nan)
        self._at = 0  # number of the trigger's row

    def look(self, ring: Shared, ends: Ends) -> None:
        """Look at every row that has come since."""
        if self.state == COMPLETE:
            return
        if self.state == WAITING:
            lost, count, block = ring.since(self._seen)
            if count < self._seen or lost:  # another loop, or rows that nobody has looked at
                self._last[:] = math.nan
            first = count - block.shape[1]
            found = self._trigger(np.column_stack([self._last, block]), ends)
            if found is None:
                return  # how a motion has ended is not reported yet: look again
            if found < 0:
                self._seen = count
                if block.shape[1]:
                    self._last = block[:, -1].copy()
                return
            self.state, self._at = TRIGGERED, first + found
        self._fetch(ring)

    def _fetch(self, ring: Shared) -> None:
        first = max(self._at - self._before, 0)
        _, count, block = ring.since(first)
        if count <= self._at + self._after and count >= self._at:
            return
        start = first - (count - block.shape[1])
        rows = block[:, max(start, 0) : max(start, 0) + self._at + self._after + 1 - first]
        at = self._at - first + min(start, 0)
        if not 0 <= at < rows.shape[1]:  # the ring or the loop has gone on: begin again
            self.state, self._seen = WAITING, count
            return
        names = self.wanted.signals
        picked = [self._index[name] for name in names]
        time = rows[self._index["t"]]
        values = np.vstack([time - time[at], rows[picked] * self._scales[picked]])
        units = tuple(self._columns[k].unit for k in picked)
        self.number += 1
        self.captured = Captured(self.number, ("t", *names), ("s", *units), float(time[at]), values)
        self.state = COMPLETE
        if self.wanted.repeat:
            self.state, self._seen = WAITING, self._at + self._after + 1
            self._last = rows[:, -1].copy()

    def _trigger(self, rows: Array, ends: Ends) -> int | None:
        """The index of the trigger's row behind the first one, -1; None: it is not known yet."""
        kind, now = self.wanted.trigger.kind, rows[:, 1:]
        if kind == NOW:
            return 0 if now.shape[1] else -1
        if kind == AT_LIMIT:
            return self._limit(rows, ends)
        hits = self._signal(rows) if kind in (EDGE, LEVEL) else self._event(rows, kind)
        return int(np.argmax(hits)) if hits.any() else -1

    def _signal(self, rows: Array) -> NDArray[np.bool_]:
        trigger = self.wanted.trigger
        k = self._index[trigger.signal]
        off = rows[k] * self._scales[k, 0] - trigger.threshold
        was, now = off[:-1], off[1:]
        if trigger.kind == LEVEL:
            return np.asarray(now >= 0.0 if trigger.slope == RISING else now <= 0.0)
        up, down = (was < 0.0) & (now >= 0.0), (was > 0.0) & (now <= 0.0)
        ways = {RISING: up, FALLING: down, EITHER: up | down}
        return np.asarray(ways[trigger.slope])

    def _event(self, rows: Array, kind: str) -> NDArray[np.bool_]:
        values = rows[self._index["fault" if kind == FAULT else "motion"]]
        was, now = values[:-1], values[1:]
        changed = (was != now) & ~np.isnan(was)
        return np.asarray(changed & ((was if kind == END else now) > 0.0))

    def _limit(self, rows: Array, ends: Ends) -> int | None:
        """A limit switch that trips, or the end of a motion at a limit."""
        switches = rows[self._switches]
        tripped = ((switches[:, :-1] == 0.0) & (switches[:, 1:] > 0.0)).any(axis=0)
        hits = np.flatnonzero(tripped | self._event(rows, END))
        for k in hits.tolist():
            if tripped[k]:
                return k
            end = ends(int(rows[self._index["motion"], k]))
            if end is None:
                return None
            if end.outcome == LIMIT:
                return k
        return -1


def csv(captured: Captured) -> str:
    """A table with a line of names and units."""
    pairs = zip(captured.names, captured.units, strict=True)
    lines = [",".join(f"{name} [{unit}]" for name, unit in pairs)]
    lines += [",".join(f"{value:.9g}" for value in row) for row in captured.values.T.tolist()]
    return "\n".join(lines) + "\n"


class Captures:
    """Looks at the telemetry for all of them; thread-safe."""

    def __init__(self, connection: LoopConnection, settings: AnySettings) -> None:
        self._connection, self._settings = connection, settings
        self._lock = threading.Lock()
        self._captures: dict[str, Capture] = {}

    @property
    def signals(self) -> tuple[Column, ...]:
        """The columns that can be captured."""
        form = self._settings.telemetry
        return tuple(form.columns[k] for k in form.kept(self._connection.channels))

    def begin(self, client: str, wanted: Wanted) -> Capture:
        """Begin a capture, in place of the client's last one; raises InputError."""
        shared, period = self._connection.shared, self._settings.period
        check(wanted, self.signals, period)
        if shared is None or not self._connection.running:
            raise ProblemError("capture", "the loop process is not running", "Start it again.")
        form = self._settings.telemetry
        capture = Capture(wanted, form.columns, form.scales, period, int(shared.cells[WRITTEN]))
        with self._lock:
            self._captures[client] = capture
        return capture

    def of(self, client: str) -> Capture | None:
        """The client's capture."""
        return self._captures.get(client)

    def end(self, client: str) -> None:
        with self._lock:
            self._captures.pop(client, None)

    def look(self) -> None:
        """Look at the rows that have come; to be called periodically."""
        shared, ledger = self._connection.shared, self._connection.ledger
        if shared is None:
            return
        with self._lock:
            waiting = list(self._captures.values())
        for capture in waiting:
            capture.look(shared, ledger.finished)
