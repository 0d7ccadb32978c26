"""What a command does on Ctrl-C, SIGTERM and SIGHUP."""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType, TracebackType
from typing import Any, Self

INTERRUPTED = 128
CURSOR = b"\x1b[?25h"  # shows what a progress bar has hidden


class Signals:
    """Ctrl-C (SIGINT), SIGTERM and, unless ignored (nohup), SIGHUP.

    Before `later` the process ends at once, without unwinding through a running compiler.
    After it the first signal is only noted, so that recording and report are completed; a
    second one ends the process.
    """

    def __init__(self) -> None:
        self.received = 0
        self._patient = self._ignoring = False
        self._words = ""
        self._before: dict[int, Any] = {}

    @property
    def status(self) -> int:
        """Exit status of a run that a signal ended; 0 without one."""
        return INTERRUPTED + self.received if self.received else 0

    def later(self, words: str = "") -> None:
        """Defer the first signal from now on, and print `words` when it comes."""
        self._patient, self._words = True, words

    def ignore(self) -> None:
        """Ignore signals from now on, for work that ends soon by itself."""
        self._ignoring = True

    def _receive(self, number: int, frame: FrameType | None) -> None:
        if self._ignoring:
            return
        again = self.received
        self.received = number
        if not self._patient:
            if sys.stderr.isatty():
                os.write(2, CURSOR)
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
        for name in ("SIGINT", "SIGTERM", "SIGHUP"):
            number = getattr(signal, name, None)  # Windows has no SIGHUP
            if number is not None and (
                name != "SIGHUP" or signal.getsignal(number) is not signal.SIG_IGN
            ):
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
