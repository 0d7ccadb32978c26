"""Parses a message completely before any of it is executed."""

from __future__ import annotations

import re
from collections.abc import Generator
from typing import Any, NamedTuple

from macromicro.serve.requests import CONTROL, STOPS
from macromicro.serve.scpi._data import BLANK, elements, shown
from macromicro.serve.scpi._header import Tree
from macromicro.serve.scpi._parameters import read
from macromicro.serve.scpi.command import Command
from macromicro.serve.scpi.errors import ScpiError

MOST_UNITS = 1000
SLICE = 10  # units that are read in one go
LONGEST_HEADER = 200  # of ten mnemonics and more
_HEADER = re.compile(rb"\*[A-Za-z]+\??|:?[A-Za-z][A-Za-z0-9_]*(?::[A-Za-z][A-Za-z0-9_]*)*\??")

_SEPARATORS = re.compile(b"[;" + re.escape(BLANK) + b"]*")


class Unit(NamedTuple):
    """One command with its values."""

    command: Command
    values: tuple[Any, ...]
    suffixes: tuple[int, ...]


class Message(NamedTuple):
    """The commands of a message; after an `error` only its stops remain."""

    units: tuple[Unit, ...]
    error: ScpiError | None = None
    size: int = 1

    @property
    def cost(self) -> int:
        """In simple commands."""
        return max(1, self.size, sum(u.command.cost for u in self.units))

    def parted(self) -> tuple[tuple[Unit, ...], tuple[Unit, ...]]:
        """The stops that may overtake earlier messages, and the rest."""
        first = next((k for k, u in enumerate(self.units) if _ordered(u)), len(self.units))
        head = self.units[:first]
        kinds = {u.command.act: u for u in reversed(head) if u.command.access == STOPS}
        urgent = tuple(reversed(kinds.values()))
        rest = tuple(u for u in head if u.command.access != STOPS)
        return urgent, rest + self.units[first:]


def _ordered(unit: Unit) -> bool:
    return unit.command.access == CONTROL or unit.command.waits


def parse(tree: Tree, message: bytes) -> Message:
    """The commands of a message without its newline; errors are in the result."""
    slices = reading(tree, message)
    while True:
        try:
            next(slices)
        except StopIteration as end:
            found: Message = end.value
            return found


def reading(tree: Tree, message: bytes) -> Generator[int, None, Message]:
    """`parse` in slices; yields the number of units after each."""
    units: list[Unit] = []
    error: ScpiError | None = None
    path: tuple[str, ...] = ()
    place = size = 0
    while place < len(message):
        start = _between(message, place)
        if start >= len(message):
            break
        if size and size % SLICE == 0:
            yield SLICE
        size += 1
        if size > MOST_UNITS:
            error = error or ScpiError(-363, f"at most {MOST_UNITS} commands in a message")
            break
        try:
            unit, path, place = _unit(tree, message, start, path)
            units.append(unit)
        except ScpiError as found:
            error = error or found
            # Where a broken unit ends is not known for sure; a stop behind it is still heard.
            end = message.find(b";", start)
            place, path = (len(message) if end < 0 else end + 1), ()
    if error is not None:
        units = [u for u in units if u.command.access == STOPS]
    return Message(tuple(units), error, size)


def _between(message: bytes, place: int) -> int:
    """Where the next unit begins, or the message ends."""
    found = _SEPARATORS.match(message, place)
    assert found is not None  # it matches nothing, too
    return found.end()


def _unit(
    tree: Tree, message: bytes, place: int, path: tuple[str, ...]
) -> tuple[Unit, tuple[str, ...], int]:
    """The unit at `place`, the path after it and its end."""
    header = _HEADER.match(message, place)
    if header is None:
        number = -102 if message[place] < 0x7F else -101
        raise ScpiError(number, f"{shown(message, place)}; a header was expected")
    if len(header[0]) > LONGEST_HEADER:
        raise ScpiError(-112, shown(header[0]))
    found = tree.find(header[0].decode(), path)
    end = header.end()
    if end < len(message) and message[end] not in BLANK + b";":
        raise ScpiError(-102, f"{shown(message, end)} behind {shown(header[0])}")
    given, end = elements(message, end)
    values = read(found.command.parameters, given)
    return Unit(found.command, values, found.suffixes), found.path, min(end + 1, len(message))
