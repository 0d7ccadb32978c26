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
        self._files: dict[str, Callable[[dict[str, Any], Seat], Awaitable[Done]]] = {
            "download": self._piece,
            "record": self._record,
            "end recording": self._end_recording,
            "upload": self._upload,
            "settings": self._settings,
        }

    async def do(self, order: dict[str, Any], seat: Seat, since: Stops) -> Done:
        """The reply, and what is told with it; `since`: the station's stops when it came.
        Raises `Refusal`, and what the station raises."""
        what = order.get("do")
        handle = self._files.get(what) if isinstance(what, str) else None
        if handle is not None:
            return await handle(order, seat)
        room = self._room
        if what in ("take", "release"):
            give = room.station.acquire if what == "take" else room.station.release
            return await room.desk.do(lambda: give(seat.client)), {}
        if not room.orders.knows(what):
            raise Refusal(f"{what!r:.60} is no order", "see the page")
        return await self._request(order, seat, since), {}

    async def _record(self, order: dict[str, Any], seat: Seat) -> Done:
        room = self._room
        refusal = room.station.refusal(seat.client)
        if refusal is not None:
            return refusal, {}
        return Accepted(), {"name": await room.desk.do(lambda: room.recordings.begin(seat.client))}

    async def _end_recording(self, order: dict[str, Any], seat: Seat) -> Done:
        room = self._room
        refusal = room.station.refusal(seat.client)
        if refusal is not None:
            return refusal, {}
        state = await room.desk.do(lambda: room.recordings.end(seat.client))
        return Accepted(), {"rows": state.rows}

    async def _upload(self, order: dict[str, Any], seat: Seat) -> Done:
        desk, load = self._room.desk, self._room.orders.programme
        return Accepted(), await desk.do(lambda: seat.upload.take(order, load))

    async def _settings(self, order: dict[str, Any], seat: Seat) -> Done:
        return Accepted(), {"text": await self._room.desk.do(self._room.hub.as_toml)}

    async def _request(self, order: dict[str, Any], seat: Seat, since: Stops) -> Reply:
        room = self._room
        room.hub.follow()  # a change of gains is checked against those of this moment
        control = room.hub.control
        if order.get("do") == "programme" and order.get("uploaded") is True:
            if seat.upload.plan is None:
                raise Refusal("no programme was uploaded", "choose a file first")
            request: m.Request = m.Programme(seat.upload.plan)
        else:
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

    async def _piece(self, order: dict[str, Any], seat: Seat) -> Done:
        name, offset = text(order, "name"), number(order, "offset")
        room = self._room
        data, size = await room.desk.do(lambda: room.recordings.piece(name, offset))
        head = _PIECE.pack(2, int(number(order, "id")) & 0xFFFFFFFF, len(data), 0, size)
        await self._send(head + data)
        return Accepted(), {}
