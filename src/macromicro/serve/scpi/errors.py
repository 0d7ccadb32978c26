"""SCPI's error numbers and error queue (SCPI-99, volume 2, 21.8)."""

from __future__ import annotations

import tomllib
from collections import deque
from pathlib import Path
from typing import NamedTuple

_TABLE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
TEXTS: dict[int, str] = {int(number): text for number, text in _TABLE.items()}
LONGEST = 255  # of description and detail together (21.8.1)
QUEUE = 32

OPERATION_COMPLETE, QUERY, DEVICE, EXECUTION, COMMAND, POWER_ON = 1, 4, 8, 16, 32, 128


class ScpiError(Exception):
    """A failed command: a standard number and details."""

    def __init__(self, number: int, detail: str = "") -> None:
        super().__init__(number, detail)
        self.number = number
        self.detail = detail


class Entry(NamedTuple):
    """An error in the queue."""

    number: int
    text: str

    def shown(self) -> str:
        """As `SYSTem:ERRor?` answers it."""
        return f"{self.number},{quote(self.text)}"


def quote(text: str) -> str:
    """String response data: printable ASCII in double quotes, quotes in it doubled."""
    safe = "".join(c if " " <= c <= "~" else "?" for c in text)
    return '"' + safe.replace('"', '""') + '"'


def event_bit(number: int) -> int:
    """The bit of the standard event status register that an error sets (IEEE 488.2, 11.5.1)."""
    bits = {1: COMMAND, 2: EXECUTION, 3: DEVICE, 4: QUERY}
    return bits.get(-number // 100, 0)


class ErrorQueue:
    """First in, first out; the last entry of a full queue becomes -350 (21.8.1)."""

    def __init__(self) -> None:
        self._entries: deque[Entry] = deque()

    def put(self, error: ScpiError) -> int:
        """Append an error; the number queued, -350 on overflow."""
        if len(self._entries) >= QUEUE:
            self._entries[-1] = Entry(-350, TEXTS[-350])
            return -350
        detail = f";{error.detail}" if error.detail else ""
        self._entries.append(Entry(error.number, f"{TEXTS[error.number]}{detail}"[:LONGEST]))
        return error.number

    def get(self) -> Entry:
        """Take the oldest error; 0 "No error" if empty."""
        return self._entries.popleft() if self._entries else Entry(0, TEXTS[0])

    def clear(self) -> None:
        self._entries.clear()

    def __len__(self) -> int:
        return len(self._entries)
