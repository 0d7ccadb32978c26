"""A period of the live loop, in this process: the two-stage machine on the compiled bench."""

from __future__ import annotations

import contextlib
import math
import time
from statistics import median
from typing import Any, NamedTuple

from figures import Line, some

from macromicro.control import calibration
from macromicro.control.live.messages import MODES, Enable, Home, MoveTo, Refused
from macromicro.nominal import PERIOD
from macromicro.plant import bench
from macromicro.rig import guard
from macromicro.rig.guarded import CompiledGuarded
from macromicro.rig.twin import CompiledTwin
from macromicro.serve import live
from macromicro.serve.link import Outbox, pair
from macromicro.serve.persist import Restored
from macromicro.serve.settings import LiveSettings
from macromicro.serve.shared import Shared
from macromicro.serve.ticking import Loop

PLACES = (0.02, 0.06)  # m: to and fro
HOMING = 60_000  # periods, at most
HOT, PERIODS = 5_000, 20_000  # periods before, and periods measured


class Period(NamedTuple):
    """Mode while a motion is under way, else ""; times [s] of the tick alone, and of read, tick
    and the bench's own period."""

    mode: str
    tick: float
    whole: float


class Moving:
    """The loop without its waiting: homed, it moves to and fro."""

    def __init__(self) -> None:
        settings, table = LiveSettings(), calibration.default_calibration()
        serve = settings.serve._replace(parent_timeout=math.inf)  # there is no serving process
        twin = CompiledTwin(bench.prepare(settings.bench, settings.sensors), 0)
        self._rig = CompiledGuarded(twin, guard.prepare(settings.guard, table), PERIOD)
        self._machine = live.make(settings, table)
        self._ours, theirs = pair()
        self._ours.setblocking(False)
        shared = Shared.create(5000)
        self._loop = Loop(self._rig, self._machine, shared, Outbox(theirs), serve, PERIOD, False)
        self._machine.begin(self._rig.read(), Restored(False, math.nan, "benchmark"))
        self._goal = 0
        self._period()
        self._ask(Enable())
        self._ask(Home())
        for _ in range(HOMING):
            if not self._period().mode:
                return
        raise RuntimeError("homing has not ended")

    def _ask(self, request: Any) -> None:
        reply, _ = self._machine.accept(request)
        if isinstance(reply, Refused):
            raise RuntimeError(str(reply))

    def _period(self) -> Period:
        started = time.perf_counter()
        sample = self._rig.read()
        read = time.perf_counter()
        self._loop._tick(sample)
        ticked = time.perf_counter()
        self._rig.clock.wait(PERIOD)
        ended = time.perf_counter()
        with contextlib.suppress(BlockingIOError):  # what the loop reports is read, and dropped
            while self._ours.recv(600_000):
                pass
        view = self._machine.view()
        return Period(MODES[int(view.mode)] if view.motion else "", ticked - read, ended - started)

    def turn(self, periods: int) -> list[Period]:
        """So many periods under way."""
        found: list[Period] = []
        while len(found) < periods:
            period = self._period()
            if period.mode:
                found.append(period)
            else:
                self._goal = 1 - self._goal
                self._ask(MoveTo(PLACES[self._goal]))
        return found


def lines() -> list[Line]:
    """The figures as lines of the benchmark's table: medians."""
    moving = Moving()
    moving.turn(some(HOT))
    found = moving.turn(some(PERIODS))
    whole = 1e6 * median(p.whole for p in found)
    tick = 1e6 * median(p.tick for p in found)
    by_mode = {
        mode: 1e6 * median(p.whole for p in found if p.mode == mode)
        for mode in sorted({p.mode for p in found})
    }
    remark = ", ".join(f"{mode} {us:.1f}" for mode, us in by_mode.items())
    return [
        Line("period of the live loop, moving", "at most 20", whole, "us", remark),
        Line("its tick alone", "", tick, "us"),
    ]
