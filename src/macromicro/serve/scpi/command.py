"""An entry of the table behind parser and manual."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any, NamedTuple

from macromicro.serve.requests import EVERYONE
from macromicro.serve.scpi._parameters import Parameter
from macromicro.serve.scpi._session import Session

NOT_A_NUMBER = "9.91E37"  # SCPI-99, volume 1, 7.2.1.5
INFINITE = "9.9E37"


def number(x: float, digits: int = 9) -> str:
    if math.isnan(x):
        return NOT_A_NUMBER
    if math.isinf(x):
        return INFINITE if x > 0 else f"-{INFINITE}"
    return f"{x:.{digits}g}".replace("e", "E")


def numbers(*xs: float) -> str:
    return ",".join(number(x) for x in xs)


def flag(on: bool) -> str:
    return "1" if on else "0"


def block(data: bytes) -> bytes:
    """Definite-length arbitrary block response data (IEEE 488.2, 8.7.9)."""
    length = str(len(data)).encode()
    return b"#" + str(len(length)).encode() + length + data


class Call(NamedTuple):
    """One command to be executed: session, values, numeric suffixes."""

    session: Session
    values: tuple[Any, ...]
    suffixes: tuple[int, ...]


Answer = str | bytes | None
Handler = Callable[[Call], Answer | Awaitable[Answer]]  # what orders is a coroutine


class Command(NamedTuple):
    """One SCPI command."""

    header: str  # pattern in SCPI notation
    act: Handler  # returns the response of a query
    text: str
    parameters: tuple[Parameter, ...] = ()
    answer: str = ""  # what a query answers, with units
    access: str = EVERYONE
    waits: bool = False  # until all motions of this client have ended
    cost: int = 1  # in simple commands, for the rate limit
    streamed: bool = False  # done at once where no earlier command waits
    blocks: bool = False  # it waits for a disk or computes for long: `act` runs on a thread

    @property
    def query(self) -> bool:
        return self.header.endswith("?")


_WORDS: dict[str, dict[str, str]] = tomllib.loads(
    Path(__file__).with_name("commands.toml").read_text(encoding="utf-8")
)


def command(
    header: str, act: Handler, parameters: tuple[Parameter, ...] = (), **rest: Any
) -> Command:
    """A command with its words."""
    words = _WORDS[header]
    return Command(header, act, words["text"], parameters, words.get("answer", ""), **rest)


def mnemonic(name: str) -> str:
    """The name of a stage as a node of a header, with its short form in capitals."""
    return f"{name[:4].upper()}{name[4:]}"
