"""Channel Access circuits: first bytes, number, end."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

from caproto.asyncio.server import Context
from caproto.asyncio.utils import _TransportWrapper

from macromicro.serve.door._connection import Bounds, prepare
from macromicro.serve.epics._channels import Address

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
