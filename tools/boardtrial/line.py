"""The line to the board, with a judge at the board's end of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from boardsim.wire import Wire
from boardtrial.judge import Judge
from macromicro.rig.board import framing, protocol
from macromicro.rig.board.protocol import Frame


class Line(Wire):
    """A wire whose judge sees what comes, and each period.

    Parameters
    ----------
    judge : Judge
        Of its bench.
    """

    def __init__(self, judge: Judge) -> None:
        super().__init__(judge.bench)
        self.judge = judge
        self.look: Callable[[], None] | None = None  # called after each period

    def put(self, data: bytes) -> None:
        """Bytes for the board."""
        self.judge.bytes_for_board(data)
        super().put(data)

    def _period(self) -> bytes:
        sent = super()._period()
        self.trace.clear()  # it would hold hours
        self.judge.period()
        if self.look is not None:
            self.look()
        return sent


class Host:
    """A host that says what it likes, as frames.

    Parameters
    ----------
    line : Line
        To the board.
    """

    TRIES = 6

    def __init__(self, line: Line) -> None:
        self.line = line
        self.sample: dict[str, Any] = {}
        self.bad = self.unanswered = self.orders = 0
        self._stream, self._sequence = framing.Stream(), 0

    def tell(self, name: str, **values: float) -> list[Frame]:
        """Send a frame; what the board has sent meanwhile."""
        self._sequence += 1
        self.orders += 1
        self.line.write(protocol.encode(name, self._sequence, **values))
        return self.listen()

    def listen(self) -> list[Frame]:
        """What the board has sent."""
        found = []
        for body in self._stream.take(self.line.read(self.line.in_waiting)):
            frame = protocol.decode(body)
            if frame is None:
                continue
            if frame.name == "sample":
                self.sample = frame.values
            found.append(frame)
        self.bad = self._stream.bad
        return found

    def ask(self, name: str, answer: str, **values: float) -> dict[str, Any] | None:
        """Send a request until it is answered; None if it never is."""
        for _ in range(self.TRIES):
            for frame in self.tell(name, **values):
                same = frame.name != "done" or frame.values["id"] == protocol.HOST[name].id
                other = frame.name == "parameter" and frame.values["index"] != values.get("index")
                if frame.name == answer and same and not other:
                    return frame.values
        self.unanswered += 1
        return None
