"""Sends requests to the loop process, with the position file written before."""

from __future__ import annotations

import asyncio
import contextlib
import math
import signal
import threading
import time
from collections.abc import Callable
from typing import Any

from macromicro.control.live import messages as m
from macromicro.control.live import transitions
from macromicro.control.live.messages import Finished, Notice, Refused, Reply
from macromicro.errors import MacromicroError
from macromicro.serve import link, requests
from macromicro.serve._background import on_loop
from macromicro.serve._launching import Child
from macromicro.serve.link import Outbox
from macromicro.serve.persist import PositionStore
from macromicro.serve.requests import Order
from macromicro.serve.shared import COMMANDS, EMERGENCY, SAFE_SINCE, SEEN, WRITTEN, Shared

ANSWER_S = 1.0  # an emergency stop that takes longer ends the loop process
LOOK_S = 0.0005  # between looks for its answer
GRACE_S = 0.25  # for an answer given just in time to come here
OFF = Refused("the loop process is not running", "start it again")
SILENT = Refused("the loop did not answer in time", "check the events, stop, and start again")

Allowed = Callable[[], Refused | None]
Stops = tuple[int, int]  # stops and losses of control asked for so far; emergency stops


def anybody() -> Refused | None:
    return None


class Sender:
    """Sends requests to the loop process, from the servers' event loop; refuses while none runs."""

    def __init__(
        self, wait: float, alive: Callable[[], bool], report: Callable[[str], None]
    ) -> None:
        self._wait, self._alive, self._report = wait, alive, report
        self._stops = self._emergencies = self._releases = self._serial = 0
        self._replies: dict[int, asyncio.Future[Reply]] = {}
        self._stamping = threading.Lock()
        self._presser = ""

    def begin(
        self,
        child: Child,
        shared: Shared,
        store: PositionStore,
        outbox: Outbox,
        stages: tuple[str, ...] = m.STAGES,
    ) -> None:
        """Send to this loop process from now on."""
        self._child, self._shared, self._stages = child, shared, stages
        self._store, self._outbox = store, outbox

    @property
    def stops(self) -> Stops:
        """Counts of stops, which show whether one came meanwhile."""
        return self._stops, self._emergencies

    async def ask(
        self, request: Any, allowed: Allowed = anybody, since: Stops | None = None
    ) -> Reply:
        """Send a request and wait for its reply; refused if a stop has come since `since`."""
        if not self._alive():
            return OFF
        # Whoever gives up waiting, the order is seen through.
        return await asyncio.shield(asyncio.ensure_future(self._ask(request, allowed, since)))

    async def _ask(self, request: Any, allowed: Allowed, since: Stops | None) -> Reply:
        asked = time.monotonic_ns()
        stops, releases = self.stops if since is None else since, self._releases
        if not requests.begins(request):
            return await self._exchange(request, asked, allowed)

        # How a stop overtakes. An order that still waits for its turn finds other counts of stops
        # than when it was asked for, and is refused (`still`). One that is in the socket already
        # is done first, as the loop takes messages in order, and the stop behind it ends what it
        # began. An emergency stop waits for no message: it is a stamp in the shared memory, read
        # at the start of every period, and orders asked for before it are void
        # (`requests.void`).
        def still() -> Refused | None:
            if self.stops != stops or self._releases != releases:
                return requests.OVERTAKEN
            return allowed()

        if not requests.moves(request):
            return await self._exchange(request, asked, still)
        if not self._store.moving:  # a refused request costs no write and is no motion
            reply = await self._exchange(request, asked, still, trial=True)
            if isinstance(reply, Refused):
                return reply
        try:
            await self._store.begin_motion()
        except MacromicroError as error:
            return Refused(str(error), "free disk space, or make the file's folder writable")
        try:
            return await self._exchange(request, asked, still)
        finally:
            self._store.answered(int(self._shared.cells[WRITTEN]))

    @on_loop
    def post(self, request: Any) -> None:
        """Send a request without waiting for its reply."""
        if not self._alive():
            return
        refusal = self._send(0, request, time.monotonic_ns(), anybody, False)
        if refusal is not None and self._alive():
            self._report(f"{type(request).__name__} did not reach the loop: {refusal.reason}")

    def released(self) -> None:
        """Void pending requests and end a jog: nobody holds control."""
        self._releases += 1
        if self._alive():
            for stage in self._stages:  # the stage that does not jog refuses it
                self.post(m.Jog(stage, 0.0))

    async def _exchange(
        self, request: Any, asked: int, allowed: Allowed, *, trial: bool = False
    ) -> Reply:
        self._serial += 1
        serial = self._serial
        reply = self._replies[serial] = asyncio.get_running_loop().create_future()
        try:
            refusal = self._send(serial, request, asked, allowed, trial)
            if refusal is not None:
                return refusal
            return await asyncio.wait_for(reply, self._wait + GRACE_S)
        except TimeoutError:
            return SILENT if self._alive() else OFF
        finally:
            del self._replies[serial]

    def _send(
        self, serial: int, request: Any, asked: int, allowed: Allowed, trial: bool
    ) -> Refused | None:
        until = time.monotonic_ns() + round(self._wait * 1e9)
        data = link.pack(Order(serial, request, asked, until, trial))
        if len(data) > link.LARGEST:
            return Refused(f"a request of {len(data)} bytes", f"at most {link.LARGEST} bytes")
        refusal = allowed()
        if refusal is not None:
            return refusal
        if isinstance(request, m.Stop | m.LinkLost):
            self._stops += 1
        if self._outbox.busy:  # the loop has not read earlier ones
            return SILENT
        self._outbox.put(data)
        self._shared.cells[COMMANDS] += 1
        return None

    def reply(self, serial: int, reply: Reply) -> None:
        """Hand a reply of the loop to who waits for it."""
        waiting = self._replies.get(serial)
        if waiting is not None and not waiting.done():
            waiting.set_result(reply)

    def close(self) -> None:
        """Answer what waits: the loop is gone."""
        for serial in tuple(self._replies):
            self.reply(serial, OFF)

    # Emergency stops, from any thread

    def emergency(self, client: str) -> float:
        """See `Station.emergency`; it needs no event loop."""
        if not self._alive():
            return math.nan
        stamp, deadline = self._stamp(client), time.monotonic() + ANSWER_S
        while (took := self._took(stamp, deadline)) is None:
            time.sleep(LOOK_S)
        return took

    async def emergency_stop(self, client: str) -> float:
        """The same within the event loop."""
        if not self._alive():
            return math.nan
        stamp, deadline = self._stamp(client), time.monotonic() + ANSWER_S
        while (took := self._took(stamp, deadline)) is None:
            await asyncio.sleep(LOOK_S)
        return took

    def _stamp(self, client: str) -> int:
        cells = self._shared.cells
        with self._stamping:  # for the time of two stores; stamps only ever grow
            self._presser = client
            self._emergencies += 1
            stamp = max(time.monotonic_ns(), int(cells[EMERGENCY]) + 1)
            cells[EMERGENCY] = stamp
        return stamp

    def _took(self, stamp: int, deadline: float) -> float | None:
        """Seconds until the outputs were safe; NaN if it failed, None if it is under way."""
        if not self._alive():
            return math.nan
        cells = self._shared.cells
        late = time.monotonic() >= deadline  # looked at first: we may have been held up
        if int(cells[SEEN]) >= stamp:
            return (int(cells[SAFE_SINCE]) - stamp) * 1e-9
        if not late:
            return None
        with contextlib.suppress(ProcessLookupError):
            self._child.process.send_signal(signal.SIGTERM)
        self._report(f"no answer to an emergency stop in {ANSWER_S:g} s; the loop is ended")
        return math.nan

    def signed(self, notice: Notice) -> Notice:
        """Add the client of the emergency stop to its event."""
        how = notice.outcome if isinstance(notice, Finished) else notice.cause
        if how not in (m.EMERGENCY, transitions.EMERGENCY) or notice.evidence.get("client") != "":
            return notice
        return notice._replace(evidence={**notice.evidence, "client": self._presser})
