"""A station without a machine: it has `Station`'s methods, and notes what it is asked for."""

from __future__ import annotations

import asyncio
import math
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from macromicro.control.live import messages as m
from macromicro.control.live import parameters, state, targets
from macromicro.errors import MacromicroError
from macromicro.serve import requests
from macromicro.serve._ledger import InForce, Trail
from macromicro.serve.capturing import Captures
from macromicro.serve.settings import LiveSettings
from macromicro.serve.shared import NAMES
from macromicro.serve.snapshot import Pace, RecordingState, Snapshot, Trouble

MOTIONS = (m.Home, m.MoveTo, m.MoveBy, m.MoveMacro, m.MoveMicro, m.MoveMacroBy,
           m.MoveMicroBy, *m.AXES_MOVES, m.Jog, m.Follow,
           m.Programme)  # fmt: skip


class FakeStation:
    """Motions begin on request and end when the test says so (`end`)."""

    settings = LiveSettings()
    stages = m.STAGES
    started = True

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self.requests: list[Any] = []
        self.emergencies = 0
        self.renewed: list[str] = []
        self.points: list[tuple[Any, float]] = []
        self.connected: list[str] = []
        self.gone: list[str] = []
        self.beats: list[str] = []
        self.holder = ""
        self.trail = Trail()
        self.mode = "ready"
        self.motion = 0
        self.given = 0
        self.ended: dict[int, m.Finished] = {}
        self.told: list[m.Event] = []
        self.fault: Trouble | None = None
        self.loop = SimpleNamespace(shared=None, channels=(), running=True, ledger=self)
        self.captures = Captures(self.loop, self.settings)  # type: ignore[arg-type]
        self.recording = RecordingState(False, "", 0, 0, "")
        self.trusted = True
        self.target = math.nan
        self.p = parameters.prepare(self.settings.live, self.settings.controller)
        self.s = state.begin(self.p)
        self.running = True
        self.copied: list[int] = []
        self.rows = np.arange(len(NAMES) * 5000, dtype=float).reshape(len(NAMES), 5000)

    def connect(self, client: str) -> None:
        with self.lock:
            self.connected.append(client)

    def disconnect(self, client: str) -> None:
        with self.lock:
            self.gone.append(client)
            if client in self.connected:
                self.connected.remove(client)
            if self.holder == client:
                self.holder = ""
                if self.motion:
                    self.end("lost")

    def acquire(self, client: str) -> m.Reply:
        with self.lock:
            if self.holder not in ("", client):
                return m.Refused(f"{self.holder} holds control", "wait")
            self.holder = client
            return m.Accepted()

    def release(self, client: str) -> m.Reply:
        with self.lock:
            if self.holder != client:
                return m.Refused("this client does not hold control", "acquire it first")
            self.holder = ""
            return m.Accepted()

    def refusal(self, client: str) -> m.Refused | None:
        return None if self.holder == client else m.Refused("this client does not hold control", "")

    def heartbeat(self, client: str) -> None:
        self.beats.append(client)

    def renew(self, client: str) -> None:
        self.renewed.append(client)

    def streams(self, client: str) -> bool:
        return bool(self.motion) and isinstance(self.requests[-1], m.Follow)

    def point(self, client: str, point: Any, stamp: float = math.nan) -> m.Refused | None:
        if self.holder != client:
            return m.Refused("this client does not hold control", "acquire control first")
        if not self.streams(client):
            return m.Refused("no set points are followed", "begin with follow")
        self.points.append((point, stamp))
        return None

    @property
    def stops(self) -> tuple[int, int]:
        return sum(isinstance(r, m.Stop) for r in self.requests), self.emergencies

    def request(self, client: str, request: Any, since: Any = None) -> m.Reply:  # noqa: PLR0911, PLR0912
        with self.lock:
            if since not in (None, self.stops) and requests.begins(request):
                return requests.OVERTAKEN
            if self.holder != client and not isinstance(request, m.Stop | m.EmergencyStop):
                return m.Refused("this client does not hold control", "acquire control first")
            if self.beyond(request):
                return m.Refused("beyond the soft limits", "stay within them", True)
            if isinstance(request, m.SetLimits):
                self.s, reply, _ = targets.change_limits(self.p, self.s, request.limits)
                if isinstance(reply, m.Refused):
                    return reply
            self.requests.append(request)
            if isinstance(request, m.Stop):
                if self.motion:
                    self.end("stopped")
                return m.Accepted()
            if isinstance(request, m.Disable):
                if self.motion:
                    self.end("stopped")
                self.go("disabled")
                return m.Accepted()
            if isinstance(request, m.Enable):
                if self.mode != "disabled":
                    self.requests.pop()
                    return m.Refused(
                        "the positioner is enabled", "use it as it is, or disable it first"
                    )
                self.go("ready")
            if isinstance(request, MOTIONS):
                if self.mode == "disabled":
                    return m.Refused("the positioner is disabled", "enable it first")
                if self.motion:
                    return m.Refused("a motion is under way", "wait for its end, or stop it")
                self.given += 1
                self.motion = self.given
                self.go("moving-macro")
                return m.Accepted(self.given)
            if isinstance(request, m.SetGains):
                facts = {path: {"old": 0, "new": new} for path, new in request.changes}
                self.told.append(m.Event(0.0, "gains", self.mode, self.mode, "set gains", facts))
            return m.Accepted()

    async def order(self, client: str, request: Any, since: Any = None) -> m.Reply:
        return self.request(client, request, since)

    async def emergency_stop(self, client: str = "") -> float:
        return self.emergency(client)

    async def news(self) -> None:
        await asyncio.sleep(0.005)  # the test may have changed something

    @property
    def in_force(self) -> InForce:
        found = InForce(self.settings)
        for event in self.told:
            found.follow(event)
        return found

    def beyond(self, request: Any) -> bool:
        q, wanted = self.s.limits, []
        if isinstance(request, m.MoveTo):
            wanted = [(request.position, q.whole_low, q.whole_high)]
        if isinstance(request, m.MoveBy):
            place = self.snapshot().position_m + request.distance
            wanted = [(place, q.whole_low, q.whole_high)]
        if isinstance(request, m.MoveMacro):
            wanted = [(request.counts, q.macro_low, q.macro_high)]
        if isinstance(request, m.MoveMicro):
            wanted = [(request.position, q.micro_low, q.micro_high)]
        if isinstance(request, m.Programme):
            ends = ((q.macro_low, q.macro_high), (q.micro_low, q.micro_high))
            stages, targets = request.plan.stage.tolist(), request.plan.target.tolist()
            wanted = [(x, *ends[k]) for k, x in zip(stages, targets, strict=True)]
        return not all(low <= x <= high for x, low, high in wanted)

    def go(self, mode: str) -> None:
        self.told.append(m.Event(1.5, "mode", self.mode, mode, "test", {"error_mm": 0.25}))
        self.mode = mode

    def end(self, outcome: str) -> None:
        with self.lock:
            self.ended[self.motion] = m.Finished(self.motion, outcome, 0.01, 3e-5, {"error_mm": 1})
            self.motion = 0
            self.go("holding" if outcome == "done" else "stopped")

    def emergency(self, client: str = "") -> float:
        with self.lock:
            self.emergencies += 1
            if self.motion:
                self.end("emergency")
            self.go("disabled")
            return 0.001

    def snapshot(self) -> Snapshot:
        return Snapshot(
            time_s=1.0,
            age_s=0.001,
            running=self.running,
            mode=self.mode,
            position_m=0.0421234,
            uncertainty_m=35.7e-6,
            trusted=self.trusted,
            trust="homed",
            macro_count=590.0,
            macro_reference=589.0,
            micro_m=0.31e-3,
            micro_reference_m=0.3e-3,
            motor_v=math.nan,
            ctrl_v=1.5,
            fan=False,
            temperature_c=61.5,
            motion=self.motion,
            limits=self.s.limits,
            fault=self.fault,
            pace=Pace(1000, 3, 0.003, 1.5e-3, 2e-4),
            recording=self.recording,
            holder=self.holder,
            clients=tuple(self.connected),
            emergency_s=math.nan,
            target_m=self.target,
        )

    def telemetry(self, since: int = -1) -> tuple[int, Any, Any]:
        self.copied.append(self.rows.shape[1] - 1 - since)
        return self.rows.shape[1] - 1, self.rows[:, since + 1 :], NAMES

    def events(self, since: int = -1) -> tuple[int, list[m.Event]]:
        return len(self.told) - 1, self.told[since + 1 :]

    def finished(self, motion: int, timeout: float | None = None) -> m.Finished | None:
        return self.ended.get(motion)

    def record(self, path: Path, *, overwrite: bool = False, client: str = "") -> None:
        if self.recording.active:
            raise MacromicroError("a recording is under way")
        self.recording = RecordingState(True, str(path), 12, 0, "")

    def end_recording(self, client: str = "") -> RecordingState:
        self.recording = self.recording._replace(active=False)
        return self.recording
