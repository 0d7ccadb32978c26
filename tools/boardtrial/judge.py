"""What the board's pins may put out, period by period, by what has reached it.

The judge reads the bytes on the line, the lines at the pins and the bench's truth. It knows nothing
of the firmware but the protocol.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from boardsim.bench import Bench
from macromicro.rig.board import framing, protocol
from macromicro.rig.board.control import Board
from macromicro.rig.board.protocol import SPEC

SOON = 4  # periods within which an order or a line acts
SILENCE, DECELERATE = SPEC["silence"], SPEC["decelerate"]  # ms, periods
STEP = 2 * 5.0 / 800 + 1e-6  # V: two steps of the motor's duty, the rounding before and now
HOTTEST = 200.0  # degC; the guard's estimate ends at 170
DEEPEST = 64  # bytes of the stack that must stay


class Judge:
    """Watches a bench.

    Parameters
    ----------
    bench : Bench
        At the board's pins.
    params : Board
        What the board is configured with.
    crc : int
        Of these.
    """

    def __init__(self, bench: Bench, params: Board, crc: int) -> None:
        self.bench, self.params, self.crc = bench, params, crc
        self.unsafe: list[str] = []
        self.configured = False  # the board has these parameters, as the host has read back
        self.hottest = self.fastest = 0.0
        self._stream = framing.Stream()
        self._armed = False
        self._off_since = -1_000_000  # period in which the board became disarmed
        self._heard = -1_000_000  # period of the last frame for the board
        self._asked: deque[float] = deque([0.0] * SOON, maxlen=SOON)  # V, of the motor
        self._holds: deque[bool] = deque([False] * SOON, maxlen=SOON)
        self._pushing = {"limit_low": 0, "limit_high": 0, "bridge_fault": 0}
        self._last = 0.0
        self.since_begin: set[str] = set()  # what has happened since the board was armed

    def bytes_for_board(self, data: bytes) -> None:
        """What is on the line, noise included."""
        for body in self._stream.take(data):
            frame = protocol.heard(body)
            if frame is not None and frame.name in protocol.HOST:
                self._frame(frame)

    def _frame(self, frame: protocol.Frame) -> None:
        self._heard = self.bench.tick
        values = frame.values
        if frame.name == "stop":
            self.disarm()
        elif frame.name == "begin" and self.configured and values["parameters"] == self.crc:
            if not self._armed:
                self.since_begin.clear()
            self._armed = True
        elif frame.name == "outputs":
            self._asked.append(values["motor"])
            self._holds.append(False)
            self.since_begin.add("outputs")
            limits = self.params.guard.limits
            if not (abs(values["motor"]) <= limits.motor and 0.0 <= values["ctrl"] <= limits.ctrl):
                self.since_begin.add("illegal")
                self.disarm()
        elif frame.name == "targets":
            self._holds.append(True)
            self.since_begin.add("targets")

    def disarm(self) -> None:
        """From now on nothing may be put out, until a host begins anew."""
        if self._armed:
            self._off_since = self.bench.tick
        self._armed = False

    def reset(self) -> None:
        """The board was reset: its parameters are gone."""
        self.disarm()
        self._off_since = self.bench.tick - SOON  # at once
        self.configured = False
        self._stream = framing.Stream()

    def _say(self, what: str) -> None:
        if len(self.unsafe) < 50:
            self.unsafe.append(f"period {self.bench.tick}: {what}")

    def period(self) -> None:
        """After each period."""
        bench = self.bench
        motor, ctrl, enabled = bench.outputs()
        truth = bench.truth()
        self.hottest = max(self.hottest, truth.wire)
        self.fastest = max(self.fastest, abs(truth.speed))
        quiet = bench.tick - self._heard
        if quiet >= SILENCE + DECELERATE + SOON:
            self.since_begin.add("silence")
            self.disarm()
        on = motor != 0.0 or ctrl != 0.0 or enabled != 0.0
        if on and not self._armed and bench.tick - self._off_since > SOON:
            self._say(f"{motor:.2f} V, CTRL {ctrl:.2f} V, enable {enabled:.0f} without leave")
        limits = self.params.guard.limits
        if not abs(motor) <= limits.motor + STEP or not -1e-9 <= ctrl <= limits.ctrl + 0.021:
            self._say(f"{motor:.3f} V, CTRL {ctrl:.3f} V beyond the limits")
        if quiet > SILENCE + SOON:
            if ctrl != 0.0:
                self._say(f"CTRL {ctrl:.2f} V after {quiet} ms of silence")
            if abs(motor) > abs(self._last) + STEP:
                self._say(f"{motor:.2f} V after {self._last:.2f} V in silence")
        elif quiet < SILENCE - SOON and on and self._armed and not any(self._holds):
            near = min(abs(motor - each) for each in (*self._asked, 0.0) if math.isfinite(each))
            if near > STEP:
                self._say(f"{motor:.3f} V that nobody asked for, of {list(self._asked)}")
        self._lines(motor, on)
        if truth.wire > HOTTEST:
            self._say(f"the wire is at {truth.wire:.0f} degC")
        self._last = motor

    def _lines(self, motor: float, on: bool) -> None:
        low, high = self.bench.tripped()
        forced = self.bench.forced
        active = {
            "limit_low": (bool(forced.get("limit_low", low)), motor < 0.0),
            "limit_high": (bool(forced.get("limit_high", high)), motor > 0.0),
            "bridge_fault": (forced.get("bridge_fault", 1) == 0, on),
        }
        for name, (tripped, wrong) in active.items():
            self._pushing[name] = self._pushing[name] + 1 if tripped and wrong else 0
            if tripped:
                self.since_begin.add(name)
            if self._pushing[name] > SOON:
                self._say(f"{motor:.2f} V for {self._pushing[name]} ms against {name}")

    def still_on(self) -> bool:
        """Whether the pins put anything out now."""
        return bool(np.any(self.bench.outputs()))
