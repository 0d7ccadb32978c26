"""Signals that would end the process first make the outputs safe."""

from __future__ import annotations

import signal
import threading
from types import FrameType
from typing import Any

_NUMBERS = (signal.SIGINT, signal.SIGTERM)


class Unwinding:
    """Turns the first Ctrl-C or SIGTERM after `begin` into KeyboardInterrupt; `end` re-sends it.

    Outside the main thread nothing changes: only that thread receives signals.
    """

    def __init__(self) -> None:
        self._before: dict[int, Any] = {}
        self._received = 0
        self._held = False

    def begin(self) -> None:
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
        """Hold further signals back."""
        self._held = True

    def end(self) -> None:
        """Restore the handlers and re-send a held signal."""
        before, self._before = self._before, {}
        for number, handler in before.items():
            signal.signal(number, handler)
        self._held = False
        received, self._received = self._received, 0
        if received:
            signal.raise_signal(received)
