"""A motor record: its fields and how a move goes through them."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable
from functools import partial
from typing import Any, NamedTuple

from caproto import AlarmSeverity, AlarmStatus, ChannelAlarm

from macromicro.serve.epics._channels import SENT_S, channel, show

_PATIENCE = 5  # times that a look at the machine is waited for
_FINE = {"status": AlarmStatus.NO_ALARM, "severity": AlarmSeverity.NO_ALARM}
_ENABLE = ("Disable", "Enable")
SPMG = ("Stop", "Pause", "Move", "Go")
STOP, PAUSE, MOVE, GO = range(4)
# Bits of MSTA, as the motor record numbers them.
_FORWARD, _DONE, _HIGH, _HOLDS, _ENCODER, _PROBLEM, _MOVING, _LOOP, _LOW, _HOMED = (
    1 << bit for bit in (0, 1, 2, 5, 8, 9, 10, 11, 13, 14)
)


class MoveError(Exception):
    """A move that was refused or failed."""


class Axis(NamedTuple):
    """What a record moves, and how; `go` returns at the end of the move and raises `MoveError`."""

    name: str
    text: str
    go: Callable[[float], Awaitable[None]]
    home: Callable[[], Awaitable[None]]
    jog: Callable[[float, Callable[[], bool]], Awaitable[None]]
    stop: Callable[[], Awaitable[None]]
    enable: Callable[[bool], Awaitable[Any]]


class Now(NamedTuple):
    """An axis at one instant, in the record's unit."""

    place: float
    low: float
    high: float
    enabled: bool
    moving: bool
    trusted: bool = True
    fault: bool = False
    target: float | None = None  # where a tweak starts; None: at VAL


class Record:
    """The channels of one motor record; `near` is its dead band and the step of RVAL."""

    def __init__(
        self,
        axis: Axis,
        unit: str,
        digits: int,
        speed: float,
        jog: float,
        near: float,
        *,
        writable: bool = True,
    ) -> None:
        self._axis, self._moves, self._looks = axis, 0, 0
        self._going = False
        self._near = near
        self._mode = GO  # SPMG
        self._goal: float | None = None  # of the move under way
        self._later: float | None = None  # what moves at Go or Move
        self._sync = False  # VAL is to be where the motion ends
        self._held = False  # a jog's button
        alarm = ChannelAlarm()
        place = {"units": unit, "precision": digits, "alarm": alarm}

        def put(act: Callable[[Any], Awaitable[Any]]) -> Any:
            return act if writable else None

        self.value = channel(0.0, put(self._move), **place)
        self.alarm = alarm
        flag = {"alarm": alarm}
        self.fields: dict[str, Any] = {
            "VAL": self.value,
            "RBV": channel(0.0, **place),
            "DVAL": channel(0.0, put(self._move), **place),
            "DRBV": channel(0.0, **place),
            "RVAL": channel(0, put(self._move_raw), **flag),
            "RRBV": channel(0, **flag),
            "RLV": channel(0.0, put(self._move_by), **place),
            "DMOV": channel(1, **flag),
            "MOVN": channel(0, **flag),
            "STOP": channel(0, self._stop, **flag),
            "SPMG": channel("Go", self._switch, enum_strings=SPMG),
            "HLM": channel(0.0, **place),
            "LLM": channel(0.0, **place),
            "DHLM": channel(0.0, **place),
            "DLLM": channel(0.0, **place),
            "HLS": channel(0, **flag),
            "LLS": channel(0, **flag),
            "LVIO": channel(0, **flag),
            "MISS": channel(0, **flag),
            "TDIR": channel(1, **flag),
            "MSTA": channel(0, **flag),
            "HOMF": channel(0, put(self._home), **flag),
            "HOMR": channel(0, put(self._home), **flag),
            "JOGF": channel(0, put(partial(self._jog, "JOGF", 1.0)), **flag),
            "JOGR": channel(0, put(partial(self._jog, "JOGR", -1.0)), **flag),
            "JVEL": channel(jog, put(_positive), **place),
            "CNEN": channel("Disable", put(self._enable), enum_strings=_ENABLE),
            "TWV": channel(10.0**-2, put(_positive), **place),
            "TWF": channel(0, put(partial(self._tweak, 1.0)), **flag),
            "TWR": channel(0, put(partial(self._tweak, -1.0)), **flag),
            "EGU": channel(unit),
            "DESC": channel(axis.text),
            "OUT": channel("@macromicro"),
            "PREC": channel(digits),
            "VELO": channel(speed, **place),
            "VBAS": channel(0.0, **place),
            "VMAX": channel(speed, **place),
            "ACCL": channel(1.0),
            "RDBD": channel(near, **place),
            "MRES": channel(near, **place),
            "ERES": channel(near, **place),
            "UREV": channel(near, **place),
            "SREV": channel(1),
            "OFF": channel(0.0, **place),
            "DIR": channel("Pos", enum_strings=("Pos", "Neg")),
            "FOFF": channel("Frozen", enum_strings=("Variable", "Frozen")),
            "SET": channel("Use", enum_strings=("Use", "Set")),
            "RTYP": channel("motor"),
        }

    def named(self, prefix: str) -> dict[str, Any]:
        root = f"{prefix}:{self._axis.name}"
        found = {f"{root}.{field}": made for field, made in self.fields.items()}
        return {root: self.value, **found}

    async def look(self, now: Now) -> None:
        """Update readback, limits and motion; other clients' moves show in DMOV."""
        fields = self.fields
        self._looks += 1
        if math.isfinite(now.place):
            await show(fields["RBV"], now.place)
            await show(fields["DRBV"], now.place)
            await show(fields["RRBV"], round(now.place / self._near))
            target = now.target if now.enabled else now.place
            rests = not self._going and not now.moving and self._later is None
            if target is not None and rests:
                await self._aim(target)
        ends = {"upper_ctrl_limit": now.high, "lower_ctrl_limit": now.low}
        if (fields["HLM"].value, fields["LLM"].value) != (now.high, now.low):
            await self.value.write_metadata(**ends)
        for name, end in (("HLM", now.high), ("DHLM", now.high)):
            await show(fields[name], end)
        for name, end in (("LLM", now.low), ("DLLM", now.low)):
            await show(fields[name], end)
        await show(fields["CNEN"], _ENABLE[now.enabled])
        if not self._going:
            await show(fields["MOVN"], int(now.moving))
        if not self._going:  # a move may have begun meanwhile
            await show(fields["DMOV"], int(not now.moving))
        await show(fields["MSTA"], self._status(now))

    def _status(self, now: Now) -> int:
        bits = (
            (_FORWARD, self.fields["TDIR"].value),
            (_DONE, not now.moving),
            (_MOVING, now.moving),
            (_HIGH, now.place >= now.high),
            (_LOW, now.place <= now.low),
            (_HOLDS, now.enabled),
            (_HOMED, now.trusted),
            (_PROBLEM, now.fault),
        )
        return _ENCODER | _LOOP | sum(bit for bit, on in bits if on)

    # What clients put

    async def _move(self, target: float) -> float:
        """Set a new target; the channel's value after it."""
        await self._aim(float(target))
        self._later = float(target)
        if self._mode in (MOVE, GO):
            await self._begin()
        return float(self.value.value)

    async def _begin(self) -> None:
        """Begin the requested move."""
        if self._later is None:
            return
        target, self._later = self._later, None
        mine = await self._through(lambda: self._axis.go(target), target, goal=target)
        if self._mode == MOVE and mine == self._moves and self._later is None:
            self._mode = PAUSE
            await show(self.fields["SPMG"], SPMG[PAUSE])

    async def _move_raw(self, steps: float) -> int:
        return round(await self._move(steps * self._near) / self._near)

    async def _move_by(self, distance: float) -> float:
        await self._move(self.value.value + float(distance))
        return 0.0

    async def _tweak(self, sign: float, value: int) -> None:
        if value:
            await self._move(self.value.value + sign * self.fields["TWV"].value)

    async def _home(self, value: int) -> None:
        if value and self._mode in (MOVE, GO):
            await self._through(self._axis.home, -math.inf, sync=True)

    async def _jog(self, name: str, sign: float, value: int) -> None:
        """Jog as long as the field is 1."""
        self._held = bool(value) and self._mode in (MOVE, GO)
        if not self._held or self.fields["JOGF"].value or self.fields["JOGR"].value:
            return
        await show(self.fields[name], 1)
        speed = sign * self.fields["JVEL"].value

        def held() -> bool:
            return self._held

        try:
            await self._through(
                lambda: self._axis.jog(speed, held), math.copysign(math.inf, sign), sync=True
            )
        finally:
            await show(self.fields[name], 0)

    async def _enable(self, value: Any) -> None:
        await self._axis.enable(value in (1, _ENABLE[1]))

    async def _stop(self, value: int) -> None:
        if value:
            self.forget()
            self._sync = True
            await self._axis.stop()

    async def _switch(self, value: Any) -> str:
        """Handle SPMG: Stop; Pause keeps the target for Move (once) or Go."""
        self._mode = SPMG.index(value) if value in SPMG else int(value)
        await show(self.fields["SPMG"], SPMG[self._mode])
        if self._mode in (STOP, PAUSE):
            self._held = False
            if self._mode == STOP:
                self.forget()
                self._sync = True
            elif self._later is None:
                self._later = self._goal
            await self._axis.stop()
        else:
            await self._begin()
        return SPMG[self._mode]

    def forget(self) -> None:
        """Drop the paused target."""
        self._later = None

    async def _aim(self, target: float) -> None:
        await show(self.value, target)
        await show(self.fields["DVAL"], target)
        await show(self.fields["RVAL"], round(target / self._near))

    async def _through(
        self,
        act: Callable[[], Awaitable[None]],
        target: float,
        *,
        goal: float | None = None,
        sync: bool = False,
    ) -> int:
        """Follow a motion to its end; a failed one sets MAJOR, LVIO and MISS before DMOV."""
        fields = self.fields
        self._moves += 1
        mine, self._going = self._moves, True
        self._goal, self._sync = goal, sync
        await self.alarm.write(**_FINE)
        await show(fields["STOP"], 0)
        for name in ("LVIO", "MISS"):
            await show(fields[name], 0)
        await show(fields["TDIR"], int(target > fields["RBV"].value))
        await show(fields["DMOV"], 0)
        await show(fields["MOVN"], 1)
        failure: MoveError | None = None
        try:
            await act()
        except MoveError as error:
            failure = error
        if mine == self._moves:  # else a later one is under way, which says the end
            await self._end(failure, mine)
        return mine

    async def _end(self, failure: MoveError | None, mine: int) -> None:
        fields = self.fields
        if failure is not None:
            bad = {"status": AlarmStatus.STATE, "severity": AlarmSeverity.MAJOR_ALARM}
            await self.alarm.write(**bad)
            for name in ("LVIO", "MISS"):
                await show(fields[name], 1)
        await asyncio.sleep(SENT_S)  # clients read the alarm before the end
        # Clients read the place when DMOV is 1: two looks on, it is that of after the motion.
        before = self._looks
        for _ in range(_PATIENCE):
            if self._looks >= before + 2:
                break
            await asyncio.sleep(SENT_S)
        if mine != self._moves:
            return
        self._goal = None
        if self._sync:
            await self._aim(fields["RBV"].value)
        await show(fields["MOVN"], 0)
        await fields["DMOV"].write(1, verify_value=False)
        self._going = False


async def _positive(value: Any) -> None:
    """Check a value that is only stored."""
    if not (math.isfinite(value) and value > 0.0):
        raise MoveError(f"{value:g} is not a distance or speed; use a number above 0")
