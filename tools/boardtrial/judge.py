"""What the board's pins may put out, period by period, by what has reached it.

The judge reads the bytes on the line, the lines at the pins and the bench's truth. It knows nothing
of the firmware but the protocol.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from boardsim.bench import Bench
from macromicro.rig.board import framing, protocol
from macromicro.rig.board.control import Board
from macromicro.rig.board.protocol import SPEC

SOON = 4  # periods within which an order or a line acts
SILENCE, DECELERATE = SPEC["silence"], SPEC["decelerate"]  # ms, periods
STEP = 2 * 5.0 / 800 + 1e-6  # V: two steps of the motor's duty, the rounding before and now
CTRL_STEP = 5.0 / 250 + 1e-3  # V: a step of the wire's duty
PER_PERIOD = 100  # bytes that the line carries in a period, at 10 bits each
ORDER = 20  # bytes of the longest order on the line: a host sends one in a period
GUARD = 50  # periods that the guard may take before the board stops
TOLD = 50  # unsafe outputs that are told in words; all are counted
HOTTEST = 200.0  # degC; the guard's estimate ends at 170
DEEPEST = 64  # bytes of the stack that must stay


class _Allowed(NamedTuple):
    """What the pins may show: from the period `tick` on, `SOON` periods long."""

    tick: int
    holds: bool
    low: float
    high: float
    ctrl: float


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
        self.unsafe: list[str] = []  # the first ones
        self.count = 0  # of all
        self.configured = False  # the board has these parameters, as the host has read back
        self.hottest = self.fastest = 0.0
        self._stream = framing.Stream()
        self._armed = False
        self._off_since = -1_000_000  # period in which the board became disarmed
        self._heard = -1_000_000  # period of the last frame for the board
        self._motor = self._ctrl = 0.0  # V, as asked for last
        self._holds = False  # the board closes the loop: what it does within the limits is its own
        self._allowed: deque[_Allowed] = deque()  # of the last periods
        self._queue = 0  # bytes that the line has not carried yet
        self._flooded = -1_000_000  # last period with more bytes than a host's order
        self.floods = 0  # periods with such bytes, or just behind them
        self._on = False
        self._pushing = {"limit_low": 0, "limit_high": 0, "bridge_fault": 0}
        self._last = 0.0
        self.since_begin: set[str] = set()  # what has happened since the board was armed

    def bytes_for_board(self, data: bytes) -> None:
        """What is on the line, noise included."""
        self._queue += len(data)
        for body in self._stream.take(data):
            frame = protocol.decode(body)
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
                self._order(0.0, 0.0)
            self._armed = True
        elif frame.name == "outputs":
            self.since_begin.add("outputs")
            limits = self.params.guard.limits
            if abs(values["motor"]) <= limits.motor and 0.0 <= values["ctrl"] <= limits.ctrl:
                self._order(values["motor"], values["ctrl"])
            else:
                self.since_begin.add("illegal")
                self.disarm()
        elif frame.name == "targets":
            self._order(math.nan, math.nan)
            self.since_begin.add("targets")

    def _order(self, motor: float, ctrl: float) -> None:
        """What may be put out from now on; NaN where the board closes the loop."""
        self._holds = math.isnan(motor)
        self._motor, self._ctrl = motor, ctrl
        self._allow(0)

    def _allow(self, quiet: int) -> None:
        """What was asked for, or what silence leaves of it: a line to zero, a few periods wide."""
        least, most = (
            min(max(1.0 - (quiet + late - SILENCE) / DECELERATE, 0.0), 1.0)
            for late in (SOON, -SOON)
        )
        ends = sorted((least * self._motor, most * self._motor))
        heats = self._ctrl if quiet <= SILENCE + SOON else 0.0
        self._allowed.append(_Allowed(self.bench.tick, self._holds, *ends, heats))

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
        self.count += 1
        if len(self.unsafe) < TOLD:
            self.unsafe.append(f"period {self.bench.tick}: {what}")

    def period(self) -> None:
        """After each period."""
        bench = self.bench
        motor, ctrl, enabled = bench.outputs()
        truth = bench.truth()
        self.hottest = max(self.hottest, truth.wire)
        self.fastest = max(self.fastest, abs(truth.speed))
        quiet = bench.tick - self._heard
        if quiet >= SILENCE + DECELERATE - SOON:
            self.since_begin.add("silence")
        if quiet >= SILENCE + DECELERATE + SOON:
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
        if on and self._armed:
            self._asked_for(motor, ctrl, quiet)
        self._flood(on)
        self._lines(motor, on)
        if truth.wire > HOTTEST:
            self._say(f"the wire is at {truth.wire:.0f} degC")
        self._last = motor

    def _asked_for(self, motor: float, ctrl: float, quiet: int) -> None:
        """With the loop on the host: is it an order of the last periods, or nothing?"""
        self._allow(quiet)
        while self._allowed[0].tick < self.bench.tick - SOON:
            self._allowed.popleft()
        if any(each.holds for each in self._allowed):
            return
        if abs(motor) > STEP and not any(
            each.low - STEP <= motor <= each.high + STEP for each in self._allowed
        ):
            ways = sorted({(round(each.low, 3), round(each.high, 3)) for each in self._allowed})
            self._say(f"{motor:.3f} V that nobody asked for, of {ways}")
        if ctrl > CTRL_STEP and not any(
            abs(ctrl - each.ctrl) <= CTRL_STEP for each in self._allowed
        ):
            asked = sorted({round(each.ctrl, 3) for each in self._allowed})
            self._say(f"CTRL {ctrl:.3f} V that nobody asked for, of {asked}")

    def _flood(self, on: bool) -> None:
        """More bytes than an order leave the board no time: it may be late then, and stop."""
        tick = self.bench.tick
        if self._queue > ORDER:
            self._flooded = tick
        self._queue = max(self._queue - PER_PERIOD, 0)
        self.floods += tick - self._flooded <= SOON
        if self._on and not on and tick - self._flooded <= GUARD + SOON:
            self.since_begin.add("flood")
        self._on = on

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
