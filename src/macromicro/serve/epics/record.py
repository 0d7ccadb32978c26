"""A motor record: the fields that its clients use, and how a move goes through them."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable
from typing import Any, NamedTuple

from caproto import AlarmSeverity, AlarmStatus, ChannelAlarm

from macromicro.serve.epics.channels import SENT_S, channel, show

_PATIENCE = 5  # times that a look at the machine is waited for
_FINE = {"status": AlarmStatus.NO_ALARM, "severity": AlarmSeverity.NO_ALARM}
_ENABLE = ("Disable", "Enable")


class MoveError(Exception):
    """A move that was refused, or ended otherwise than done."""


class Axis(NamedTuple):
    """What a record moves: its name, and how to move it there (`go` returns at its end and raises
    `MoveError`), home it, stop it and enable it."""

    name: str
    text: str
    go: Callable[[float], Awaitable[None]]
    home: Callable[[], Awaitable[None]]
    stop: Callable[[], Awaitable[None]]
    enable: Callable[[bool], Awaitable[Any]]


class Now(NamedTuple):
    """An axis at one instant, in the record's unit; `target`: where a tweak starts, None where
    the record's own value says it."""

    place: float
    low: float
    high: float
    enabled: bool
    moving: bool
    target: float | None = None


class Record:
    """Channels of one record by their names behind the prefix; `unit`, `digits`: of its places;
    `speed`: a speed that its clients may count their patience by; `near`: how near is there."""

    def __init__(
        self,
        axis: Axis,
        unit: str,
        digits: int,
        speed: float,
        near: float,
        *,
        writable: bool = True,
    ) -> None:
        self._axis, self._moves, self._looks = axis, 0, 0
        self._going = False
        alarm = ChannelAlarm()
        place = {"units": unit, "precision": digits, "alarm": alarm}

        def put(act: Callable[[Any], Awaitable[None]]) -> Any:
            return act if writable else None

        self.value = channel(0.0, put(self._move), **place)
        self.alarm = alarm
        flag = {"alarm": alarm}
        self.fields: dict[str, Any] = {
            "VAL": self.value,
            "RBV": channel(0.0, **place),
            "DVAL": channel(0.0, put(self._move), **place),
            "DRBV": channel(0.0, **place),
            "DMOV": channel(1, **flag),
            "MOVN": channel(0, **flag),
            "STOP": channel(0, self._stop, **flag),
            "SPMG": channel("Go", self._pause, enum_strings=("Stop", "Pause", "Move", "Go")),
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
            "CNEN": channel("Disable", put(self._enable), enum_strings=_ENABLE),
            "TWV": channel(10.0**-2, put(_kept), **place),
            "TWF": channel(0, put(self._tweak(1.0)), **flag),
            "TWR": channel(0, put(self._tweak(-1.0)), **flag),
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
        """The channels by their whole names."""
        root = f"{prefix}:{self._axis.name}"
        found = {f"{root}.{field}": made for field, made in self.fields.items()}
        return {root: self.value, **found}

    async def look(self, now: Now) -> None:
        """Bring readback, limits and what moves up to date. A move of others shows in DMOV."""
        fields = self.fields
        self._looks += 1
        if math.isfinite(now.place):
            await show(fields["RBV"], now.place)
            await show(fields["DRBV"], now.place)
            target = now.target if now.enabled else now.place
            if target is not None and not self._going and not now.moving:
                await show(self.value, target)
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

    # What clients put

    async def _move(self, target: float) -> None:
        await show(self.value, float(target))
        await self._through(lambda: self._axis.go(float(target)), float(target))

    async def _home(self, value: int) -> None:
        if value:
            await self._through(self._axis.home, -math.inf)

    async def _enable(self, value: Any) -> None:
        await self._axis.enable(value in (1, _ENABLE[1]))

    async def _stop(self, value: int) -> None:
        if value:
            await self._axis.stop()

    async def _pause(self, value: Any) -> None:
        if value in (0, 1, "Stop", "Pause"):
            await self._axis.stop()

    def _tweak(self, sign: float) -> Any:
        async def tweak(value: int) -> None:
            if value:
                await self._move(self.value.value + sign * self.fields["TWV"].value)

        return tweak

    async def _through(self, act: Callable[[], Awaitable[None]], target: float) -> None:
        """A motion from its begin to its end. A failed one leaves a MAJOR alarm, LVIO and MISS at
        1, which clients see before DMOV is 1 again; the put ends well, as that of any record."""
        fields = self.fields
        self._moves += 1
        mine, self._going = self._moves, True
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
        if failure is not None:
            await show(self.value, fields["RBV"].value)
        await show(fields["MOVN"], 0)
        await fields["DMOV"].write(1, verify_value=False)
        self._going = False


async def _kept(value: Any) -> None:
    """A value that is only kept."""
