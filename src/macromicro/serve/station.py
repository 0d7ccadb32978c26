from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Refused, Reply
from macromicro.errors import MacromicroError
from macromicro.rig.opening import TWIN
from macromicro.serve import unconfirmed
from macromicro.serve._observed import Observed
from macromicro.serve._returning import Returning
from macromicro.serve._sending import SILENT, Stops
from macromicro.serve._stream import Stream
from macromicro.serve._trail import Trail
from macromicro.serve.choosing import AnySettings
from macromicro.serve.loop_spec import LIVE
from macromicro.serve.settings import LiveSettings
from macromicro.serve.snapshot import RecordingState

REST_S = 5.0  # longest wait for rest at the end
FIRST_S = 1.0  # longest wait for the first period


class Station(Observed):
    """Starts the loop process and speaks with it; thread-safe, a context manager.

    One client at a time holds control; all may watch and stop. Nothing moves on `start`.
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
        super().__init__(rig, seed, settings or LiveSettings(), state, machine)
        self._serve = self.settings.serve
        self._minder: threading.Thread | None = None
        self._returning = Returning(self._connection)
        self._ended = threading.Event()
        self._following, self._stream = threading.Lock(), Stream()

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
        self._ended.clear()
        self._minder = threading.Thread(target=self._mind, name="minder", daemon=True)
        self._minder.start()
        self._returning.start()
        deadline = time.monotonic() + FIRST_S  # a rig may be silent: the snapshot says so
        while not self.snapshot().pace.periods and time.monotonic() < deadline:
            time.sleep(1e-3)

    def stop(self) -> None:
        """Decelerate, make the outputs safe, end the loop process and the recording."""
        self._returning.stop()
        if self._connection.running:
            self._connection.ask(m.Stop(client="shutdown"))
            deadline = time.monotonic() + REST_S
            while time.monotonic() < deadline and self._connection.moving:
                time.sleep(0.01)
        self._ended.set()
        if self._minder is not None and self._minder is not threading.current_thread():
            self._minder.join()
            self._minder = None
        self._connection.stop()
        self.end_recording()

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()

    # Clients

    def connect(self, client: str) -> None:
        """List the client as one that watches."""
        self._holders.connect(client)
        self.trail.client("client", client, "connected")

    def disconnect(self, client: str) -> None:
        """Remove the client; a holder of control counts as lost."""
        if client in self._holders.clients:
            self.trail.client("client", client, "disconnected")
        self.captures.end(client)
        with self._connection.turn:
            if self._holders.disconnect(client):
                self._lost(client, "disconnected")

    def acquire(self, client: str) -> Reply:
        """Give control to the client, unless another one holds it."""
        with self._connection.turn:
            before = self._holders.holder
            reply = self._holders.acquire(client)
            if isinstance(reply, Accepted) and before != client:
                self._tell("control", "acquired", {"client": client})
        return reply

    def release(self, client: str) -> Reply:
        """Give control back, which ends a jog but no other motion."""
        with self._connection.turn:
            reply = self._holders.release(client)
            if isinstance(reply, Accepted):
                self._tell("control", "released", {"client": client})
                self._connection.released()
        return reply

    def heartbeat(self, client: str) -> None:
        """Note that the client is alive."""
        self._holders.heartbeat(client)

    # Orders

    @property
    def stops(self) -> Stops:
        """Counts of stops so far, for `request`."""
        return self._connection.stops

    def request(self, client: str, request: Any, since: Stops | None = None) -> Reply:
        """Pass a request to the machine and wait for its reply; a client's mistake never raises.

        It is refused without control, without a loop, or after a later stop. Stop and EmergencyStop
        need no control; they, Disable and the end of a jog never expire.
        """
        reply = self._request(client, request, since)
        if isinstance(request, m.Request):
            self.trail.order(self._connection.time, client, request, reply)
        return reply

    def _request(self, client: str, request: Any, since: Stops | None) -> Reply:
        since = self._connection.stops if since is None else since
        if not isinstance(request, m.Request) or isinstance(request, m.LinkLost):
            found = type(request).__name__
            return Refused(f"{found} is not a request of a client", "a request of control.live")
        if isinstance(request, m.EmergencyStop):
            if math.isnan(self._connection.emergency(client)):
                return unconfirmed.SILENT
            return Accepted()
        if not isinstance(request, m.Stop):
            refusal = self._holders.refusal(client)
            if refusal is not None:
                return refusal
            reply = self._connection.ask(
                request._replace(client=client), lambda: self._holders.refusal(client), since
            )
            if isinstance(request, m.Follow) and isinstance(reply, Accepted):
                with self._following:
                    self._stream = Stream(reply.id, 2 if request.stage == m.ALL else 1)
            return reply
        self._holders.heartbeat(client)
        reply = self._connection.ask(request._replace(client=client))
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
            with self._following:
                refusal = self._stream.take(self._connection, point, stamp)
        return refusal

    def streams(self, client: str) -> bool:
        """Whether a motion follows the set points of this client."""
        return self.holder == client and self._connection.under_way(self._stream.motion)

    def emergency(self, client: str = "") -> float:
        """Emergency stop past every queue: s until outputs were safe, NaN if unconfirmed."""
        took = self._connection.emergency(client)
        reply = unconfirmed.SILENT if math.isnan(took) else Accepted()
        self.trail.order(self._connection.time, client, m.EmergencyStop(), reply)
        return took

    # Recording

    def refusal(self, client: str) -> Refused | None:
        """Why this client may not change anything now, or None."""
        return self._holders.refusal(client)

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

    def _mind(self) -> None:
        """Look after lost clients, captures and the position file."""
        while not self._ended.wait(0.05):
            with self._connection.turn:
                lost = self._holders.lost()
                if lost:
                    self._lost(lost, f"silent for {self._serve.client_timeout:g} s")
            self.captures.look()
            self._guarded(self._connection.keep)
        self._guarded(self._connection.keep)

    def _lost(self, client: str, cause: str) -> None:
        action = self._serve.lost_client
        self._tell("control", "client lost", {"client": client, "why": cause, "action": action})
        self._connection.post(m.LinkLost(action, client))

    def _guarded(self, do: Callable[[], None]) -> None:
        try:
            do()
        except MacromicroError as error:
            self._tell("position", "not kept", {"reason": str(error)})

    def _tell(self, kind: str, cause: str, evidence: dict[str, Any]) -> None:
        self._connection.tell(kind, cause, evidence)
