"""Parses a message completely before any of it is executed."""

from __future__ import annotations

import re
from collections.abc import Generator, Iterable, Iterator
from itertools import product
from typing import Any, NamedTuple

from macromicro.serve.requests import CONTROL, STOPS
from macromicro.serve.scpi._data import BLANK, elements, excerpt
from macromicro.serve.scpi._parameters import read_values, spellings
from macromicro.serve.scpi.command import Command
from macromicro.serve.scpi.errors import ScpiError

LONGEST_MNEMONIC = 12  # IEEE 488.2, 7.6.1.4.1
_NODE = re.compile(r"(\[?):?([A-Za-z]+)(?:<n=(\d+)\.\.(\d+)>)?(\]?)")
_MNEMONIC = re.compile(r"([A-Z][A-Z_]*?)([0-9]*)")


class Node(NamedTuple):
    """One node of a pattern."""

    text: str
    optional: bool
    suffixes: tuple[int, int] | None  # first and last numeric suffix


class Found(NamedTuple):
    """A command, its numeric suffixes, and the path for the next header."""

    command: Command
    suffixes: tuple[int, ...]
    path: tuple[str, ...]


def nodes(pattern: str) -> tuple[Node, ...]:
    """The nodes of a pattern without its "?"."""
    return tuple(
        Node(m[2], bool(m[1]), (int(m[3]), int(m[4])) if m[3] else None)
        for m in _NODE.finditer(pattern.removesuffix("?"))
    )


def all_spellings(
    pattern: str,
) -> Iterator[tuple[tuple[str, ...], tuple[tuple[int, int] | None, ...]]]:
    """All spellings of a pattern: mnemonics in capitals, with suffix ranges."""
    if pattern.startswith("*"):
        yield (pattern.removesuffix("?").upper(),), (None,)
        return
    choices = []
    for node in nodes(pattern):
        ways: list[tuple[str, ...]] = [(name,) for name in dict.fromkeys(spellings(node.text))]
        choices.append([*ways, ()] if node.optional else ways)
    ranges = [node.suffixes for node in nodes(pattern)]
    for way in product(*choices):
        present = [r for r, names in zip(ranges, way, strict=True) if names]
        yield tuple(name for names in way for name in names), tuple(present)


class Tree:
    """Finds a command by its header in any spelling; ambiguous declarations raise ValueError."""

    def __init__(self, commands: Iterable[Command]) -> None:
        self._known: dict[
            tuple[tuple[str, ...], bool], tuple[Command, tuple[tuple[int, int] | None, ...]]
        ] = {}
        for command in commands:
            query = command.header.endswith("?")
            for names, ranges in all_spellings(command.header):
                if (names, query) in self._known:
                    raise ValueError(f"{command.header} is declared twice")
                self._known[names, query] = command, ranges

    def find(self, header: str, path: tuple[str, ...]) -> Found:
        """The command of a header relative to the path before it (IEEE 488.2, appendix A)."""
        text = header.upper()
        query = text.endswith("?")
        text = text.removesuffix("?")
        if text.startswith("*"):
            entry = self._known.get(((text,), query))
            if entry is None:
                raise ScpiError(-113, excerpt(header))
            return Found(entry[0], (), path)
        mnemonics = tuple(text.removeprefix(":").split(":"))
        if any(len(m) > LONGEST_MNEMONIC for m in mnemonics):
            raise ScpiError(-112, excerpt(header))
        whole = mnemonics if text.startswith(":") else (*path, *mnemonics)
        matches = [_MNEMONIC.fullmatch(m) for m in whole]
        names = tuple(m[1] if m else "" for m in matches)
        entry = self._known.get((names, query))
        if entry is None and path and not query:
            plain = self._known.get((mnemonics, query))
            if plain is not None and plain[0].access == STOPS:
                return Found(plain[0], (), mnemonics[:-1])
        if entry is None:
            raise ScpiError(-113, excerpt(header))
        digits = [m[2] if m else "" for m in matches]
        return Found(entry[0], tuple(_suffixes(header, digits, entry[1])), whole[:-1])


def _suffixes(
    header: str, digits: list[str], ranges: tuple[tuple[int, int] | None, ...]
) -> Iterator[int]:
    """The numeric suffix of each node that has one, 1 by default (SCPI-99, 6.2.5)."""
    for text, allowed in zip(digits, ranges, strict=True):
        if allowed is None:
            if text:
                raise ScpiError(-114, excerpt(header))
            continue
        number = int(text or "1")
        if not allowed[0] <= number <= allowed[1]:
            accepted = f"{allowed[0]} to {allowed[1]}"
            raise ScpiError(-114, f"{excerpt(header)}; accepted: {accepted}")
        yield number


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
        first = next((k for k, u in enumerate(self.units) if _is_order(u)), len(self.units))
        head = self.units[:first]
        kinds = {u.command.act: u for u in reversed(head) if u.command.access == STOPS}
        urgent = tuple(reversed(kinds.values()))
        rest = tuple(u for u in head if u.command.access != STOPS)
        return urgent, rest + self.units[first:]


def _is_order(unit: Unit) -> bool:
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
        raise ScpiError(number, f"{excerpt(message, place)}; a header was expected")
    if len(header[0]) > LONGEST_HEADER:
        raise ScpiError(-112, excerpt(header[0]))
    found = tree.find(header[0].decode(), path)
    end = header.end()
    if end < len(message) and message[end] not in BLANK + b";":
        raise ScpiError(-102, f"{excerpt(message, end)} behind {excerpt(header[0])}")
    given, end = elements(message, end)
    values = read_values(found.command.parameters, given)
    return Unit(found.command, values, found.suffixes), found.path, min(end + 1, len(message))
