"""SCPI's error numbers and error queue (SCPI-99, volume 2, 21.8)."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

TEXTS = {
    0: "No error",
    -100: "Command error",
    -101: "Invalid character",
    -102: "Syntax error",
    -103: "Invalid separator",
    -104: "Data type error",
    -108: "Parameter not allowed",
    -109: "Missing parameter",
    -112: "Program mnemonic too long",
    -113: "Undefined header",
    -114: "Header suffix out of range",
    -121: "Invalid character in number",
    -123: "Exponent too large",
    -124: "Too many digits",
    -131: "Invalid suffix",
    -134: "Suffix too long",
    -138: "Suffix not allowed",
    -144: "Character data too long",
    -151: "Invalid string data",
    -161: "Invalid block data",
    -178: "Expression data not allowed",
    -200: "Execution error",
    -203: "Command protected",
    -221: "Settings conflict",
    -222: "Data out of range",
    -223: "Too much data",
    -224: "Illegal parameter value",
    -240: "Hardware error",
    -241: "Hardware missing",
    -250: "Mass storage error",
    -256: "File name not found",
    -257: "File name error",
    -282: "Illegal program name",
    -285: "Program syntax error",
    -310: "System error",
    -350: "Queue overflow",
    -363: "Input buffer overrun",
}
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
        return f"{self.number},{quoted(self.text)}"


def quoted(text: str) -> str:
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
