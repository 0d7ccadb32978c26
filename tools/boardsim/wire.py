"""The line between host and simulated board: time passes as the host speaks.

Each frame of the host lets one control period pass, a request as many as it takes to be answered,
and without a frame the simulated time stands still: what happens is the same on a fast and on a
slow machine.
"""

from __future__ import annotations

import random

import numpy as np

from boardsim.bench import Bench
from macromicro.rig.board import framing
from macromicro.rig.board.protocol import BOARD, HOST

ANSWERED = 40  # periods within which the board answers a request
LATEST = 5  # periods within which a board that streams sends the next sample
_SAMPLE = BOARD["sample"].id
_STREAMED = tuple(HOST[name].id for name in ("outputs", "targets", "keep"))


class Wire:
    """A bench behind a line, as the serial port of a `macromicro.rig.board._link.Link`.

    Parameters
    ----------
    bench : Bench
        The board and what it drives.
    flips : float, optional
        Probability that a bit of a byte on the line is turned over, either way.
    seed : int, optional
        Of that.
    """

    def __init__(self, bench: Bench, flips: float = 0.0, seed: int = 0) -> None:
        self.bench, self.flips = bench, flips
        self.timeout: float | None = None
        self.connected = True  # False: the line is cut
        self.trace: list[np.ndarray] = []  # outputs of each period
        self._random = random.Random(seed)
        self._rest, self._come = b"", b""
        self._stream, self._streams = framing.Stream(), False

    @property
    def in_waiting(self) -> int:
        """Bytes for the host."""
        return len(self._come)

    def read(self, size: int = 1) -> bytes:
        """Bytes of the board; none if there are none: waiting would not bring any."""
        found, self._come = self._come[:size], self._come[size:]
        return found

    def write(self, data: bytes) -> int:
        """Bytes of the host; each frame that ends lets time pass."""
        *ended, self._rest = (self._rest + data).split(b"\0")
        for part in ended:
            self.frame(part + b"\0")
        return len(data)

    def close(self) -> None:
        """The host has gone."""

    def alone(self, periods: int) -> None:
        """Time passes without a word of the host.

        Parameters
        ----------
        periods : int
            How many.
        """
        for _ in range(periods):
            self._period()

    def put(self, data: bytes) -> None:
        """Bytes at the board's end of the line, whatever they are; no time passes.

        Parameters
        ----------
        data : bytes
            They come one after the other from now on.
        """
        self.bench.avr.put(data)

    def _period(self) -> bytes:
        self.bench.period()
        self.trace.append(self.bench.outputs())
        return self.bench.avr.take()

    def frame(self, frame: bytes) -> None:
        """A frame of the host.

        Parameters
        ----------
        frame : bytes
            With its zero.
        """
        if self.connected:
            self.put(self._flipped(frame))
        body = framing.unframe(frame[:-1])
        request = body is not None and body[0] not in _STREAMED
        most = ANSWERED if request else LATEST if self._streams else 1
        passed = 0
        while passed < most:
            sent = self._period()
            shown = self._flipped(sent)
            if self.connected:
                self._come += shown
            passed += 1
            ids = [body[0] for body in self._stream.take(sent)]
            self._streams = self._streams or _SAMPLE in ids
            whole = sent == shown or not self.connected  # else the host cannot answer it
            if request and any(each != _SAMPLE for each in ids):
                break
            if not request and _SAMPLE in ids and whole:
                break
        else:
            self._streams = self._streams and request

    def _flipped(self, data: bytes) -> bytes:
        if not self.flips:
            return data
        return bytes(
            byte ^ 1 << self._random.randrange(8) if self._random.random() < self.flips else byte
            for byte in data
        )
