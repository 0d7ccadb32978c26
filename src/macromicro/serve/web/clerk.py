"""What a viewer that may order things has ordered, done at the station."""

from __future__ import annotations

import asyncio
import struct
import time
from collections.abc import Awaitable, Callable
from typing import Any

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Reply
from macromicro.serve.sending import Stops
from macromicro.serve.web.desk import Seat
from macromicro.serve.web.orders import Refusal, number, text
from macromicro.serve.web.room import Room

TOLD_S = 0.5  # longest wait for the event behind an accepted order
_PIECE = struct.Struct("<4Id")  # kind 2, id, size of the piece, 0; size of the file
Done = tuple[Reply, dict[str, Any]]


class Clerk:
    """One order after the other; `send` takes what is no reply."""

    def __init__(self, room: Room, send: Callable[[str | bytes], Awaitable[None]]) -> None:
        self._room, self._send = room, send

    async def do(self, order: dict[str, Any], seat: Seat, since: Stops) -> Done:
        """The reply, and what is told with it; `since`: the station's stops when it came.
        Raises `Refusal`, and what the station raises."""
        what, room = order.get("do"), self._room
        if what == "download":
            return await self._piece(order)
        if what in ("take", "release"):
            give = room.station.acquire if what == "take" else room.station.release
            return await room.desk.do(lambda: give(seat.client)), {}
        if what == "record":
            return Accepted(), {"name": await room.desk.do(room.recordings.begin)}
        if what == "end recording":
            return Accepted(), {"rows": (await room.desk.do(room.recordings.end)).rows}
        if not room.orders.knows(what):
            raise Refusal(f"{what!r:.60} is no order", "see the page")
        return await self._request(order, seat, since), {}

    async def _request(self, order: dict[str, Any], seat: Seat, since: Stops) -> Reply:
        room = self._room
        room.hub.follow()  # a change of gains is checked against those of this moment
        control = room.hub.control
        request = await room.desk.do(lambda: room.orders.request(order, control))
        reply = await room.desk.order(seat.client, request, since)
        if isinstance(reply, Accepted):
            if isinstance(request, m.Jog):
                until = time.monotonic() + room.bounds.jog
                seat.jog = (request.stage, until) if request.speed != 0.0 else None
            if isinstance(request, m.SetGains):
                await self._in_force(request)
        return reply

    async def _in_force(self, request: m.SetGains) -> None:
        """Wait until the hub has heard of the new gains, whose event comes behind the reply."""
        hub, deadline = self._room.hub, time.monotonic() + TOLD_S
        while time.monotonic() < deadline:
            hub.follow()
            if all(hub.has(path, value) for path, value in request.changes):
                return
            await asyncio.sleep(0.002)

    async def _piece(self, order: dict[str, Any]) -> Done:
        name, offset = text(order, "name"), number(order, "offset")
        room = self._room
        data, size = await room.desk.do(lambda: room.recordings.piece(name, offset))
        head = _PIECE.pack(2, int(number(order, "id")) & 0xFFFFFFFF, len(data), 0, size)
        await self._send(head + data)
        return Accepted(), {}
