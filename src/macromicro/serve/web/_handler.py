"""Executes a viewer's orders at the station."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Awaitable, Callable
from typing import Any

import numpy as np

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Reply
from macromicro.schema.text import plain
from macromicro.serve.client import Entry
from macromicro.serve.web._hub import Context
from macromicro.serve.web._orders import Refusal, number, text
from macromicro.serve.web._sessions import Session
from macromicro.serve.web.bins import PIECE, PIECE_KIND

UNKNOWN_S = 2.0  # after which a number that is not under way is none
More = dict[str, Any]  # what a reply says beside its outcome
Done = tuple[Reply, More]


class OrderHandler:
    """Executes orders in turn; `send` takes further messages."""

    def __init__(self, context: Context, send: Callable[[str | bytes], Awaitable[None]]) -> None:
        self._context, self._send = context, send
        self._own: dict[str, Callable[[dict[str, Any], Session], Awaitable[More]]] = {
            "download": self._piece,
            "record": self._record,
            "end recording": self._end_recording,
            "upload": self._upload,
            "capture": self._capture,
            "captured": self._captured,
            "end capture": self._end_capture,
            "settings": self._settings,
        }

    async def do(self, entry: Entry[dict[str, Any]], session: Session) -> Done:
        """The reply with its data."""
        order, context = entry.order, self._context
        what = order.get("do")
        own = self._own.get(what) if isinstance(what, str) else None
        if own is not None:
            return Accepted(), await own(order, session)
        if what == "take":
            return session.take(), {}
        if what == "release":
            return context.station.release(session.name), {}
        if not context.orders.knows(what):
            raise Refusal(f"{what!r:.60} is not an order", "see the page")
        return await self._request(entry, session), {}

    async def look(self, order: dict[str, Any], session: Session) -> Done:
        """The state now ("state"), or the end of a motion ("wait"); needs no token."""
        context = self._context
        if order["do"] == "state":
            return Accepted(), {"state": context.hub.now()}
        motion, seen = int(number(order, "motion")), time.monotonic()
        while session.connection is not None:
            now = context.station.snapshot()  # before its end, which may come behind
            end = context.station.finished(motion, 0.0)
            if end is not None:
                return Accepted(), {"finished": plain(end._asdict())}
            if not now.running:
                raise Refusal("the loop process has ended", "see the server's terminal")
            seen = time.monotonic() if now.motion == motion else seen
            if time.monotonic() - seen > UNKNOWN_S:
                raise Refusal(f"there is no motion {motion}", "a number that a reply had")
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(0.25 * UNKNOWN_S):
                    await context.station.news()
        raise Refusal("the viewer is gone")

    def _refuse_others(self, session: Session) -> None:
        """Refuse a client that does not hold control."""
        refusal = self._context.station.refusal(session.name)
        if refusal is not None:
            raise Refusal(refusal.reason, refusal.remedy)

    async def _record(self, order: dict[str, Any], session: Session) -> More:
        self._refuse_others(session)
        begin = self._context.recordings.begin
        return {"name": await session.in_thread(begin, session.name)}

    async def _end_recording(self, order: dict[str, Any], session: Session) -> More:
        self._refuse_others(session)
        state = await session.in_thread(self._context.recordings.end, session.name)
        return {"rows": state.rows}

    async def _capture(self, order: dict[str, Any], session: Session) -> More:
        wanted = self._context.orders.capture(order)
        self._context.station.captures.begin(session.name, wanted)
        return {}

    async def _captured(self, order: dict[str, Any], session: Session) -> More:
        """The state of the capture, and its rows unless they were seen, as a piece."""
        capture = self._context.station.captures.of(session.name)
        if capture is None:
            raise Refusal("nothing is being captured", "begin a capture")
        found = capture.captured
        state = {"phase": capture.state, "captured": 0 if found is None else found.number}
        if found is None or found.number <= number({"seen": 0, **order}, "seen"):
            return state
        data = np.ascontiguousarray(found.values, "<f8").tobytes()
        await self._send_piece(order, data, len(data))
        return {**state, "names": found.names, "units": found.units, "time_s": found.time}

    async def _end_capture(self, order: dict[str, Any], session: Session) -> More:
        self._context.station.captures.end(session.name)
        return {}

    async def _upload(self, order: dict[str, Any], session: Session) -> More:
        take, load = session.upload.take, self._context.orders.programme
        return await session.in_thread(take, order, load)

    async def _settings(self, order: dict[str, Any], session: Session) -> More:
        return {"text": self._context.hub.as_toml()}

    async def _request(self, entry: Entry[dict[str, Any]], session: Session) -> Reply:
        context, order = self._context, entry.order
        if order.get("do") != "programme":
            request = context.orders.request(order)
        elif order.get("uploaded") is not True:
            request = await session.in_thread(context.orders.request, order)
        elif session.upload.plan is None:
            raise Refusal("no programme was uploaded", "choose a file first")
        else:
            request = m.Programme(session.upload.plan)
        if isinstance(request, m.Jog) and "hold" not in order:
            request = request._replace(hold=context.bounds.jog)
        reply = await session.request(request, entry)
        if isinstance(reply, Accepted):
            if isinstance(request, m.Jog):
                session.jog = request.stage if request.speed != 0.0 else ""
            if isinstance(request, m.SetGains):
                context.hub.follow()  # the page asks for them next
        return reply

    async def _piece(self, order: dict[str, Any], session: Session) -> More:
        name, offset = text(order, "name"), number(order, "offset")
        data, size = await session.in_thread(self._context.recordings.piece, name, offset)
        await self._send_piece(order, data, size)
        return {}

    async def _send_piece(self, order: dict[str, Any], data: bytes, size: int) -> None:
        """Send a piece of a file of this size."""
        name = int(number(order, "id")) & 0xFFFFFFFF
        await self._send(PIECE.pack(PIECE_KIND, name, len(data), 0, size) + data)
