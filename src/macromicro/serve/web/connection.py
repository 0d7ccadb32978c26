"""One viewer: what it orders, in turn, and what it is shown."""

from __future__ import annotations

import asyncio
import contextlib
import json
import time
from collections import deque
from typing import Any

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Refused, Reply
from macromicro.errors import MacromicroError
from macromicro.serve import seats
from macromicro.serve.bucket import Bucket
from macromicro.serve.guesses import WRONG
from macromicro.serve.sending import Stops
from macromicro.serve.web import telling
from macromicro.serve.web.clerk import Clerk
from macromicro.serve.web.desk import Seat
from macromicro.serve.web.orders import Refusal, read
from macromicro.serve.web.room import Room
from macromicro.serve.web.showing import Showing

TAKEN_OVER, POLICY, FULL = 4000, 1008, 1013


class Connection:
    """A WebSocket from its hello to its end; a `desk.Line` and a `seats.Guest`."""

    def __init__(self, room: Room, socket: ServerConnection) -> None:
        self._room, self._socket = room, socket
        self._bounds = room.bounds
        self._address = str((socket.remote_address or ("?",))[0])
        self._admitted = False
        self._bucket = Bucket(room.bounds.rate, room.bounds.burst)
        # Orders, each with the station's stops when it came.
        self._waiting: deque[tuple[dict[str, Any], Stops]] = deque()
        self._news = asyncio.Event()
        self._urgent: set[asyncio.Task[None]] = set()
        self._shown = Showing(room)
        self._clerk = Clerk(room, self._send)
        self._seat: Seat | None = None

    # As the desk sees it

    def flush(self) -> None:
        """Orders that wait are refused: a stop came."""
        dropped, self._waiting = self._waiting, deque()
        for order, _ in dropped:
            self._later(self._reply(order, Refused("a stop came before it began", "ask again")))

    def leave(self) -> None:
        """The page is open elsewhere, by the same key."""
        self._later(self._socket.close(TAKEN_OVER, "open elsewhere"))

    # As the places see it

    @property
    def rank(self) -> int:
        """Who makes room for whom."""
        if not self._admitted:
            return seats.stranger(self._address)
        return seats.HOLDER if self._room.desk.holds(self._seat) else seats.ADMITTED

    @property
    def heard(self) -> float:
        """Pages say all the time that they are there."""
        return 0.0

    def dismiss(self) -> None:
        """Its place is another one's now."""
        self._later(self._socket.close(FULL, "too many viewers"))

    # From hello to the end

    async def run(self) -> None:
        """Serve until the viewer goes or is sent away."""
        try:
            hello = read(await asyncio.wait_for(self._socket.recv(), self._bounds.patience))
            if hello.get("do") != "hello":
                raise Refusal("the first message must be a hello")
            self._shown.look(hello)
        except (Refusal, TimeoutError):
            await self._socket.close(POLICY, "say hello first")
            return
        except ConnectionClosed:
            return
        await self._serve(hello)

    async def _serve(self, hello: dict[str, Any]) -> None:
        room = self._room
        self._seat = room.desk.find(hello.get("session"))
        problem = ""
        if room.token.open or hello.get("token") is not None:
            problem = self._check(hello.get("token"))
        if not room.places.claim(self, self._seat and self._seat.line):
            await self._socket.close(FULL, "too many viewers")
            return
        if problem:
            await asyncio.sleep(self._bounds.pause)
        seat = await room.desk.sit(hello.get("session"), self._address, self)
        seat.admitted, self._seat = self._admitted, seat
        tasks: list[asyncio.Task[None]] = []
        try:
            welcome = self._welcome(seat, problem)
            await self._send(json.dumps({"welcome": welcome}, allow_nan=False))
            shown = self._shown.run(self._send, self._reply, self._end_stale_jog)
            tasks = [asyncio.create_task(shown), asyncio.create_task(self._work(seat))]
            for task in tasks:
                task.add_done_callback(self._failed)
            async for message in self._socket:
                if self._bucket.spend() > 0.0:
                    await self._socket.close(POLICY, "too many messages")
                    return
                self._take(message, seat)
        except ConnectionClosed:
            pass
        finally:
            await self._end(tasks, seat)

    async def _end(self, tasks: list[asyncio.Task[None]], seat: Seat) -> None:
        for task in tasks:
            task.cancel()
        self._waiting.clear()
        desk = self._room.desk
        with contextlib.suppress(RuntimeError):  # the server is ending: it stops by itself
            if desk.rise(seat, self):
                if seat.jog is not None:
                    stage, seat.jog = seat.jog[0], None
                    await desk.order(seat.client, m.Jog(stage, 0.0))
                await desk.clear(seat)
        await asyncio.gather(*tasks, return_exceptions=True)

    def _failed(self, task: asyncio.Task[None]) -> None:
        """Neither task ends by itself: a page that is shown nothing more shall see that."""
        if not task.cancelled():
            self._socket.transport.abort()

    # Orders

    def _take(self, message: str | bytes, seat: Seat) -> None:
        """Put a message in its place. Stops need no token, no control and no place in a queue."""
        try:
            order = read(message)
        except Refusal as refusal:
            self._later(self._reply({}, Refused(refusal.reason, refusal.remedy)))
            return
        what = order.get("do")
        if what == "emergency":
            self._later(self._emergency(order, seat))
        elif what == "stop":
            self._later(self._stop(order, seat))
        elif what == "beat":
            self._room.station.heartbeat(seat.client)
            if "id" in order:  # it measures the way to here and back
                self._later(self._reply(order, Accepted()))
        elif what == "keep":
            if seat.jog is not None:
                seat.jog = (seat.jog[0], time.monotonic() + self._bounds.jog)
        elif what == "view":
            before = self._shown.want(order)
            if before is not None:
                self._later(self._reply(before, Accepted()))
        elif len(self._waiting) >= self._bounds.waiting:
            self._later(self._reply(order, Refused("too many orders wait", "wait for replies")))
        else:
            self._waiting.append((order, self._room.station.stops))
            self._news.set()

    def _later(self, what: Any) -> None:
        task = asyncio.ensure_future(what)
        self._urgent.add(task)
        task.add_done_callback(self._done)

    def _done(self, task: asyncio.Task[None]) -> None:
        self._urgent.discard(task)
        if not task.cancelled():
            task.exception()  # a viewer that is gone gets no answer

    async def _emergency(self, order: dict[str, Any], seat: Seat) -> None:
        reply, took = await self._room.desk.emergency(seat.client)
        await self._reply(order, reply, {"safe_s": telling.plain(took)})

    async def _stop(self, order: dict[str, Any], seat: Seat) -> None:
        await self._reply(order, await self._room.desk.stop(seat.client))

    async def _work(self, seat: Seat) -> None:
        """One order after the other."""
        while True:
            await self._news.wait()
            self._news.clear()
            while self._waiting:
                order, since = self._waiting.popleft()
                more: dict[str, Any] = {}
                try:
                    reply, more = await self._do(order, seat, since)
                except Refusal as refusal:
                    reply = Refused(refusal.reason, refusal.remedy)
                except (MacromicroError, OSError) as error:
                    reply = Refused(str(error), "")
                await self._reply(order, reply, more)

    async def _do(
        self, order: dict[str, Any], seat: Seat, since: Stops
    ) -> tuple[Reply, dict[str, Any]]:
        if order.get("do") == "login":
            problem = self._check(order.get("token"))
            seat.admitted = self._admitted
            if problem:
                await asyncio.sleep(self._bounds.pause)
            return (Refused(problem, "see the server's terminal") if problem else Accepted()), {}
        if not self._admitted:
            raise Refusal("this page has not given the token", "log in first")
        return await self._clerk.do(order, seat, since)

    def _check(self, token: object) -> str:
        """Look at a token; what is wrong, or "". A page that gave the right one before is not
        kept out by others at its address."""
        known = self._seat is not None and self._seat.admitted
        problem = self._room.token.problem(token, self._address, known=known)
        if problem in ("", WRONG):  # else it was not looked at
            self._admitted = not problem
        if problem:
            self._room.station.trail.client("token", f"web {self._address}", problem)
        return problem

    # What is shown

    def _welcome(self, seat: Seat, problem: str) -> dict[str, Any]:
        return self._room.about | {
            "session": seat.key,
            "client": seat.client,
            "admitted": self._admitted,
            "problem": problem,
            "wrong": problem == WRONG,
            "view": self._shown.view._asdict(),
        }

    async def _end_stale_jog(self) -> None:
        seat = self._seat
        if seat is not None and seat.jog is not None and time.monotonic() > seat.jog[1]:
            stage, seat.jog = seat.jog[0], None
            await self._room.desk.order(seat.client, m.Jog(stage, 0.0))

    async def _reply(
        self, order: dict[str, Any], reply: Reply, more: dict[str, Any] | None = None
    ) -> None:
        number, what = order.get("id"), order.get("do")
        told: dict[str, Any] = {
            "reply": telling.plain(number) if isinstance(number, int | float | str) else None,
            "do": what[:60] if isinstance(what, str) else None,
        }
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
