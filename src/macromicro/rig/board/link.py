"""A board at a serial port: requests and their answers, samples."""

from __future__ import annotations

import time
from typing import Any, Protocol

from macromicro.errors import MacromicroError
from macromicro.extras import remedy
from macromicro.rig.board import parameters, protocol
from macromicro.rig.board.control import Board
from macromicro.rig.board.framing import Stream
from macromicro.rig.board.protocol import BAUD, FIRMWARE, REFUSALS, VERSION, Frame

GREETING = 0.25  # s between hellos, until the board answers; a bootloader takes a second or two
ANSWER = 0.5  # s until a request is made again
TRIES = 8
_UNO = "atmega328p"
_WORDS = {
    "version": "it speaks another version of the protocol",
    "driving": "its outputs are on",
    "parameters": "its parameters are not those that were written",
    "index": "it has no such parameter",
    "unknown": "it does not know this request",
}


class BoardError(MacromicroError):
    """The board is missing, refused, fell silent or stopped; the message says why."""


class Port(Protocol):
    """What is needed of a serial port; pyserial's `Serial` has it."""

    timeout: float | None

    def read(self, size: int = 1) -> bytes:
        """Bytes that came.

        Parameters
        ----------
        size : int, optional
            How many to wait for.

        Returns
        -------
        bytes
            Fewer after the timeout.
        """

    def write(self, data: bytes) -> Any:
        """Send.

        Parameters
        ----------
        data : bytes
            All of it.

        Returns
        -------
        Any
            Not used.
        """

    @property
    def in_waiting(self) -> int:
        """How many bytes have come."""

    def close(self) -> None:
        """Let it go."""


def opened(device: str) -> Port:
    """A serial port at the protocol's speed.

    Parameters
    ----------
    device : str
        "/dev/ttyUSB0", "COM3".

    Returns
    -------
    Port
        Open. Most Arduinos reset as it is opened.

    Raises
    ------
    BoardError
        It cannot be opened, or pyserial is missing.
    """
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
    """Frames to and from a board.

    Parameters
    ----------
    port : Port
        Open.
    name : str
        Of it, for messages.
    patience : float, optional
        How long samples may stay away before that is an error, s.
    """

    def __init__(self, port: Port, name: str, patience: float = 5.0) -> None:
        self.port, self.name, self.patience = port, name, patience
        self.trips: list[float] = []  # how long the last answers took, s
        self._stream, self._sequence = Stream(), 0
        self._samples: list[Frame] = []

    @property
    def bad(self) -> int:
        """Frames of the board that were no good."""
        return self._stream.bad

    def tell(self, name: str, **values: float) -> None:
        """Send a frame.

        Parameters
        ----------
        name : str
            Of a message of the host.
        **values : float
            Its fields.

        Raises
        ------
        BoardError
            The port is gone.
        """
        self._sequence += 1
        try:
            self.port.write(protocol.told(name, self._sequence, **values))
        except OSError as error:
            raise BoardError(f"{self.name}: {error}") from None

    def _come(self, timeout: float) -> list[Frame]:
        """Frames that are there, or come until the timeout."""
        try:
            self.port.timeout = timeout
            data = self.port.read(max(self.port.in_waiting, 1))
        except OSError as error:
            raise BoardError(f"{self.name}: {error}") from None
        frames = (protocol.heard(body) for body in self._stream.take(data))
        return [frame for frame in frames if frame is not None]

    def ask(self, name: str, answer: str, tries: int = TRIES, **values: float) -> dict[str, Any]:
        """Send a request until it is answered.

        Parameters
        ----------
        name : str
            Of it.
        answer : str
            Of the board's message.
        tries : int, optional
            How often it is sent.
        **values : float
            Its fields; an answer with other values in the same fields answers something else.

        Returns
        -------
        dict[str, Any]
            The answer's fields.

        Raises
        ------
        BoardError
            No answer came, or a refusal.
        """
        own = protocol.HOST[name].id
        for _ in range(tries):
            self.tell(name, **values)
            began = time.monotonic()
            while (left := began + ANSWER - time.monotonic()) > 0.0:
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
        waited = tries * ANSWER
        raise BoardError(f"{self.name}: no answer to {name} within {waited:g} s")

    def greet(self, params: Board) -> dict[str, Any]:
        """Find out who is there.

        Parameters
        ----------
        params : Board
            Whose names the board must know.

        Returns
        -------
        dict[str, Any]
            Fields of `identity`.

        Raises
        ------
        BoardError
            Nobody, or a board with another firmware.
        """
        try:
            who = self.ask("hello", "identity", tries=12, version=VERSION)
        except BoardError as error:
            found = f"{error}: is it a board with this firmware, at this port? (docs/firmware.md)"
            raise BoardError(found) from None
        layout = parameters.layout(params)
        if (who["version"], who["firmware"], who["layout"]) != (VERSION, FIRMWARE, layout):
            uno = protocol.BOARDS.get(who["board"], _UNO) == _UNO
            file = "the file of `macromicro export hex`" if uno else "a new build"
            age = "older" if (who["version"], who["firmware"]) < (VERSION, FIRMWARE) else "other"
            raise BoardError(
                f"{self.name}: the board's firmware is {age}: protocol {who['version']}, firmware "
                f"{who['firmware']}, layout {who['layout']}; this package needs protocol "
                f"{VERSION}, firmware {FIRMWARE}, layout {layout}: flash {file} "
                "(docs/firmware.md)"
            )
        return who

    def configure(self, params: Board) -> None:
        """Write all parameters, and compare what the board has stored.

        Parameters
        ----------
        params : Board
            To be written.

        Raises
        ------
        BoardError
            One is stored otherwise.
        """
        names = parameters.flat(params)
        for index, (name, value) in enumerate(names.items()):
            stored = self.ask("set", "parameter", index=index, value=value)["value"]
            if stored != parameters.single(value):
                found = f"{name} was written as {value:g} and read back as {stored:g}"
                raise BoardError(f"{self.name}: {found}")

    def sample(self, *, newest: bool = False) -> Frame:
        """The next sample.

        Parameters
        ----------
        newest : bool, optional
            Leave those out that a newer one has overtaken.

        Returns
        -------
        Frame
            Of the board.

        Raises
        ------
        BoardError
            None came for too long.
        """
        began = time.monotonic()
        while not self._samples:
            left = began + self.patience - time.monotonic()
            if left <= 0.0:
                raise BoardError(f"{self.name}: no sample for {self.patience:g} s")
            self._samples += [f for f in self._come(min(left, 1.0)) if f.name == "sample"]
        if newest:
            if self.port.in_waiting:
                self._samples += [f for f in self._come(0.0) if f.name == "sample"]
            del self._samples[:-1]
        return self._samples.pop(0)

    def forget(self) -> None:
        """Leave out the samples that have come before the last answer."""
        self._samples.clear()

    def close(self) -> None:
        """Let the port go."""
        self.port.close()


def _fits(name: str, own: int, frame: Frame, values: dict[str, float]) -> bool:
    """Does a frame answer this request, and not one before it?"""
    if frame.name == "done":
        return bool(frame.values["id"] == own)
    if frame.name != "parameter":
        return True
    return name not in ("get", "set") or bool(frame.values["index"] == values["index"])
