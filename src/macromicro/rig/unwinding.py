"""While a rig is open, a signal that would end the process first lets the outputs go safe."""

from __future__ import annotations

import signal
import threading
from types import FrameType
from typing import Any

_NUMBERS = (signal.SIGINT, signal.SIGTERM)


class Unwinding:
    """From `begin` on, the first Ctrl-C or SIGTERM raises KeyboardInterrupt, so that whoever has
    a rig open leaves it; `leaving` holds further ones back; `end` sends the signal again, to
    whom it was meant for.

    A signal that was ignored stays so. Outside the main thread nothing is changed: only that
    thread receives signals.
    """

    def __init__(self) -> None:
        self._before: dict[int, Any] = {}
        self._received = 0
        self._held = False

    def begin(self) -> None:
        """Take over."""
        if threading.current_thread() is not threading.main_thread():
            return
        for number in _NUMBERS:
            # None: a handler that is not Python's, and cannot be put back.
            if signal.getsignal(number) not in (signal.SIG_IGN, None):
                self._before[number] = signal.signal(number, self._receive)

    def _receive(self, number: int, frame: FrameType | None) -> None:
        first = not self._received
        self._received = self._received or number
        if first and not self._held:
            raise KeyboardInterrupt

    def leaving(self) -> None:
        """From now on nothing may interrupt."""
        self._held = True

    def end(self) -> None:
        """Give back; a signal that came meanwhile takes its course."""
        before, self._before = self._before, {}
        for number, handler in before.items():
            signal.signal(number, handler)
        self._held = False
        received, self._received = self._received, 0
        if received:
            signal.raise_signal(received)
