"""Telemetry, state, news and gains for one viewer, as fast as it reads."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from typing import Any

from websockets.exceptions import ConnectionClosed

from macromicro.control.live.messages import Accepted, Reply
from macromicro.serve.web import bins
from macromicro.serve.web._hub import Context
from macromicro.serve.web._orders import Refusal, number

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
        if last < self._since:  # another loop counts anew
            self._since = -1
            return b""
        data = self._plots.frame(view, last, block[:, -view.rows :])
        # The bin that is being filled is sent again, whole.
        self._since = last // view.width * view.width - 1 if data else self._since
        return data
