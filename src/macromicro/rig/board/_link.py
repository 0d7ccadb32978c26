"""A board at a serial port: requests, answers, samples."""

from __future__ import annotations

import time
from typing import Any, Protocol

from macromicro.errors import MacromicroError
from macromicro.extras import remedy
from macromicro.rig.board import control, protocol
from macromicro.rig.board.control import Board
from macromicro.rig.board.framing import Stream
from macromicro.rig.board.protocol import BAUD, FIRMWARE, REFUSALS, VERSION, Frame

GREETING = 0.25  # s between hellos, until the board answers; a bootloader takes a second or two
ANSWER, TRIES = 0.5, 8  # s until a request is made again, and how often
IN_MOTION, TRIES_IN_MOTION = 0.05, 8  # the same while a control loop waits
FIRST_SAMPLE, NEXT_SAMPLE = 5.0, 0.4  # s to wait for it
_UNO = "atmega328p"
_WORDS = {
    "version": "it speaks another version of the protocol",
    "driving": "its outputs are on",
    "parameters": "its parameters are not those that were written",
    "index": "it has no such parameter",
    "unknown": "it does not know this request",
}


class BoardError(MacromicroError):
    """The board is missing, refused, silent or stopped."""


class Port(Protocol):
    """The serial port interface, as of pyserial's `Serial`."""

    timeout: float | None

    def read(self, size: int = 1) -> bytes: ...

    def write(self, data: bytes) -> Any: ...

    @property
    def in_waiting(self) -> int: ...

    def close(self) -> None: ...


def open_port(device: str) -> Port:
    try:
        import serial
    except ModuleNotFoundError:
        raise BoardError(f"pyserial is missing: {remedy('board')}") from None
    try:
        port: Port = serial.Serial(device, BAUD, timeout=GREETING, exclusive=True)
    except (OSError, ValueError) as error:  # pyserial's own are OSErrors
        raise BoardError(f"{device}: {error}") from None
    return port


class Link:
    """Frames to and from a board."""

    def __init__(self, port: Port, name: str) -> None:
        self.port, self.name = port, name
        self.trips: list[float] = []  # how long the last answers took, s
        self._stream, self._sequence = Stream(), 0
        self._samples: list[Frame] = []

    @property
    def bad(self) -> int:
        """Number of bad frames."""
        return self._stream.bad

    def tell(self, name: str, **values: float) -> None:
        self._sequence += 1
        try:
            self.port.write(protocol.encode(name, self._sequence, **values))
        except OSError as error:
            raise BoardError(f"{self.name}: {error}") from None

    def _come(self, timeout: float) -> list[Frame]:
        """Frames until the timeout."""
        try:
            self.port.timeout = timeout
            data = self.port.read(max(self.port.in_waiting, 1))
        except OSError as error:
            raise BoardError(f"{self.name}: {error}") from None
        frames = (protocol.decode(body) for body in self._stream.take(data))
        return [frame for frame in frames if frame is not None]

    def urge(self, name: str, answer: str, **values: float) -> dict[str, Any]:
        """Send a request for which a control loop waits, until it is answered: 0.4 s at most."""
        return self.ask(name, answer, TRIES_IN_MOTION, IN_MOTION, **values)

    def ask(
        self, name: str, answer: str, tries: int = TRIES, again: float = ANSWER, **values: float
    ) -> dict[str, Any]:
        """Send a request until it is answered; repeat it after `again` s."""
        own = protocol.HOST[name].id
        for _ in range(tries):
            self.tell(name, **values)
            began = time.monotonic()
            while (left := began + again - time.monotonic()) > 0.0:
                others: list[Frame] = []
                for frame in self._come(left):
                    (self._samples if frame.name == "sample" else others).append(frame)
                for frame in others:
                    refused = frame.values.get("refused") if _fits(name, own, frame, values) else 0
                    if refused:
                        found = _WORDS[REFUSALS.get(refused, "unknown")]
                        raise BoardError(f"{self.name}: the board refuses {name}: {found}")
                    if frame.name == answer and _fits(name, own, frame, values):
                        self.trips.append(time.monotonic() - began)
                        return dict(frame.values)
        waited = tries * again
        raise BoardError(f"{self.name}: no answer to {name} within {waited:g} s")

    def greet(self, params: Board) -> dict[str, Any]:
        """Identify the board."""
        try:
            who = self.ask("hello", "identity", tries=12, version=VERSION)
        except BoardError as error:
            found = f"{error}: is it a board with this firmware, at this port? (docs/board.md)"
            raise BoardError(found) from None
        layout = control.layout(params)
        if (who["version"], who["firmware"], who["layout"]) != (VERSION, FIRMWARE, layout):
            uno = protocol.BOARDS.get(who["board"], _UNO) == _UNO
            file = "the file of `macromicro export hex`" if uno else "a new build"
            age = "older" if (who["version"], who["firmware"]) < (VERSION, FIRMWARE) else "other"
            raise BoardError(
                f"{self.name}: the board's firmware is {age}: protocol {who['version']}, firmware "
                f"{who['firmware']}, layout {who['layout']}; this package needs protocol "
                f"{VERSION}, firmware {FIRMWARE}, layout {layout}: flash {file} "
                "(docs/board.md)"
            )
        return who

    def configure(self, params: Board) -> None:
        """Write all parameters and verify them."""
        names = control.flat(params)
        for index, (name, value) in enumerate(names.items()):
            stored = self.ask("set", "parameter", index=index, value=value)["value"]
            if stored != control.single(value):
                found = f"{name} was written as {value:g} and read back as {stored:g}"
                raise BoardError(f"{self.name}: {found}")

    def sample(self, patience: float) -> Frame:
        """The newest sample, once there is one."""
        began = time.monotonic()
        while not self._samples:
            left = began + patience - time.monotonic()
            if left <= 0.0:
                raise BoardError(f"{self.name}: no sample for {patience:g} s")
            self._samples += [f for f in self._come(min(left, 1.0)) if f.name == "sample"]
        if self.port.in_waiting:
            self._samples += [f for f in self._come(0.0) if f.name == "sample"]
        newest = self._samples[-1]
        self._samples.clear()
        return newest

    def forget(self) -> None:
        """Drop samples that came before the last answer."""
        self._samples.clear()

    def close(self) -> None:
        self.port.close()


def _fits(name: str, own: int, frame: Frame, values: dict[str, float]) -> bool:
    """Whether a frame answers this request, and not one before it."""
    if frame.name == "done":
        return bool(frame.values["id"] == own)
    if frame.name != "parameter":
        return True
    return name not in ("get", "set") or bool(frame.values["index"] == values["index"])
