"""What a command is: one entry of the table that the parser and the manual are made from."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from macromicro.serve.requests import EVERYONE
from macromicro.serve.scpi.parameters import Parameter
from macromicro.serve.scpi.session import Session


class Call(NamedTuple):
    """One command as it is to be done: whose, its values, its numeric suffixes."""

    session: Session
    values: tuple[Any, ...]
    suffixes: tuple[int, ...]


Answer = str | bytes | None
Handler = Callable[[Call], Answer]


class Command(NamedTuple):
    """`header`: pattern as SCPI writes it; `act`: what does it, returning the response data
    of a query; `text`: what it does; `parameters`; `answer`: what a query answers, with
    units; `access`: who may (of `serve.requests`); `waits`: only once all motions of this
    client have ended; `cost`: of how many simple commands in the rate limit."""

    header: str
    act: Handler
    text: str
    parameters: tuple[Parameter, ...] = ()
    answer: str = ""
    access: str = EVERYONE
    waits: bool = False
    cost: int = 1

    @property
    def query(self) -> bool:
        """Does it answer?"""
        return self.header.endswith("?")
