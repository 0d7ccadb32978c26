"""What a command is: one entry of the table that the parser and the manual are made from."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

from macromicro.serve.scpi.parameters import Parameter

if TYPE_CHECKING:
    from macromicro.serve.scpi.session import Session

WATCH = "all"  # every client
CHANGE = "token"  # who has given the token, where there is one
CONTROL = "control"  # who holds control, the token given
ALWAYS = "all, at once"  # every client, before all that waits


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
    units; `access`: who may; `waits`: only once all motions of this client have ended;
    `cost`: of how many simple commands in the rate limit."""

    header: str
    act: Handler
    text: str
    parameters: tuple[Parameter, ...] = ()
    answer: str = ""
    access: str = WATCH
    waits: bool = False
    cost: int = 1

    @property
    def query(self) -> bool:
        """Does it answer?"""
        return self.header.endswith("?")
