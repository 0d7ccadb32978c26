from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Sequence
from concurrent.futures import Future
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from macromicro.control.live import messages as m
from macromicro.control.live.accept import NOT_FOLLOWING
from macromicro.control.live.messages import MODES, Accepted, Event, Finished, Refused, Reply
from macromicro.errors import MacromicroError
from macromicro.recording_format import Attribute
from macromicro.rig.opening import TWIN
from macromicro.serve import _background, _watching, unconfirmed
from macromicro.serve._background import in_thread, on_loop
from macromicro.serve._holders import Holders
from macromicro.serve._launching import LIVE
from macromicro.serve._ledger import InForce, Trail
from macromicro.serve._loop_connection import LoopConnection
from macromicro.serve._recording import Recordings
from macromicro.serve._sending import SILENT, Stops
from macromicro.serve.capturing import Captures
from macromicro.serve.requests import place
from macromicro.serve.settings import AnySettings, LiveSettings
from macromicro.serve.snapshot import RecordingState, Snapshot

if TYPE_CHECKING:
    pass


LATEST, OLDEST = 1e12, 10.0  # s: of a client's clock; age of a set point that was delayed
DRIFT = 2e-4  # by which two clocks may differ in rate


class Stream:
    """Set points of a motion that follows `stages` of them; not thread-safe."""

    def __init__(self, motion: int = 0, stages: int = 1) -> None:
        self.motion, self._stages = motion, stages
        self._ahead = math.inf  # what this clock showed more than the client's, at least, s
        self._last, self._stamp = 0.0, -math.inf

    def take(
        self, loop: LoopConnection, point: m.SetPoint | m.SetPoints, stamp: float = math.nan
    ) -> Refused | None:
        """Show the loop a set point; one that was overtaken by a later one is left out."""
        found = place(point)
        if not all(math.isfinite(value) for pair in found for value in pair):
            return Refused("a set point is not finite", "give finite numbers", True)
        if len(found) != self._stages:
            reason = f"a set point of {len(found)} stages, where {self._stages} follow"
            return Refused(reason, "give the positions of those that follow")
        if not loop.under_way(self.motion):
            return NOT_FOLLOWING
        now = at = time.monotonic()
        if abs(stamp) > LATEST:
            return Refused("the time of a set point is not a time", f"up to {LATEST:g} s", True)
        if math.isfinite(stamp):
            if stamp <= self._stamp:
                return None
            self._ahead += DRIFT * (now - self._last)
            self._ahead = min(self._ahead, now - stamp)
            self._stamp, self._last = stamp, now
            at = min(max(stamp + self._ahead, now - OLDEST), now)
        loop.point(found, round(at * 1e9))
        return None


REST_S = 5.0  # longest wait for rest at the end
FIRST_S = 1.0  # longest wait for the first period
LOOK_S = 0.05  # between looks at lost clients, and at the position
REOPEN_S, REOPEN_MOST_S = 1.0, 5.0  # between two tries to open a failed rig again
LASTED_S = 30.0  # a rig that ran for so long failed by something new


class Station:
    """Starts the loop process and speaks with it; a context manager.

    One client at a time holds control; all may watch and stop. Nothing moves on `start`.
    Coroutines belong to the servers' event loop, everything else may be called from any thread.
    `machine` is the MODULE:FUNCTION that makes what the loop drives.
    """

    def __init__(
        self,
        rig: str = TWIN,
        *,
        seed: int = 0,
        settings: AnySettings | None = None,
        state: Path | None = None,
        machine: str = LIVE,
    ) -> None:
        settings = settings or LiveSettings()
        self.settings, self.rig = settings, rig
        self._serve = settings.serve
        self._holders = Holders(self._serve.client_timeout)
        self._connection = LoopConnection(rig, seed, settings, state, machine)
        attributes: dict[str, Attribute] = {"rig": rig, "seed": seed, "modes": ", ".join(MODES)}
        self._recordings = Recordings(self._connection, settings, attributes)
        self.captures = Captures(self._connection, settings)
        self.started = False  # has its first period read the sensors?
        self._attending: Future[Any] | None = None
        self._ended = asyncio.Event()
        self._stream = Stream()

    @property
    def trail(self) -> Trail:
        return self._connection.trail

    @property
    def realtime(self) -> str:
        """What the system granted the loop (priority, core)."""
        return self._connection.realtime

    def start(self) -> None:
        """Start the loop process; returns once its first period has read the sensors."""
        if self._connection.running:
            return
        self.stop()  # what is left of a loop that died
        self._connection.start()
        self._ended = asyncio.Event()
        self._attending = _background.submit(self._attend())
        deadline = time.monotonic() + FIRST_S  # a rig may be silent: the snapshot says so
        while not self.snapshot().pace.periods and time.monotonic() < deadline:
            time.sleep(1e-3)
        self.started = True

    def stop(self) -> None:
        """Decelerate, make the outputs safe, end the loop process and the recording."""
        if self._attending is not None:
            _background.call_soon(self._ended.set)
            self._attending.result()
            self._attending = None
        if self._connection.running:
            _background.call(self._connection.sender.ask(m.Stop(client="shutdown")))
            deadline = time.monotonic() + REST_S
            while time.monotonic() < deadline and self._connection.moving:
                time.sleep(0.01)
            _background.call(self._update())
        self._connection.stop()
        self.end_recording()

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    # What everyone may see

    @property
    def holder(self) -> str:
        return self._holders.holder

    @property
    def stages(self) -> tuple[str, ...]:
        return self._connection.stages

    @property
    def channels(self) -> tuple[str, ...]:
        return self._connection.channels

    @property
    def in_force(self) -> InForce:
        """Gains and speed limits in force."""
        return self._connection.ledger.in_force

    def snapshot(self) -> Snapshot:
        recording = self._recordings.state
        return _watching.snapshot(self._connection, self.settings, recording, self._holders)

    def telemetry(self, since: int = -1) -> tuple[int, NDArray[np.float64], Sequence[str]]:
        """Telemetry after row `since`: (number of the last row, float64[columns, rows], names)."""
        shared, names = self._connection.shared, self.settings.telemetry.names
        if shared is None:
            return -1, np.empty((len(names), 0)), names
        _, count, block = shared.since(since + 1)
        return count - 1, block, names

    def events(self, since: int = -1) -> tuple[int, list[Event]]:
        """Events after number `since`: (number of the last one, events)."""
        return self._connection.ledger.events(since)

    def finished(self, motion: int, timeout: float | None = None) -> Finished | None:
        """How a motion ended, waiting up to `timeout`; None while it is under way or unknown.

        Within the event loop only with a timeout of 0.
        """
        ledger = self._connection.ledger
        return ledger.finished(motion) if timeout == 0.0 else ledger.awaited(motion, timeout)

    async def news(self) -> None:
        """Wait for the next event, end of a motion or client that leaves."""
        await self._connection.ledger.news()

    # Clients

    @on_loop
    def connect(self, client: str) -> None:
        """List the client as one that watches."""
        self._holders.connect(client)
        self.trail.client("client", client, "connected")

    @on_loop
    def disconnect(self, client: str) -> None:
        """Remove the client; a holder of control counts as lost."""
        if client in self._holders.clients:
            self.trail.client("client", client, "disconnected")
        self.captures.end(client)
        if self._holders.disconnect(client):
            self._lost(client, "disconnected")
        self._connection.ledger.wake()

    @on_loop
    def acquire(self, client: str) -> Reply:
        """Give control to the client, unless another one holds it."""
        before = self._holders.holder
        reply = self._holders.acquire(client)
        if isinstance(reply, Accepted) and before != client:
            self._tell("control", "acquired", {"client": client})
        return reply

    @on_loop
    def release(self, client: str) -> Reply:
        """Give control back, which ends a jog but no other motion."""
        reply = self._holders.release(client)
        if isinstance(reply, Accepted):
            self._tell("control", "released", {"client": client})
            self._connection.sender.released()
        return reply

    @on_loop
    def heartbeat(self, client: str) -> None:
        """Note that the client is alive."""
        self._holders.heartbeat(client)

    @on_loop
    def refusal(self, client: str) -> Refused | None:
        """Why this client may not change anything now, or None."""
        return self._holders.refusal(client)

    # Orders

    @property
    def stops(self) -> Stops:
        """Counts of stops so far, for `order`."""
        return self._connection.sender.stops

    async def order(self, client: str, request: Any, since: Stops | None = None) -> Reply:
        """Pass a request to the machine and wait for its reply; a client's mistake never raises.

        It is refused without control, without a loop, or after a later stop. Stop and EmergencyStop
        need no control; they, Disable and the end of a jog never expire.
        """
        reply = await self._order(client, request, since)
        if isinstance(request, m.Request):
            self.trail.order(self._connection.time, client, request, reply)
        return reply

    def request(self, client: str, request: Any, since: Stops | None = None) -> Reply:
        """As `order`, from another thread."""
        return _background.call(self.order(client, request, since))

    async def _order(self, client: str, request: Any, since: Stops | None) -> Reply:
        since = self._connection.sender.stops if since is None else since
        if not isinstance(request, m.Request) or isinstance(request, m.LinkLost):
            found = type(request).__name__
            return Refused(f"{found} is not a request of a client", "a request of control.live")
        if isinstance(request, m.EmergencyStop):
            if math.isnan(await self._connection.sender.emergency_stop(client)):
                return unconfirmed.SILENT
            return Accepted()
        if not isinstance(request, m.Stop):
            refusal = self._holders.refusal(client)
            if refusal is not None:
                return refusal
            reply = await self._connection.sender.ask(
                request._replace(client=client), lambda: self._holders.refusal(client), since
            )
            if isinstance(request, m.Follow) and isinstance(reply, Accepted):
                self._stream = Stream(reply.id, len(self.stages) if request.stage == m.ALL else 1)
            return reply
        self._holders.heartbeat(client)
        reply = await self._connection.sender.ask(request._replace(client=client))
        return unconfirmed.SILENT if reply is SILENT else reply

    def renew(self, client: str) -> None:
        """Keep the jog of this client under way."""
        if self._holders.refusal(client) is None:
            self._connection.renew()

    def point(
        self, client: str, point: m.SetPoint | m.SetPoints, stamp: float = math.nan
    ) -> Refused | None:
        """Show the machine a streamed set point; why it is not followed, or None.

        `stamp` is its time on any clock [s]: delays on the way that vary are then made up for.
        """
        refusal = self._holders.refusal(client)
        if refusal is None:
            refusal = self._stream.take(self._connection, point, stamp)
        return refusal

    def streams(self, client: str) -> bool:
        """Whether a motion follows the set points of this client."""
        return self.holder == client and self._connection.under_way(self._stream.motion)

    def emergency(self, client: str = "") -> float:
        """Emergency stop past every queue: s until outputs were safe, NaN if unconfirmed."""
        return self._pressed(client, self._connection.sender.emergency(client))

    async def emergency_stop(self, client: str = "") -> float:
        """As `emergency`, within the event loop."""
        return self._pressed(client, await self._connection.sender.emergency_stop(client))

    def _pressed(self, client: str, took: float) -> float:
        reply = unconfirmed.SILENT if math.isnan(took) else Accepted()
        self.trail.order(self._connection.time, client, m.EmergencyStop(), reply)
        return took

    # Recording: these wait for the disk

    @property
    def recorded(self) -> tuple[Path, ...]:
        """Files of all recordings, oldest first."""
        return self._recordings.begun

    def record(self, path: Path, *, overwrite: bool = False, client: str = "") -> None:
        """Record telemetry from now on into an HDF5 file."""
        self._recordings.begin(path, client, overwrite=overwrite)

    def end_recording(self, client: str = "") -> RecordingState:
        """Complete the file and close it."""
        return self._recordings.end(client=client)

    # What goes on by itself

    async def _attend(self) -> None:
        await asyncio.gather(self._mind(), self._keep(), self._reopen())

    async def _mind(self) -> None:
        """Look after lost clients and captures."""
        while not await self._ends_within(LOOK_S):
            lost = self._holders.lost()
            if lost:
                self._lost(lost, f"silent for {self._serve.client_timeout:g} s")
            self.captures.look()

    async def _keep(self) -> None:
        """Keep the position file true."""
        while not await self._ends_within(LOOK_S):
            await self._update()

    async def _reopen(self) -> None:
        """Open a failed rig again once it answers; the loop then begins disabled, not homed."""
        pause, opened = REOPEN_S, time.monotonic()
        while not await self._ends_within(pause):
            if self._connection.rig_failed:
                lasted = time.monotonic() - opened > LASTED_S
                pause = REOPEN_S if lasted else min(2.0 * pause, REOPEN_MOST_S)
                await in_thread(self._connection.reopen)
                opened = time.monotonic()

    async def _ends_within(self, pause: float) -> bool:
        """Wait for a moment; True once the station is being stopped."""
        try:
            async with asyncio.timeout(pause):
                return await self._ended.wait()
        except TimeoutError:
            return False

    async def _update(self) -> None:
        try:
            await self._connection.keep()
        except MacromicroError as error:
            self._tell("position", "not kept", {"reason": str(error)})

    def _lost(self, client: str, cause: str) -> None:
        action = self._serve.lost_client
        self._tell("control", "client lost", {"client": client, "why": cause, "action": action})
        self._connection.sender.post(m.LinkLost(action, client))

    def _tell(self, kind: str, cause: str, evidence: dict[str, Any]) -> None:
        self._connection.tell(kind, cause, evidence)
