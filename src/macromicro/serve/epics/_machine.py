"""The records of a machine and its further channels."""

from __future__ import annotations

import asyncio
import math
from collections import Counter
from collections.abc import Awaitable, Callable
from typing import Any

import numpy as np

from macromicro.control.live import messages as m
from macromicro.control.live.messages import DONE, Refused
from macromicro.serve import unconfirmed
from macromicro.serve._instrument import Instrument
from macromicro.serve.client import Client
from macromicro.serve.epics._channels import WRITER, Address, channel, show
from macromicro.serve.epics._record import Axis, MoveError, Now, Record
from macromicro.serve.shared import INDEX
from macromicro.serve.snapshot import Snapshot
from macromicro.serve.web import bins

GATHER_S = 0.05  # s within which a scan that moves several stages has set them
Move = Callable[[str, m.Request, int], Awaitable[None]]


class Gathering:
    """Combines moves of stages that arrive within a moment into one straight-line move."""

    def __init__(self, asked: Callable[[], int], move: Move) -> None:
        self._asked, self._move = asked, move
        self._goals: dict[str, float] = {}  # of what is being gathered, m
        self._task: asyncio.Task[None] | None = None

    async def go(self, axis: str, goal: float) -> None:
        """Move an axis to a place [m] and return at the end."""
        if self._task is None or axis in self._goals:
            self._goals = {}
            self._task = asyncio.create_task(self._begin(self._goals, self._asked()))
        self._goals[axis] = goal
        # One that gives up waiting takes nothing from the other one.
        await asyncio.shield(self._task)

    def close(self) -> None:
        """Let no further move join those pending."""
        self._goals, self._task = {}, None

    async def _begin(self, goals: dict[str, float], asked: int) -> None:
        await asyncio.sleep(GATHER_S)
        if self._goals is goals:
            self.close()
        if len(goals) > 1:
            await self._move("together", m.MovePoint(goals), asked)
            return
        ((axis, goal),) = goals.items()
        await self._move(axis, m.MoveAxis(axis, goal), asked)


NAME = "epics"
TRACE_S, TRACE_ROWS = 10.0, 1000  # of the traces
DIGITS = 5
POLL_S = 0.02  # between looks at a jog's button, and at the snapshot
_SHOWN_BY = 200  # looks at the snapshot until it shows that a motion has ended


class Channels:
    """All channels of a served machine; their clients act as one client of the station."""

    def __init__(self, instrument: Instrument) -> None:
        self.client = Client(instrument, NAME)
        self._instrument, self._station = instrument, instrument.station
        self._per = instrument.place.per
        self._looking = asyncio.Lock()
        self._turn, self._under_way = "", 0  # the record that moves, and how many moves it has
        self._asked, self._stopped = 0, 0  # moves and stops so far; the last stop's number
        self._owners: set[Address | None] = set()  # circuits that have ordered something
        self._movers: Counter[Address | None] = Counter()  # motions under way, of each circuit
        self._changed = asyncio.Event()  # set for a moment as a move ends or is dropped
        self._gathering = Gathering(self._ask, self._in_turn)
        writable = self.client.authenticated  # Channel Access carries no token
        self._live = instrument.settings.live
        self._plots = bins.plots(instrument.settings)
        unit = instrument.place.unit

        def record(axis: Axis) -> Record:
            live = dict(instrument.settings.axes).get(axis.name, self._live)
            slow = live.jogging.micro if axis.name == m.MICRO else live.jogging.slow
            speeds = (live.jogging.macro * self._per, slow * self._per)
            return Record(axis, unit, DIGITS, *speeds, live.pitch * self._per, writable=writable)

        self._records = {axis.name: record(axis) for axis in self._axes()}

        def put(act: Callable[[Any], Awaitable[None]]) -> Any:
            return act if writable else None

        wave: dict[str, Any] = {"max_length": TRACE_ROWS}
        self._shown: dict[str, Any] = {
            "mode": channel(""),
            "fault": channel(""),
            "remedy": channel(""),
            "trusted": channel(0),
            "trust": channel(""),
            "uncertainty": channel(0.0, units=unit, precision=DIGITS),
            "temperature": channel(0.0, units="degC", precision=1),
            "holder": channel(""),
            "failure": channel(""),
            "trace:time": channel([0.0], units="s", **wave),
            "trace:position": channel([0.0], units=unit, **wave),
            "trace:motor": channel([0.0], units="V", **wave),
        }
        self._orders: dict[str, Any] = {
            "enable": channel(0, put(self._if(lambda: self._order(m.Enable())))),
            "disable": channel(0, put(self._if(lambda: self._order(m.Disable())))),
            "clear": channel(0, put(self._if(lambda: self._order(m.ClearFault())))),
            "home": channel(0, put(self._if(lambda: self._moving(self._go(m.Home()))))),
            "release": channel(0, put(self._if(self._release))),
            "stop": channel(0, self._if(self._stop)),
            "emergency": channel(0, self._if(self._emergency)),
        }

    def named(self, prefix: str) -> dict[str, Any]:
        found = {f"{prefix}:{name}": made for name, made in (self._shown | self._orders).items()}
        for record in self._records.values():
            found |= record.named(prefix)
        return found

    # Axes

    def _axes(self) -> list[Axis]:
        per, pitch = self._per, self._live.pitch
        stages = self._station.stages

        def axis(name: str, text: str, request: Callable[[float], m.Request]) -> Axis:
            async def go(value: float) -> None:
                await self._in_turn(name, request(value), self._ask())

            return moved(name, text, go)

        def moved(name: str, text: str, go: Callable[[float], Awaitable[None]]) -> Axis:
            stage = m.MACRO if name == "whole" else name

            async def home() -> None:
                await self._moving(self._go(m.Home()))

            async def jog(speed: float, held: Callable[[], bool]) -> None:
                await self._moving(self._jog(stage, speed / per, held))

            async def enable(on: bool) -> None:
                await self._order(m.Enable() if on else m.Disable())

            async def move(value: float) -> None:
                await self._moving(go(value))

            return Axis(name, text, move, home, jog, self._halt, enable)

        def alone(name: str) -> Axis:
            async def go(value: float) -> None:
                await self._gathering.go(name, value / per)

            return moved(name, f"axis {name}", go)

        if self._instrument.axes:
            return [alone(name) for name in self._instrument.axes]
        whole = axis("whole", "position", lambda v: m.MoveTo(v / per, replace=True))
        if set(stages) != set(m.STAGES):
            return [whole]
        macro = axis(
            "macro",
            "macro-stage",
            lambda v: m.MoveMacro(float(round(v / per / pitch)), replace=True),
        )
        micro = axis("micro", "micro-stage", lambda v: m.MoveMicro(v / per, replace=True))
        return [whole, macro, micro]

    def _now(self, name: str, now: Snapshot) -> Now:
        ends = [self._instrument.limit("whole" if name == "whole" else name, w) for w in _ENDS]
        scale, place, target = self._per, now.position_m, now.target_m
        if name == "macro":
            scale, place = self._per * self._live.pitch, now.macro_count
        elif name == "micro":
            place = now.micro_m
        elif name != "whole":
            own = next((each for each in now.axes if each.name == name), None)
            place, target = (own.position_m, own.target_m) if own else (math.nan, math.nan)
        low, high = (end * scale for end in ends)
        fault = now.fault is not None
        shown = Now(place * scale, low, high, now.enabled, bool(now.motion), now.trusted, fault)
        if name in m.STAGES:
            return shown
        return shown._replace(target=(place if math.isnan(target) else target) * scale)

    # Orders

    async def _order(self, request: m.Request) -> int:
        """Pass a request on; the number of the motion, or 0. Raises `MoveError`."""
        self._owners.add(WRITER.get())
        reply = await self.client.command(request)
        if isinstance(reply, Refused):
            await self._fail(f"{reply.reason}; {reply.remedy}")
        return reply.id if isinstance(reply, m.Accepted) else 0

    async def _go(self, request: m.Request) -> None:
        """Make a motion to its end. Raises `MoveError` unless it is "done"."""
        await show(self._shown["failure"], "")
        await self._to_end(await self._order(request))

    async def _jog(self, stage: str, speed: float, held: Callable[[], bool]) -> None:
        """Jog until the button is released. Raises `MoveError`."""
        if self._under_way:
            await self._fail("another record moves; wait for its end, or stop it")
        await show(self._shown["failure"], "")
        motion = await self._order(m.Jog(stage, speed))
        while held() and self._station.finished(motion, 0.0) is None:
            await asyncio.sleep(POLL_S)
        if self._station.finished(motion, 0.0) is None:
            await self._order(m.Jog(stage, 0.0))
        await self._to_end(motion, m.STOPPED_BY_REQUEST)

    async def _moving(self, motion: Awaitable[None]) -> None:
        """A motion owned by the circuit that writes."""
        circuit = WRITER.get()
        self._owners.add(circuit)
        self._movers[circuit] += 1
        try:
            await motion
        finally:
            self._movers[circuit] -= 1

    async def left(self, circuit: Address) -> None:
        if circuit not in self._owners:
            return
        moved = self._movers[circuit] > 0
        self._owners.discard(circuit)
        others = any(number > 0 for each, number in self._movers.items() if each != circuit)
        if self._owners and (others or not moved):
            return
        self._drop()
        if self._station.holder == self.client.name:
            self.client.lose()

    async def _to_end(self, motion: int, *fine: str) -> None:
        """Wait for a motion's end. Raises `MoveError` unless it is "done" or `fine`."""
        while (end := self._station.finished(motion, 0.0)) is None:
            if not self._station.snapshot().running:
                await self._fail("the loop process has ended")
            await self._station.news()
        # Who waited for its end sees the machine as it is then. The end is told before the snapshot
        # shows it: a DMOV that came later would be taken for the end of the client's next move.
        for _ in range(_SHOWN_BY):
            if self._station.snapshot().motion != motion:
                break
            await asyncio.sleep(POLL_S)
        await self.look()
        if end.outcome not in (DONE, *fine):
            await self._fail(f"it ended as {end.outcome}")

    def _ask(self) -> int:
        """Number of a new move."""
        self._asked += 1
        return self._asked

    async def _in_turn(self, name: str, request: m.Request, mine: int) -> None:
        """Make a move that replaces one of the same record and waits for one of another."""
        if self._stopped > mine:
            await self._fail("it was stopped before it began")
        while self._under_way and self._turn != name:
            await self._changed.wait()
            if self._stopped > mine:
                await self._fail("it was stopped before it began")
        self._turn = name
        self._under_way += 1
        try:
            await self._go(request)
        finally:
            self._under_way -= 1
            self._wake()

    def _wake(self) -> None:
        """Let the moves look that wait for their turn."""
        self._changed.set()
        self._changed.clear()

    async def _fail(self, words: str) -> None:
        await show(self._shown["failure"], words)
        raise MoveError(words)

    def _drop(self) -> None:
        """Cancel pending moves."""
        self._stopped = self._ask()
        self._gathering.close()
        self._wake()

    def _forget(self) -> None:
        """Cancel paused moves."""
        self._drop()
        for record in self._records.values():
            record.forget()

    async def _halt(self) -> None:
        self._drop()
        await self.client.stop()

    async def _stop(self) -> None:
        self._forget()
        await self.client.stop()

    async def _emergency(self) -> None:
        self._forget()
        if math.isnan(await self.client.emergency()):
            await self._fail(unconfirmed.words(unconfirmed.EMERGENCY_STOP))

    async def _release(self) -> None:
        self._station.release(self.client.name)

    def _if(self, act: Callable[[], Awaitable[Any]]) -> Any:
        async def put(value: Any) -> None:
            if value:
                await act()

        return put

    # What is shown

    async def look(self) -> None:
        """Update all channels."""
        async with self._looking:  # one look that waits must not write what is old by then
            await self._look()

    async def _look(self) -> None:
        self.client.beat(0.0)
        now = self._station.snapshot()
        for name, record in self._records.items():
            await record.look(self._now(name, now))
        trouble = now.fault
        for name, value in (
            ("mode", now.mode),
            ("fault", "" if trouble is None else trouble.message),
            ("remedy", "" if trouble is None else trouble.remedy),
            ("trusted", int(now.trusted)),
            ("trust", now.trust),
            ("uncertainty", now.uncertainty_m * self._per),
            ("temperature", now.temperature_c),
            ("holder", now.holder),
        ):
            await show(self._shown[name], value)

    async def look_back(self) -> None:
        """Update the traces."""
        rows = round(TRACE_S / self._instrument.period)
        block = self._instrument.newest(rows)
        if not block.shape[1]:
            return
        block = block[:, :: max(rows // TRACE_ROWS, 1)][:, -TRACE_ROWS:]
        values = self._plots.traces(block)
        time = block[INDEX["t"]]
        for name, column in (
            ("time", time),
            ("position", values[bins.CHANNELS.index("position")]),
            ("motor", values[bins.CHANNELS.index("motor")]),
        ):
            numbers = np.nan_to_num(column).tolist()
            await self._shown[f"trace:{name}"].write(numbers, verify_value=False)


_ENDS = ("MIN", "MAX")
