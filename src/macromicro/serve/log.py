"""Log to stderr or systemd's journal, and to a file."""

from __future__ import annotations

import contextlib
import logging
import os
import queue
import sys
from logging.handlers import QueueHandler, QueueListener, RotatingFileHandler
from pathlib import Path
from typing import Any, Self

from macromicro.errors import ProblemError
from macromicro.schema.text import printable
from macromicro.serve._ledger import LOG

BYTES, FILES = 4_000_000, 5  # of each file, and how many: nothing grows beyond
WAITING = 10_000  # lines; further ones are dropped rather than wait for a disk
_LINE = "%(asctime)s %(levelname)s %(message)s"
_SYSLOG = ((logging.CRITICAL, 2), (logging.ERROR, 3), (logging.WARNING, 4), (logging.INFO, 6))


class Log:
    """Writes the log to stderr (or systemd's journal) and to a rotating file; a context manager."""

    def __init__(self, file: Path | None) -> None:
        self._handlers: list[logging.Handler] = [_Stderr()]
        if file is not None:
            try:
                file.parent.mkdir(parents=True, exist_ok=True)
                made = _File(file, maxBytes=BYTES, backupCount=FILES - 1, encoding="utf-8")
            except OSError as error:
                where = f"--log {printable(file, 300)}"
                problem = f"cannot be written ({error.strerror or error})"
                remedy = "Choose a file in a folder that you may write to."
                raise ProblemError(where, problem, remedy) from None
            made.setFormatter(logging.Formatter(_LINE))
            self._handlers.append(made)
        lines: queue.Queue[Any] = queue.Queue(WAITING)
        self._entry = _Queue(lines)
        self._listener = QueueListener(lines, *self._handlers, respect_handler_level=True)
        self._before = LOG.level, LOG.propagate

    def __enter__(self) -> Self:
        LOG.setLevel(logging.INFO)
        LOG.propagate = False
        LOG.addHandler(self._entry)
        self._listener.start()
        return self

    def __exit__(self, *_: object) -> None:
        LOG.removeHandler(self._entry)
        self._listener.stop()
        LOG.level, LOG.propagate = self._before
        for handler in self._handlers:
            with contextlib.suppress(OSError):  # the disk is full
                handler.close()


class _Queue(QueueHandler):
    def enqueue(self, record: logging.LogRecord) -> None:
        with contextlib.suppress(queue.Full):  # the disk is too slow
            self.queue.put_nowait(record)

    def handleError(self, record: logging.LogRecord) -> None:
        pass  # a log that fails must not disturb what it reports


class _File(RotatingFileHandler):
    def handleError(self, record: logging.LogRecord) -> None:
        pass  # with a full disk the recording reports it


class _Stderr(logging.StreamHandler[Any]):
    """Plain text for a person, repeated messages once; with levels for the journal."""

    def __init__(self) -> None:
        super().__init__(sys.stderr)
        self._journal = to_journal()
        self._told: dict[str, None] = {}
        self.setLevel(logging.INFO if self._journal else logging.WARNING)

    def format(self, record: logging.LogRecord) -> str:
        text = record.getMessage()
        if not self._journal:
            return f"macromicro: {text}"
        number = next((n for level, n in _SYSLOG if record.levelno >= level), 7)
        return f"<{number}>{text}"

    def filter(self, record: logging.LogRecord) -> Any:
        """Show a repeated problem once on a terminal."""
        text = record.getMessage()
        if self._journal or text not in self._told:
            self._told[text] = None
            while len(self._told) > 100:
                del self._told[next(iter(self._told))]
            return super().filter(record)
        return False

    def handleError(self, record: logging.LogRecord) -> None:
        pass  # the terminal is gone


def to_journal() -> bool:
    """Whether systemd's journal reads stderr (systemd.exec(5), JOURNAL_STREAM)."""
    try:
        found = os.fstat(sys.stderr.fileno())
    except (OSError, ValueError):
        return False
    return os.environ.get("JOURNAL_STREAM", "") == f"{found.st_dev}:{found.st_ino}"
