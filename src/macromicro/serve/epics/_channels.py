"""Channels that call a function when a client writes."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from contextvars import ContextVar
from typing import Any

from caproto import AccessRights, ChannelDouble, ChannelEnum, ChannelInteger, ChannelString
from caproto.asyncio.server import Context
from caproto.asyncio.utils import _TransportWrapper

from macromicro.serve.door._connection import Bounds, prepare

Put = Callable[[Any], Awaitable[Any]]
Address = tuple[str, int]
WRITER: ContextVar[Address | None] = ContextVar("WRITER", default=None)  # whose put is being done
SENT_S = 0.1  # in which the server has sent what was shown: it gathers news for some 10 ms


class _Own:
    """A channel; `put` turns a client's value into the channel's; without it, read-only."""

    put: Put | None = None

    def check_access(self, hostname: str, username: str) -> AccessRights:
        return AccessRights.READ if self.put is None else AccessRights.READ | AccessRights.WRITE

    async def auth_write(self, *given: Any, user_address: Any = None, **rest: Any) -> Any:
        WRITER.set(user_address)
        return await super().auth_write(*given, user_address=user_address, **rest)  # type: ignore[misc]

    async def verify_value(self, data: Any) -> Any:
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
    pass


class Integer(_Own, ChannelInteger):  # type: ignore[misc]
    """A whole number, or a button that resets to 0."""

    def _after(self, data: Any) -> Any:
        return 0


class Text(_Own, ChannelString):  # type: ignore[misc]
    """A text, cut to 39 characters."""


class Choice(_Own, ChannelEnum):  # type: ignore[misc]
    pass


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
    """Publish a value if it has changed."""
    if isinstance(value, str):
        value = value.encode("ascii", "replace").decode()[:39]
    before = made.value
    before = before[0] if isinstance(before, list) and len(before) == 1 else before
    if rest or before != value:
        await made.write(value, verify_value=False, **rest)


MOST = Bounds().silent
_BEGINS = b"\0\0"  # CA_PROTO_VERSION, a circuit's first message


class _Checked:
    """A circuit's stream that ends at once if it does not begin as Channel Access does."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream
        self._begun = False

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    async def recv(self, most: int = 4096) -> bytes:
        if self._begun:
            return bytes(await self._stream.recv(most))
        data = b""
        try:
            async with asyncio.timeout(Bounds().unread):
                while len(data) < len(_BEGINS):
                    more = await self._stream.recv(most)
                    if not more:
                        return b""
                    data += more
        except TimeoutError:
            return b""
        self._begun = data.startswith(_BEGINS)
        return data if self._begun else b""


class Circuits(Context):  # type: ignore[misc]
    """Caproto's server; calls `left` with the address of each closed circuit."""

    def __init__(
        self,
        channels: dict[str, Any],
        interfaces: list[str],
        left: Callable[[Address], Awaitable[None]],
    ) -> None:
        super().__init__(channels, interfaces)
        self._left = left

    async def server_accept_loop(self, sock: Any) -> None:
        """Accept circuits until cancelled; caproto's own one leaves its server open."""

        def accept(*streams: Any) -> None:
            stream = _TransportWrapper(*streams)
            self.server_tasks.create(self.tcp_handler(stream, stream.getpeername()))

        async with await asyncio.start_server(accept, sock=sock) as server:
            await server.serve_forever()

    async def tcp_handler(self, client: Any, addr: Any) -> None:
        try:
            if len(self.circuits) < MOST:
                prepare(client.writer.get_extra_info("socket"))
                await super().tcp_handler(_Checked(client), addr)
        finally:
            client.close()

    async def circuit_disconnected(self, circuit: Any) -> None:
        await super().circuit_disconnected(circuit)
        await self._left(circuit.circuit.address)
