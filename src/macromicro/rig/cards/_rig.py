"""A card as a rig: units, safe outputs."""

from __future__ import annotations

import math
import time
from collections import namedtuple
from collections.abc import Sequence
from typing import Any, Protocol, Self

from macromicro.errors import MacromicroError
from macromicro.rig.cards._wiring import ANALOG, COUNTER, Terminal, Wiring, fields, shape


class CardError(MacromicroError):
    """The card, its driver or its library failed."""


class Port(Protocol):
    """An opened card; values in the order of the connected terminals."""

    def open(self, device: str) -> None: ...

    def connect(self, inputs: Sequence[Terminal], outputs: Sequence[Terminal]) -> None:
        """Take the terminals and check them."""

    def counts(self, terminal: Terminal) -> int:
        """Range of a counter."""

    def read(self) -> Sequence[float]: ...

    def write(self, values: Sequence[float]) -> None: ...

    def close(self) -> None:
        """Close the device, if it is open."""


class Deadlines:
    """A clock of absolute deadlines: late periods shift no later ones, missed ones are skipped."""

    def __init__(self) -> None:
        self._began = self._deadline = time.monotonic()

    def start(self) -> None:
        self._began = self._deadline = time.monotonic()

    def now(self) -> float:
        return time.monotonic() - self._began

    def wait(self, dt: float) -> None:
        self._deadline += dt
        left = self._deadline - time.monotonic()
        if left > 0.0:
            time.sleep(left)
        else:
            self._deadline += math.floor(-left / dt) * dt


_TYPE: Any = namedtuple  # its fields are known when the wiring is


class CardRig:
    """A machine behind a data-acquisition card, as a `Rig`."""

    def __init__(self, wiring: Wiring, port: Port) -> None:
        self.kind, self.dt, self.rest = wiring.kind, wiring.dt, wiring.rest
        self.calibration, self.counted = wiring.calibration, wiring.keeps_count
        if not math.isnan(wiring.pitch):
            self.pitch = wiring.pitch
        self.channels = tuple(t.name for t in wiring.inputs)
        self.outputs = tuple(t.name for t in wiring.outputs)
        self.clock = Deadlines()
        self._wiring, self._port = wiring, port
        names = shape(wiring.kind, self.channels)
        self._sample, self._blank = _TYPE("CardSample", names), dict.fromkeys(names[1:], math.nan)
        self._written = fields(wiring.kind, self.outputs)
        self._counters: dict[str, Counter] = {}

    def read(self) -> Any:
        t, values = self.clock.now(), dict(self._blank)
        for terminal, raw in zip(self._wiring.inputs, self._port.read(), strict=True):
            if terminal.signal == COUNTER:
                values[terminal.name] = self._counters[terminal.name].count(int(raw))
            elif terminal.signal == ANALOG:
                values[terminal.name] = terminal.scale * raw + terminal.offset
            else:
                values[terminal.name] = _line(terminal, raw)
        return self._sample(t, **values)

    def write(self, outputs: Any) -> None:
        given = dict(zip(self._written, outputs, strict=False))
        wanted = [float(given.get(t.name, 0.0)) for t in self._wiring.outputs]
        for terminal, value in zip(self._wiring.outputs, wanted, strict=True):
            if not math.isfinite(value):
                self.stop()
                raise CardError(
                    f"{terminal.where}: illegal output {value}; all outputs were made safe"
                )
        self._put(wanted)

    def stop(self) -> None:
        """Set all outputs to safe values at once."""
        self._put([0.0] * len(self._wiring.outputs))

    def _put(self, wanted: list[float]) -> None:
        raw = []
        for terminal, value in zip(self._wiring.outputs, wanted, strict=True):
            if terminal.signal == ANALOG:
                raw.append((value - terminal.offset) / terminal.scale)
            else:
                raw.append(_line(terminal, value))
        self._port.write(raw)

    def __enter__(self) -> Self:
        try:
            self._port.open(self._wiring.device)
            self._port.connect(self._wiring.inputs, self._wiring.outputs)
            self.stop()
            self._counters = {
                t.name: Counter(self._port.counts(t), int(t.offset), t.scale)
                for t in self._wiring.inputs
                if t.signal == COUNTER
            }
        except BaseException:
            self._port.close()
            raise
        self.clock.start()
        return self

    def __exit__(self, *_: object) -> None:
        try:
            self.stop()
        finally:
            self._port.close()


class Counter:
    """Unwraps a counter that moves less than half its range between readings."""

    def __init__(self, range_: int, zero: int, sign: float) -> None:
        self._range, self._last, self._sign = range_, zero, sign
        self._place = 0

    def count(self, reading: int) -> float:
        half = self._range // 2
        self._place += (reading - self._last + half) % self._range - half
        self._last = reading
        return self._sign * self._place


def _line(terminal: Terminal, value: float) -> float:
    """State of a line, inverted if so wired."""
    return 1.0 - value if terminal.scale < 0.0 else value
