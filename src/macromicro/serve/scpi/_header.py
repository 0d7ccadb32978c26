"""Headers in SCPI notation ("SYSTem:ERRor[:NEXT]?") and the tree that finds them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from itertools import product
from typing import NamedTuple

from macromicro.serve.requests import STOPS
from macromicro.serve.scpi._data import shown
from macromicro.serve.scpi._parameters import spellings
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


def written(pattern: str) -> Iterator[tuple[tuple[str, ...], tuple[tuple[int, int] | None, ...]]]:
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
            for names, ranges in written(command.header):
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
                raise ScpiError(-113, shown(header))
            return Found(entry[0], (), path)
        mnemonics = tuple(text.removeprefix(":").split(":"))
        if any(len(m) > LONGEST_MNEMONIC for m in mnemonics):
            raise ScpiError(-112, shown(header))
        whole = mnemonics if text.startswith(":") else (*path, *mnemonics)
        matches = [_MNEMONIC.fullmatch(m) for m in whole]
        names = tuple(m[1] if m else "" for m in matches)
        entry = self._known.get((names, query))
        if entry is None and path and not query:
            plain = self._known.get((mnemonics, query))
            if plain is not None and plain[0].access == STOPS:
                return Found(plain[0], (), mnemonics[:-1])
        if entry is None:
            raise ScpiError(-113, shown(header))
        digits = [m[2] if m else "" for m in matches]
        return Found(entry[0], tuple(_suffixes(header, digits, entry[1])), whole[:-1])


def _suffixes(
    header: str, digits: list[str], ranges: tuple[tuple[int, int] | None, ...]
) -> Iterator[int]:
    """The numeric suffix of each node that has one, 1 by default (SCPI-99, 6.2.5)."""
    for text, allowed in zip(digits, ranges, strict=True):
        if allowed is None:
            if text:
                raise ScpiError(-114, shown(header))
            continue
        number = int(text or "1")
        if not allowed[0] <= number <= allowed[1]:
            accepted = f"{allowed[0]} to {allowed[1]}"
            raise ScpiError(-114, f"{shown(header)}; accepted: {accepted}")
        yield number
