"""`Station`: the machine as every client sees it, whatever it speaks."""

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
from macromicro.serve.choosing import AnySettings
from macromicro.serve.loop_spec import LIVE
from macromicro.serve.observed import Observed
from macromicro.serve.sending import SILENT, Stops
from macromicro.serve.settings import LiveSettings
from macromicro.serve.snapshot import RecordingState
from macromicro.serve.trail import Trail

REST_S = 5.0  # longest wait for rest at the end


class Station(Observed):
    """Starts the loop process and speaks with it; thread-safe.

    One client at a time holds control; all may watch, stop and make an emergency stop. A
    client is a name of the caller's choice ("scpi 127.0.0.1:40112"). Nothing moves on
    `start`. As a context manager it starts and stops.

    `rig`: "twin" or MODULE:FACTORY as in docs/rigs.md, of two axes two with "+" between;
    `seed`: of a virtual rig's noise;
    `settings`: as `serve.settings.load` gives them; `state`: file that keeps position and
    trust between runs, by default one for each rig in the user's state folder; `machine`:
    MODULE:FUNCTION that makes what the loop drives, by default the live machine.
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
        self._ended = threading.Event()

    @property
    def trail(self) -> Trail:
        """Takes note of who orders what."""
        return self._connection.trail

    @property
    def realtime(self) -> str:
        """What the system granted the loop (priority, core), in words."""
        return self._connection.realtime

    def start(self) -> None:
        """Start the loop process; returns when it runs, all kernels compiled, outputs safe.

        Raises `MacromicroError` if another server has the state file (the message names its
        process and the remedy) or the loop process cannot start; `InputError` for the rig.
        Numbers of motions count from 1 again. Does nothing where it is running.
        """
        if self._connection.running:
            return
        self.stop()  # what is left of a loop that died
        self._connection.start()
        self._ended.clear()
        self._minder = threading.Thread(target=self._mind, name="minder", daemon=True)
        self._minder.start()

    def stop(self) -> None:
        """Decelerate, make the outputs safe, end the loop process and the recording.

        Motions under way end as "stopped". Does nothing where it is not running.
        """
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
        """From now on the client is listed as one that watches. InputError for "" as name."""
        self._holders.connect(client)
        self.trail.client("client", client, "connected")

    def disconnect(self, client: str) -> None:
        """The client is gone; if it held control, this is a lost client (`heartbeat`)."""
        if client in self._holders.clients:
            self.trail.client("client", client, "disconnected")
        with self._connection.turn:
            if self._holders.disconnect(client):
                self._lost(client, "disconnected")

    def acquire(self, client: str) -> Reply:
        """Give control to the client: Accepted, or Refused where another one holds it, or where
        the client has no name."""
        with self._connection.turn:
            before = self._holders.holder
            reply = self._holders.acquire(client)
            if isinstance(reply, Accepted) and before != client:
                self._tell("control", "acquired", {"client": client})
        return reply

    def release(self, client: str) -> Reply:
        """Give control back: Accepted, or Refused where this client does not hold it.

        A jog under way ends, as nobody is left to end it; any other motion goes on to its end.
        """
        with self._connection.turn:
            reply = self._holders.release(client)
            if isinstance(reply, Accepted):
                self._tell("control", "released", {"client": client})
                self._connection.released()
        return reply

    def heartbeat(self, client: str) -> None:
        """The client is alive; so does `request` say. A holder that is silent for
        serve.client_timeout is lost: control is free, and the machine stops or holds as
        serve.lost_client says."""
        self._holders.heartbeat(client)

    # Orders

    @property
    def stops(self) -> Stops:
        """Stops of all kinds so far; who lets an order wait takes note of them (`request`)."""
        return self._connection.stops

    def request(self, client: str, request: Any, since: Stops | None = None) -> Reply:
        """Pass a request of `control.live.messages` to the machine and wait for its reply.

        Refused at once, and not passed on, where the client does not hold control (Stop and
        EmergencyStop need no control), or where no loop answers. Never raises for what a
        client can cause. A motion, Enable and ClearFault are refused, too, where anybody asked
        for a stop, or the client lost control, behind `since` (the `stops` of the time when
        the client ordered it; by default of now) and before it has begun; and what the loop
        comes to later than serve.reply_timeout is refused and not done (but Stop,
        EmergencyStop, Disable, and a jog's end are always done).
        """
        reply = self._request(client, request, since)
        if isinstance(request, m.Request):
            self.trail.order(self._connection.time, client, request, reply)
        return reply

    def _request(self, client: str, request: Any, since: Stops | None) -> Reply:
        since = self._connection.stops if since is None else since
        if not isinstance(request, m.Request) or isinstance(request, m.LinkLost):
            found = type(request).__name__
            return Refused(f"{found} is no request of a client", "a request of control.live")
        if isinstance(request, m.EmergencyStop):
            if math.isnan(self._connection.emergency(client)):
                return unconfirmed.SILENT
            return Accepted()
        if not isinstance(request, m.Stop):
            refusal = self._holders.refusal(client)
            if refusal is not None:
                return refusal
            return self._connection.ask(
                request._replace(client=client), lambda: self._holders.refusal(client), since
            )
        self._holders.heartbeat(client)
        reply = self._connection.ask(request._replace(client=client))
        return unconfirmed.SILENT if reply is SILENT else reply

    def emergency(self, client: str = "") -> float:
        """Emergency stop: outputs safe before the loop's next control step.

        Needs no control, waits for nobody else, passes through no queue. `client`: who asks,
        for the events. Returns the seconds from this call until the outputs were safe, measured
        by the loop; NaN where it did not answer within a second: then the loop process is ordered
        to end, which makes them safe as far as the rig still answers it.
        """
        took = self._connection.emergency(client)
        reply = unconfirmed.SILENT if math.isnan(took) else Accepted()
        self.trail.order(self._connection.time, client, m.EmergencyStop(), reply)
        return took

    # Recording

    def refusal(self, client: str) -> Refused | None:
        """Why this client may not change anything now, recordings included: another one, or
        nobody, holds control. None if it may."""
        return self._holders.refusal(client)

    @property
    def recorded(self) -> tuple[Path, ...]:
        """Files of all recordings that were begun, by whomever, oldest first."""
        return self._recordings.begun

    def record(self, path: Path, *, overwrite: bool = False, client: str = "") -> None:
        """Record telemetry from now on into an HDF5 file, in a folder that is made where
        there is none; raises as `Recorder` does, and `MacromicroError` where a recording is
        under way or nothing runs. `client`: who asks, for the events."""
        self._recordings.begin(path, client, overwrite=overwrite)

    def end_recording(self, client: str = "") -> RecordingState:
        """Complete the file and close it; what it holds now."""
        return self._recordings.end(client=client)

    # What goes on by itself

    def _mind(self) -> None:
        """Look after lost clients and the position file."""
        while not self._ended.wait(0.05):
            with self._connection.turn:
                lost = self._holders.lost()
                if lost:
                    self._lost(lost, f"silent for {self._serve.client_timeout:g} s")
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
