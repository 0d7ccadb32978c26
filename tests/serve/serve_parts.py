"""A rig and a machine for the loop process of the tests; both are loaded there by name.

The rig logs every output into a file that the test maps, so that the test sees what the
loop's last word to the machine was, whatever became of the processes.
"""

from __future__ import annotations

import math
import mmap
import os
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from macromicro.control import calibration
from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted
from macromicro.serve._machine import View
from macromicro.types import SAFE, Command, Outputs, Sample
from tests.waiting import until

if TYPE_CHECKING:  # the loop process needs no station
    from macromicro.serve.station import Station

LOG = "MACROMICRO_TEST_LOG"
FAIL_AT = "MACROMICRO_TEST_FAIL_AT"
HANGS = "MACROMICRO_TEST_HANGS"  # a path: no reading returns while it is there
DEAF = "MACROMICRO_TEST_DEAF"  # "1": not even when it is interrupted
BAD_STOP = "MACROMICRO_TEST_BAD_STOP"  # "raises", "hangs": so does stop
UNPLUGGED = "MACROMICRO_TEST_UNPLUGGED"  # a path: no call of the rig gets through while it is there
COUNT_AT_START = "MACROMICRO_TEST_COUNT"
CELLS = 8
STEPS, MOTOR, CTRL, PID, ENTERED, LEFT, STOPS, LAST_NS = range(CELLS)


def log(path: str | Path, *, fresh: bool = False) -> Any:
    """The log: float64[CELLS], shared with whoever maps the same file."""
    if fresh:
        Path(path).write_bytes(bytes(8 * CELLS))
    with open(path, "r+b") as file:
        return np.frombuffer(mmap.mmap(file.fileno(), 8 * CELLS), np.float64)


class Logged:
    """A carriage that stands, a Hall sensor with a little noise, a clock of its own."""

    channels = ("encoder", "hall")
    counted = True
    calibration = calibration.default_calibration()

    def __init__(self) -> None:
        self.clock = self
        self.steps = 0
        self.log = log(os.environ[LOG])
        self.fail_at = int(os.environ.get(FAIL_AT, "-1"))
        self.count = float(os.environ.get(COUNT_AT_START, "0"))
        self.next = 0.0

    def _reach(self) -> None:
        if os.path.exists(os.environ.get(UNPLUGGED, "")):
            raise OSError("no such device")

    def now(self) -> float:
        return self.steps * 1e-3

    def wait(self, dt: float) -> None:
        self.next = max(self.next + dt, time.monotonic())
        time.sleep(max(self.next - time.monotonic(), 0.0))

    def read(self) -> Sample:
        self._reach()
        self.steps += 1
        self.log[STEPS] = self.steps
        while os.path.exists(os.environ.get(HANGS, "")):
            try:
                time.sleep(1.0)
            except KeyboardInterrupt:
                if os.environ.get(DEAF) != "1":
                    raise
        if self.steps == self.fail_at:
            raise RuntimeError("the A/D board was unplugged")
        volts = 2.5 + 1e-3 * (self.steps % 2)
        return Sample(self.now(), self.count, volts, math.nan, math.nan, math.nan)

    def write(self, outputs: Outputs) -> None:
        self._reach()
        self.log[MOTOR], self.log[CTRL] = outputs.motor, outputs.ctrl
        self.log[LAST_NS] = time.monotonic_ns()

    def stop(self) -> None:
        if os.environ.get(BAD_STOP) == "raises":
            raise OSError("no board answers")
        while os.environ.get(BAD_STOP) == "hangs":
            time.sleep(1.0)
        self.log[STOPS] += 1
        self.write(SAFE)

    def __enter__(self) -> Logged:
        self._reach()
        self.log[PID], self.log[ENTERED] = os.getpid(), 1.0
        self.next = time.monotonic()
        return self

    def __exit__(self, *what: object) -> None:
        self.stop()
        self.log[LEFT] = 1.0


def logged(seed: int) -> Logged:
    return Logged()


class Driver:
    """A machine that gives 1 V to the motor as long as a motion is under way.

    MoveTo(x) begins a motion that lasts x seconds, Jog one without an end; SetGains asks for
    an illegal output.
    """

    def __init__(self) -> None:
        self.mode, self.motion, self.count, self.left = m.DISABLED, 0, 0, 0.0
        self.trusted, self.offset, self.illegal, self.fan = False, 0.0, False, 0.0
        self.jogs = False
        self.log: list[str] = []

    def begin(self, sample: Sample, restored: Any) -> None:
        self.mode, self.motion, self.count = m.DISABLED, 0, 0
        self.trusted, self.illegal = restored.trusted, False
        self.offset = 0.0 if math.isnan(restored.offset) else restored.offset

    def step(self, sample: Sample, dt: float) -> tuple[Command, Outputs, tuple[Any, ...]]:
        self.log.append("step")
        notices: tuple[Any, ...] = ()
        if self.motion:
            self.left -= dt
            if self.left <= 0.0:
                notices = self._end(m.DONE)
        volts = 1.0 if self.motion else 0.0
        if self.illegal:
            volts = 99.0
        command = Command(0.0, 0.0, 0.0, 0.0, 0.0)
        return command, Outputs(volts, 0.0, self.fan, 0.0), notices

    def accept(self, request: Any) -> tuple[Any, tuple[Any, ...]]:
        self.log.append(type(request).__name__)
        refusal = self.refusal(request)
        if refusal:
            return refusal, ()
        self.jogs = isinstance(request, m.Jog)
        if isinstance(request, m.MoveTo) or (self.jogs and request.speed):
            self.count += 1
            self.left = math.inf if self.jogs else request.position
            self.motion, self.mode = self.count, m.MOVING_MACRO
            return m.Accepted(self.count), ()
        if isinstance(request, m.Fan):
            self.fan = float(request.on)
        if isinstance(request, m.Home):
            self.trusted = True
            event = m.Event(0.0, "trust", "", "", "homed", {"trusted": True})
            return m.Accepted(0), (event,)
        if isinstance(request, m.SetGains):
            self.illegal = True
        if isinstance(request, m.ClearFault):
            self.mode = m.DISABLED if request.gone else self.mode
        return m.Accepted(0), self._ended_by(request)

    def refusal(self, request: Any) -> m.Refused | None:
        if isinstance(request, m.MoveTo | m.Jog) and self.mode == m.FAULT:
            return m.Refused("a fault is latched", "clear it")
        if isinstance(request, m.MoveTo) and not request.position > 0.0:
            return m.Refused("it is no time", "some seconds")
        if isinstance(request, m.Jog) and not request.speed and not (self.motion and self.jogs):
            return m.Refused("no jog is under way", "begin one")
        return None

    def _ended_by(self, request: Any) -> tuple[Any, ...]:
        if isinstance(request, m.Stop | m.Jog):
            return self._end(m.STOPPED_BY_REQUEST)
        if isinstance(request, m.LinkLost):
            event = m.Event(0.0, "link", "", "", request.action, {"client": request.client})
            return (event, *self._end(m.LOST))
        if isinstance(request, m.EmergencyStop):
            self.fan = 0.0
            return (*self.lose("emergency stop on the way"), *self._end(m.EMERGENCY, client=""))
        return ()

    def lose(self, words: str) -> tuple[Any, ...]:
        if not self.trusted:
            return ()
        self.trusted = False
        return (m.Event(0.0, "trust", "", "", words, {"trusted": False}),)

    def fail(self, words: str, evidence: dict[str, Any], lost: bool) -> tuple[Any, ...]:
        self.illegal = False
        notices = self._end(m.FAULTED)
        self.mode = m.FAULT
        return (*notices, m.Event(0.0, "mode", "", "fault", words, evidence))

    def _end(self, outcome: str, **evidence: Any) -> tuple[Any, ...]:
        ended, self.motion, self.mode = self.motion, 0, m.READY
        return (m.Finished(ended, outcome, 0.0, 0.0, evidence),) if ended else ()

    def doubt(self, words: str) -> tuple[Any, ...]:
        return ()

    def found(self) -> None:
        return None

    def view(self) -> View:
        trusted = 1.0 if self.trusted else 0.0
        return View(self.mode, self.motion, 0.0, 0.0, 0.0, 1e-5, trusted, self.offset)


def driver(settings: Any, table: Any, stages: Any = ()) -> Driver:
    return Driver()


def serve_until_killed(state: str) -> None:
    """A serving process of its own: starts, homes, moves for ever."""
    from macromicro.serve.station import Station

    station = Station("serve_parts:logged", state=Path(state), machine="serve_parts:driver")
    station.start()
    station.acquire("test")
    station.request("test", m.Home())
    station.request("test", m.MoveTo(1e6))
    print("moving", flush=True)
    fault = until(lambda: station.snapshot().fault, 600.0)
    print(fault.evidence, fault.remedy, flush=True)


class Running(NamedTuple):
    """One station for the tests of a file, its position file and its rig's log."""

    station: Station
    state: Path
    log: Any


def begun(station: Station, seconds: float = 600.0) -> int:
    """A motion of "test", which gets control."""
    assert isinstance(station.acquire("test"), Accepted)
    reply = station.request("test", m.MoveTo(seconds))
    assert isinstance(reply, Accepted)
    return reply.id


def outcome(station: Station, motion: int) -> str:
    finished = station.finished(motion, 60.0)
    assert finished is not None
    return finished.outcome


def causes(station: Station, kind: str) -> list[str]:
    return [e.cause for e in station.events()[1] if e.kind == kind]
