"""The circuits of Channel Access: how they begin, how many there may be, and when one is gone."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

from caproto.asyncio.server import Context

from macromicro.serve.door.bounds import Bounds
from macromicro.serve.door.monitor import prepare
from macromicro.serve.epics.channels import Address

MOST = Bounds().silent
_BEGINS = b"\0\0"  # CA_PROTO_VERSION, a circuit's first message


class _Checked:
    """A circuit's stream. Bytes that do not begin as Channel Access does, or do not come, are the
    end."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream
        self._begun = False

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    async def recv(self, most: int = 4096) -> bytes:
        """What came; nothing at the end."""
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
    """Caproto's server; `left` is called with the address of each circuit that has closed."""

    def __init__(
        self,
        channels: dict[str, Any],
        interfaces: list[str],
        left: Callable[[Address], Awaitable[None]],
    ) -> None:
        super().__init__(channels, interfaces)
        self._left = left

    async def tcp_handler(self, client: Any, addr: Any) -> None:
        """A new circuit."""
        if len(self.circuits) >= MOST:
            client.close()
            return
        prepare(client.writer.get_extra_info("socket"))
        await super().tcp_handler(_Checked(client), addr)

    async def circuit_disconnected(self, circuit: Any) -> None:
        """A circuit is gone."""
        await super().circuit_disconnected(circuit)
        await self._left(circuit.circuit.address)
