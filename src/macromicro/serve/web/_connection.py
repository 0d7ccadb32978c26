"""One page's WebSocket: its orders and its stream."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Awaitable, Callable
from typing import Any

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Refused, Reply
from macromicro.errors import MacromicroError
from macromicro.schema.text import plain
from macromicro.serve import client
from macromicro.serve.bucket import Bucket
from macromicro.serve.client import Entry, Waiting
from macromicro.serve.hosts import WRONG
from macromicro.serve.requests import OVERTAKEN, POINTS
from macromicro.serve.web import bins
from macromicro.serve.web._handler import OrderHandler
from macromicro.serve.web._hub import Context
from macromicro.serve.web._orders import Refusal, number, read_object, surplus
from macromicro.serve.web._sessions import Session

Send = Callable[[str | bytes], Awaitable[None]]
Answer = Callable[[dict[str, Any], Reply], Awaitable[None]]


class Stream:
    """One viewer's stream; a change of view is deferred, and only the newest is kept."""

    def __init__(self, context: Context) -> None:
        self._context, self._bounds = context, context.bounds
        self._period = context.instrument.period
        self._plots = bins.plots(context.station.settings)
        self.view = bins.view(0, bins.SPANS[1], 600, self._period)
        self._shown = True
        self._since = -1
        self._wanted: dict[str, Any] | None = None
        self._changed = float("-inf")

    def look(self, order: dict[str, Any]) -> None:
        """Change span or width of the plots and send everything again."""
        columns = min(max(int(number({"columns": 600, **order}, "columns")), bins.LEAST), bins.MOST)
        span = number({"span": bins.SPANS[1], **order}, "span")
        if span not in bins.SPANS:
            raise Refusal(f"a span of {span:g} s", f"one of {bins.SPANS}")
        asked = number({"view": 0, **order}, "view")
        self.view = bins.view(int(asked) & 0xFFFFFFFF, span, columns, self._period)
        self._shown = order.get("frames") is not False
        self._since = -1

    def want(self, order: dict[str, Any]) -> dict[str, Any] | None:
        """Defer a change of view to its turn; the newest one counts."""
        before, self._wanted = self._wanted, order
        return before

    async def run(self, send: Send, answer: Answer) -> None:
        """Stream until the viewer leaves."""
        hub, period = self._context.hub, 1.0 / self._bounds.frames
        turn, seen, control = -1, 0, None
        due = time.monotonic()
        try:
            while True:
                await self._turn_to(answer)
                frame = self._frame()
                if frame:
                    await send(frame)
                if hub.turn != turn:
                    turn = hub.turn
                    await send(hub.state)
                seen, news = hub.after(seen)
                if news:
                    await send(news)
                if hub.control is not control:
                    control = hub.control
                    await send(hub.gains())
                due = max(due + period, time.monotonic())
                await asyncio.sleep(due - time.monotonic())
        except ConnectionClosed:
            pass

    async def _turn_to(self, answer: Answer) -> None:
        order = self._wanted
        if order is None or time.monotonic() - self._changed < 1.0 / self._bounds.views:
            return
        self._wanted, self._changed = None, time.monotonic()
        try:
            self.look(order)
            reply: Reply = Accepted()
        except Refusal as refusal:
            reply = refusal.reply
        await answer(order, reply)

    def _frame(self) -> bytes:
        if not self._shown:
            return b""
        last, block, _ = self._context.station.telemetry(self._since)
        view = self.view
        if last < self._since:  # another loop counts from 0
            self._since = -1
            return b""
        data = self._plots.frame(view, last, block[:, -view.rows :])
        # The bin that is being filled is sent again, whole.
        self._since = last // view.width * view.width - 1 if data else self._since
        return data


TAKEN_OVER, POLICY, FULL = 4000, 1008, 1013
STREAMED = 0.98  # share of a message's cost that a set point is given back
_FULL = Refused("too many orders wait", "wait for replies")


class PageConnection:
    """A WebSocket from its hello to its end."""

    def __init__(self, context: Context, socket: ServerConnection) -> None:
        self._context, self._socket = context, socket
        self._bounds = context.bounds
        self._address = str((socket.remote_address or ("?",))[0])
        self._bucket = Bucket(context.bounds.rate, context.bounds.burst)
        self._urgent: set[asyncio.Task[None]] = set()
        self._stream = Stream(context)
        self._handler = OrderHandler(context, self._send)
        self._session: Session | None = None
        self._waiting: Waiting[dict[str, Any]] | None = None

    # As its session sees it

    def drop_waiting(self) -> None:
        """Refuse waiting orders after a stop."""
        for order in self._waiting.drop() if self._waiting is not None else ():
            self._later(self._reply(order, OVERTAKEN))

    def leave(self) -> None:
        """Close: the same page was opened elsewhere."""
        self._later(self._socket.close(TAKEN_OVER, "open elsewhere"))

    # As the places see it

    @property
    def rank(self) -> int:
        if self._session is None:
            return client.without_address(self._address)
        return self._session.rank

    @property
    def heard(self) -> float:
        """Always now: pages send signs of life."""
        return 0.0

    def dismiss(self) -> None:
        self._later(self._socket.close(FULL, "too many viewers"))

    # From hello to the end

    async def run(self) -> None:
        """Serve until the viewer leaves or is dismissed."""
        try:
            hello = read_object(await asyncio.wait_for(self._socket.recv(), self._bounds.patience))
            if hello.get("do") != "hello":
                raise Refusal("the first message must be a hello")
            self._stream.look(hello)
        except (Refusal, TimeoutError):
            await self._socket.close(POLICY, "say hello first")
            return
        except ConnectionClosed:
            return
        await self._serve(hello)

    async def _serve(self, hello: dict[str, Any]) -> None:
        context = self._context
        session = context.sessions.find(hello.get("session"), self._address)
        session.returns = hello.get("program") is not True
        problem = ""
        if context.instrument.token.open or hello.get("token") is not None:
            problem = session.authenticate(hello.get("token"))
        else:
            session.authenticated = False
        self._session = session
        self._waiting = Waiting(session, self._bounds.waiting)
        if not context.capacity.claim(self, session.connection):
            await self._socket.close(FULL, "too many viewers")
            return
        if problem:
            await asyncio.sleep(self._bounds.pause)
        context.sessions.attach(session, self)
        tasks: list[asyncio.Task[None]] = []
        try:
            welcome = self._welcome(session, problem)
            await self._send(json.dumps({"welcome": welcome}, allow_nan=False))
            shown = self._stream.run(self._send, self._reply)
            work = self._waiting.work(lambda entry: self._do(entry, session))
            tasks = [asyncio.create_task(shown), asyncio.create_task(work)]
            for task in tasks:
                task.add_done_callback(self._failed)
            async for message in self._socket:
                if self._bucket.spend() > 0.0:
                    await self._socket.close(POLICY, "too many messages")
                    return
                self._take(message, session, self._waiting)
        except ConnectionClosed:
            pass
        finally:
            await self._end(tasks, session)

    async def _end(self, tasks: list[asyncio.Task[None]], session: Session) -> None:
        for task in tasks:
            task.cancel()
        sessions = self._context.sessions
        if sessions.detach(session, self):
            await self._end_jog(session)
            sessions.clear(session)
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _end_jog(self, session: Session) -> None:
        if session.jog:
            stage, session.jog = session.jog, ""
            await session.request(m.Jog(stage, 0.0))

    def _failed(self, task: asyncio.Task[None]) -> None:
        """End the connection when one of its tasks has ended."""
        if not task.cancelled():
            self._socket.transport.abort()

    # Orders

    def _take(
        self, message: str | bytes, session: Session, waiting: Waiting[dict[str, Any]]
    ) -> None:
        """Sort a message in; stops need no token, control or queue."""
        try:
            order = read_object(message)
        except Refusal as refusal:
            self._later(self._reply({}, refusal.reply))
            return
        what = order.get("do")
        if what == "emergency":
            self._later(self._emergency(order, session))
        elif what == "stop":
            self._later(self._stop(order, session))
        elif what == "beat":
            session.beat(0.0)
            if "id" in order:  # it measures the way to here and back
                self._later(self._reply(order, Accepted()))
        elif what == "keep":
            if session.jog:
                session.station.renew(session.name)
        elif isinstance(what, str) and what in POINTS:
            self._point(order, session)
        elif (refused := surplus(order, self._context.instrument.axes)) is not None:
            self._later(self._reply(order, refused))
        elif what == "view":
            before = self._stream.want(order)
            if before is not None:
                self._later(self._reply(before, Accepted()))
        elif not (self._looked(order, session) or waiting.offer(order)):
            self._later(self._reply(order, _FULL))

    def _point(self, order: dict[str, Any], session: Session) -> None:
        """Pass on a streamed set point; only one with a number is answered."""
        try:
            reply = surplus(order) or session.station.point(
                session.name, *self._context.orders.point(order)
            )
        except Refusal as refusal:
            reply = refusal.reply
        if reply is None:
            self._bucket.spend(-STREAMED)
        if "id" in order:
            self._later(self._reply(order, reply or Accepted()))

    def _later(self, what: Any) -> None:
        task = asyncio.ensure_future(what)
        self._urgent.add(task)
        task.add_done_callback(self._done)

    def _done(self, task: asyncio.Task[None]) -> None:
        self._urgent.discard(task)
        if not task.cancelled():
            task.exception()  # a viewer that is gone gets no answer

    async def _emergency(self, order: dict[str, Any], session: Session) -> None:
        reply, took = await self._context.sessions.emergency(session)
        await self._reply(order, reply, {"safe_s": plain(took)})

    async def _stop(self, order: dict[str, Any], session: Session) -> None:
        await self._reply(order, await self._context.sessions.stop(session))

    def _looked(self, order: dict[str, Any], session: Session) -> bool:
        """Begin a read-only order at once, if it is one."""
        looks = order.get("do") in ("state", "wait") and len(self._urgent) < self._bounds.waiting
        if looks:
            self._later(self._look(order, session))
        return looks

    async def _look(self, order: dict[str, Any], session: Session) -> None:
        """Answer "state" or "wait"."""
        try:
            reply, more = await self._handler.look(order, session)
        except Refusal as refusal:
            reply, more = refusal.reply, {}
        await self._reply(order, reply, more)

    async def _do(self, entry: Entry[dict[str, Any]], session: Session) -> bool:
        more: dict[str, Any] = {}
        try:
            if entry.order.get("do") == "login":
                reply = await self._login(entry.order, session)
            elif not session.authenticated:
                raise Refusal("this page has not given the token", "log in first")
            else:
                reply, more = await self._handler.do(entry, session)
        except Refusal as refusal:
            reply = refusal.reply
        except (MacromicroError, OSError) as error:
            reply = Refused(str(error), "")
        await self._reply(entry.order, reply, more)
        return True

    async def _login(self, order: dict[str, Any], session: Session) -> Reply:
        problem = session.authenticate(order.get("token"))
        if not problem:
            return Accepted()
        await asyncio.sleep(self._bounds.pause)
        return Refused(problem, "see the server's terminal")

    # What is shown

    def _welcome(self, session: Session, problem: str) -> dict[str, Any]:
        return self._context.about | {
            "session": session.key,
            "client": session.name,
            "admitted": session.authenticated,
            "problem": problem,
            "wrong": problem == WRONG,
            "view": self._stream.view._asdict(),
        }

    async def _reply(
        self, order: dict[str, Any], reply: Reply, more: dict[str, Any] | None = None
    ) -> None:
        number, what = order.get("id"), order.get("do")
        answer: dict[str, Any] = {
            "reply": plain(number) if isinstance(number, int | float | str) else None,
            "do": what[:60] if isinstance(what, str) else None,
        }
        answer["ok"] = isinstance(reply, Accepted)
        answer |= reply._asdict() if isinstance(reply, Refused) else {"motion": reply.id}
        await self._send(json.dumps(plain(answer | (more or {})), allow_nan=False))

    async def _send(self, data: str | bytes) -> None:
        """Send; a viewer that does not read for too long is dismissed."""
        try:
            await asyncio.wait_for(self._socket.send(data), self._bounds.patience)
        except TimeoutError:
            self._socket.transport.abort()
            raise ConnectionClosed(None, None) from None
