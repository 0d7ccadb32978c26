"""Ctrl-C, SIGTERM and SIGHUP: what a command does with them."""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType, TracebackType
from typing import Any, Self

INTERRUPTED = 128


class Signals:
    """Ctrl-C (SIGINT), SIGTERM and, unless it is ignored (nohup), SIGHUP: before `later` nothing
    is open and the process ends there and then, without unwinding through a compiler at work;
    after it the first one is only noted, so that the recording and the report are completed,
    and a second one is at once.
    """

    def __init__(self) -> None:
        self.received = 0
        self._patient = False
        self._words = ""
        self._before: dict[int, Any] = {}

    @property
    def status(self) -> int:
        """Exit status of a run that a signal ended; 0 without one."""
        return INTERRUPTED + self.received if self.received else 0

    def later(self, words: str = "") -> None:
        """From now on let the first signal wait, and answer it at once with `words`."""
        self._patient, self._words = True, words

    def _receive(self, number: int, frame: FrameType | None) -> None:
        again = self.received
        self.received = number
        if not self._patient:
            print("macromicro: interrupted", file=sys.stderr, flush=True)
            folder = sys.modules.get("macromicro.runs.folder")
            if folder is not None:
                folder.tidy()
            os._exit(self.status)
        if again:
            raise KeyboardInterrupt
        if self._words:  # a handler must not print: what it interrupts may be printing
            os.write(2, f"macromicro: {self._words}\n".encode())

    def __enter__(self) -> Self:
        hangup = signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN
        for number in (signal.SIGINT, signal.SIGTERM, *([signal.SIGHUP] if hangup else [])):
            self._before[number] = signal.signal(number, self._receive)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
