"""Channels with a function behind what clients put into them."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from contextvars import ContextVar
from typing import Any

from caproto import AccessRights, ChannelDouble, ChannelEnum, ChannelInteger, ChannelString

Put = Callable[[Any], Awaitable[Any]]
Address = tuple[str, int]
WRITER: ContextVar[Address | None] = ContextVar("WRITER", default=None)  # whose put is being done
SENT_S = 0.1  # in which the server has sent what was shown: it gathers news for some 10 ms


class _Own:
    """`put`: what a client's value does, which is raised to the client where it fails, and what
    the channel's value is after it, by default the client's; None for a channel that is read
    only, to which clients' writes are refused."""

    put: Put | None = None

    def check_access(self, hostname: str, username: str) -> AccessRights:
        """Who may write."""
        return AccessRights.READ if self.put is None else AccessRights.READ | AccessRights.WRITE

    async def auth_write(self, *given: Any, user_address: Any = None, **rest: Any) -> Any:
        """What a client at an address writes."""
        WRITER.set(user_address)
        return await super().auth_write(*given, user_address=user_address, **rest)  # type: ignore[misc]

    async def verify_value(self, data: Any) -> Any:
        """Do what a client has put."""
        after = None
        if self.put is not None:
            one = isinstance(data, list | tuple) and len(data) == 1
            try:
                after = await self.put(data[0] if one else data)
            finally:
                # Its reply must not overtake the news of its end: a client would take that DMOV
                # for the end of its next move.
                await asyncio.sleep(SENT_S)
        return self._after(data) if after is None else after

    def _after(self, data: Any) -> Any:
        return data


class Double(_Own, ChannelDouble):  # type: ignore[misc]
    """A number, or an array of them."""


class Integer(_Own, ChannelInteger):  # type: ignore[misc]
    """A whole number; where clients may put one, a button, which is 0 again."""

    def _after(self, data: Any) -> Any:
        return 0


class Text(_Own, ChannelString):  # type: ignore[misc]
    """A text of 39 characters; what is longer is cut."""


class Choice(_Own, ChannelEnum):  # type: ignore[misc]
    """One of some words."""


def channel(value: Any, put: Put | None = None, **rest: Any) -> Any:
    """The channel of a value, by its type; `enum_strings` makes it a choice."""
    if "enum_strings" in rest:
        kind: Any = Choice
    elif isinstance(value, str):
        kind = Text
    else:
        kind = Double if isinstance(value, float | list) else Integer
    made = kind(value=value, **rest)
    made.put = put
    return made


async def show(made: Any, value: Any, **rest: Any) -> None:
    """Publish a value of the machine's, where it is another one."""
    if isinstance(value, str):
        value = value.encode("ascii", "replace").decode()[:39]
    before = made.value
    before = before[0] if isinstance(before, list) and len(before) == 1 else before
    if rest or before != value:
        await made.write(value, verify_value=False, **rest)
