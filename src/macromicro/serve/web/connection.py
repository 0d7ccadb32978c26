"""One viewer: what it orders, in turn, and what it is shown."""

from __future__ import annotations

import asyncio
import contextlib
import json
import struct
import time
from collections import deque
from typing import Any

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Refused, Reply
from macromicro.errors import MacromicroError
from macromicro.serve.web import bins, telling
from macromicro.serve.web.bounds import Bucket
from macromicro.serve.web.desk import Seat
from macromicro.serve.web.orders import Refusal, number, read, text
from macromicro.serve.web.room import Room

TAKEN_OVER, POLICY = 4000, 1008
_PIECE = struct.Struct("<4Id")  # kind 2, id, size of the piece, 0; size of the file


class Connection:
    """A WebSocket from its hello to its end; a `desk.Line`."""

    def __init__(self, room: Room, socket: ServerConnection) -> None:
        self._room, self._socket = room, socket
        self._bounds = room.bounds
        self._admitted = False
        self._tries = 0
        self._bucket = Bucket(room.bounds.rate, room.bounds.burst)
        self._waiting: deque[dict[str, Any]] = deque()
        self._news = asyncio.Event()
        self._urgent: set[asyncio.Task[None]] = set()
        self._view = bins.view(0, bins.SPANS[1], 600)
        self._since = -1
        self._seat: Seat

    # As the desk sees it

    def flush(self) -> None:
        """Orders that wait are refused: a stop came."""
        dropped, self._waiting = self._waiting, deque()
        for order in dropped:
            self._later(self._reply(order, Refused("a stop came before it began", "ask again")))

    def leave(self) -> None:
        """The page is open elsewhere, by the same key."""
        self._later(self._socket.close(TAKEN_OVER, "open elsewhere"))

    # From hello to the end

    async def run(self) -> None:
        """Serve until the viewer goes or is sent away."""
        try:
            hello = read(await asyncio.wait_for(self._socket.recv(), self._bounds.patience))
            if hello.get("do") != "hello":
                raise Refusal("the first message must be a hello")
            self._look(hello)
        except (Refusal, TimeoutError):
            await self._socket.close(POLICY, "say hello first")
            return
        except ConnectionClosed:
            return
        await self._serve(hello)

    async def _serve(self, hello: dict[str, Any]) -> None:
        room = self._room
        address = str((self._socket.remote_address or ("?",))[0])
        self._seat = room.desk.sit(hello.get("session"), address, self)
        tasks: list[asyncio.Task[None]] = []
        try:
            await room.desk.do(lambda: room.station.connect(self._seat.client))
            problem = ""
            if room.gate.open or hello.get("token") is not None:
                problem = await self._login(hello)
            await self._send(json.dumps({"welcome": self._welcome(problem)}, allow_nan=False))
            tasks = [asyncio.create_task(self._show()), asyncio.create_task(self._work())]
            for task in tasks:
                task.add_done_callback(self._failed)
            async for message in self._socket:
                if not self._bucket.take():
                    await self._socket.close(POLICY, "too many messages")
                    return
                self._take(message)
        except ConnectionClosed:
            pass
        finally:
            await self._end(tasks)

    async def _end(self, tasks: list[asyncio.Task[None]]) -> None:
        for task in tasks:
            task.cancel()
        self._waiting.clear()
        seat, desk = self._seat, self._room.desk
        if desk.rise(seat, self) and seat.jog is not None:
            stage, seat.jog = seat.jog[0], None
            with contextlib.suppress(RuntimeError):  # the server is ending: it stops by itself
                await desk.order(seat.client, m.Jog(stage, 0.0))
        await asyncio.gather(*tasks, return_exceptions=True)

    def _failed(self, task: asyncio.Task[None]) -> None:
        """Neither task ends by itself: a page that is shown nothing more shall see that."""
        if not task.cancelled():
            self._socket.transport.abort()

    # Orders

    def _take(self, message: str | bytes) -> None:
        """Put a message in its place. Stops need no token, no control and no place in a queue."""
        try:
            order = read(message)
        except Refusal as refusal:
            self._later(self._reply({}, Refused(refusal.reason, refusal.remedy)))
            return
        what = order.get("do")
        if what == "emergency":
            self._later(self._emergency(order))
        elif what == "stop":
            self._later(self._stop(order))
        elif what == "beat":
            self._room.station.heartbeat(self._seat.client)
            if "id" in order:  # it measures the way to here and back
                self._later(self._reply(order, Accepted()))
        elif what == "keep":
            if self._seat.jog is not None:
                self._seat.jog = (self._seat.jog[0], time.monotonic() + self._bounds.jog)
        elif len(self._waiting) >= self._bounds.waiting:
            self._later(self._reply(order, Refused("too many orders wait", "wait for replies")))
        else:
            self._waiting.append(order)
            self._news.set()

    def _later(self, what: Any) -> None:
        task = asyncio.ensure_future(what)
        self._urgent.add(task)
        task.add_done_callback(self._done)

    def _done(self, task: asyncio.Task[None]) -> None:
        self._urgent.discard(task)
        if not task.cancelled():
            task.exception()  # a viewer that is gone gets no answer

    async def _emergency(self, order: dict[str, Any]) -> None:
        reply, took = await self._room.desk.emergency()
        await self._reply(order, reply, {"safe_s": telling.plain(took)})

    async def _stop(self, order: dict[str, Any]) -> None:
        await self._reply(order, await self._room.desk.stop(self._seat.client))

    async def _work(self) -> None:
        """One order after the other."""
        while True:
            await self._news.wait()
            self._news.clear()
            while self._waiting:
                order = self._waiting.popleft()
                more: dict[str, Any] = {}
                try:
                    reply, more = await self._do(order)
                except Refusal as refusal:
                    reply = Refused(refusal.reason, refusal.remedy)
                except (MacromicroError, OSError) as error:
                    reply = Refused(str(error), "")
                await self._reply(order, reply, more)

    async def _do(self, order: dict[str, Any]) -> tuple[Reply, dict[str, Any]]:
        what, room, client = order.get("do"), self._room, self._seat.client
        if what in ("view", "login"):
            problem = await self._login(order) if what == "login" else self._look(order)
            return (Refused(problem, "see the server's terminal") if problem else Accepted()), {}
        if not self._admitted:
            raise Refusal("this page has not given the token", "log in first")
        if what == "download":
            return await self._piece(order)
        if what in ("take", "release"):
            give = room.station.acquire if what == "take" else room.station.release
            return await room.desk.do(lambda: give(client)), {}
        if what == "record":
            return Accepted(), {"name": await room.desk.do(room.recordings.begin)}
        if what == "end recording":
            return Accepted(), {"rows": (await room.desk.do(room.recordings.end)).rows}
        if not room.orders.knows(what):
            raise Refusal(f"{what!r:.60} is no order", "see the page")
        return await self._order(order), {}

    async def _order(self, order: dict[str, Any]) -> Reply:
        room, seat = self._room, self._seat
        control = room.hub.control
        request = await room.desk.do(lambda: room.orders.request(order, control))
        reply = await room.desk.order(seat.client, request)
        if isinstance(request, m.Jog) and isinstance(reply, Accepted):
            until = time.monotonic() + self._bounds.jog
            seat.jog = (request.stage, until) if request.speed != 0.0 else None
        return reply

    async def _piece(self, order: dict[str, Any]) -> tuple[Reply, dict[str, Any]]:
        name, offset = text(order, "name"), number(order, "offset")
        room = self._room
        data, size = await room.desk.do(lambda: room.recordings.piece(name, offset))
        head = _PIECE.pack(2, int(number(order, "id")) & 0xFFFFFFFF, len(data), 0, size)
        await self._send(head + data)
        return Accepted(), {}

    async def _login(self, order: dict[str, Any]) -> str:
        """Take a token; what is wrong, or ""."""
        self._admitted = self._room.gate.admits(order.get("token"))
        if self._admitted:
            return ""
        self._tries += 1
        await asyncio.sleep(self._bounds.pause)
        if self._tries >= self._bounds.tries:
            await self._socket.close(POLICY, "too many wrong tokens")
        return "this is not the token"

    # What is shown

    def _welcome(self, problem: str) -> dict[str, Any]:
        room, seat = self._room, self._seat
        return room.about | {
            "session": seat.key,
            "client": seat.client,
            "admitted": self._admitted,
            "problem": problem,
            "view": self._view._asdict(),
        }

    def _look(self, order: dict[str, Any]) -> str:
        """Another span or width of the plots: all that is to be seen is sent anew."""
        columns = min(max(int(number({"columns": 600, **order}, "columns")), bins.LEAST), bins.MOST)
        span = number({"span": bins.SPANS[1], **order}, "span")
        if span not in bins.SPANS:
            raise Refusal(f"a span of {span:g} s", f"one of {bins.SPANS}")
        wanted = number({"view": 0, **order}, "view")
        self._view = bins.view(int(wanted) & 0xFFFFFFFF, span, columns)
        self._since = -1
        return ""

    async def _show(self) -> None:
        """Telemetry, state and news, as fast as this viewer takes them."""
        hub, period = self._room.hub, 1.0 / self._bounds.frames
        turn, told, control = -1, 0, None
        due = time.monotonic()
        try:
            while True:
                frame = self._frame()
                if frame:
                    await self._send(frame)
                if hub.turn != turn:
                    turn = hub.turn
                    await self._send(hub.state)
                told, news = hub.after(told)
                if news:
                    await self._send(news)
                if hub.control is not control:
                    control = hub.control
                    await self._send(hub.gains())
                await self._end_stale_jog()
                due = max(due + period, time.monotonic())
                await asyncio.sleep(due - time.monotonic())
        except ConnectionClosed:
            pass

    def _frame(self) -> bytes:
        last, block, names = self._room.station.telemetry(self._since)
        view = self._view
        if last < self._since:  # another loop counts anew
            self._since = -1
            return b""
        data = bins.frame(view, last, block[:, -view.rows :], names, self._room.hub.pitch)
        # The bin that is being filled is sent again, whole.
        self._since = last // view.width * view.width - 1 if data else self._since
        return data

    async def _end_stale_jog(self) -> None:
        seat = self._seat
        if seat.jog is not None and time.monotonic() > seat.jog[1]:
            stage, seat.jog = seat.jog[0], None
            await self._room.desk.order(seat.client, m.Jog(stage, 0.0))

    async def _reply(
        self, order: dict[str, Any], reply: Reply, more: dict[str, Any] | None = None
    ) -> None:
        told: dict[str, Any] = {"reply": telling.plain(order.get("id")), "do": order.get("do")}
        told["ok"] = isinstance(reply, Accepted)
        told |= reply._asdict() if isinstance(reply, Refused) else {"motion": reply.id}
        await self._send(json.dumps(telling.plain(told | (more or {})), allow_nan=False))

    async def _send(self, data: str | bytes) -> None:
        """Send; a viewer that takes nothing for too long is sent away."""
        try:
            await asyncio.wait_for(self._socket.send(data), self._bounds.patience)
        except TimeoutError:
            self._socket.transport.abort()
            raise ConnectionClosed(None, None) from None
