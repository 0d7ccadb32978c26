from __future__ import annotations

import math
from typing import NamedTuple

from macromicro.control.live.parameters import SoftLimits


class Trouble(NamedTuple):
    """A latched fault; `code` of `rig.codes`, or from 100 on of `serve.faults`."""

    code: int
    name: str
    message: str
    evidence: str
    remedy: str


class Pace(NamedTuple):
    """How well the loop keeps its period."""

    periods: int
    missed: int
    share: float  # of missed periods in the last window, 0..1
    latest_s: float  # greatest lateness since the start
    longest_s: float  # longest computing time since the start


class RecordingState(NamedTuple):
    """The recording under way, or the last one."""

    active: bool
    path: str
    rows: int  # safe in the file
    lost: int  # came too fast for the disk
    error: str  # why it ended early


class AxisNow(NamedTuple):
    """One of several stages."""

    name: str
    position_m: float
    uncertainty_m: float  # half width
    reference_m: float
    motor_v: float
    low_m: float
    high_m: float
    target_m: float = math.nan


OFF = ("off", "disabled", "fault")  # modes of a machine that is not enabled


class Snapshot(NamedTuple):
    """The machine at one instant; positions are NaN before the first period."""

    time_s: float  # since the loop's start
    age_s: float  # of this snapshot
    running: bool
    mode: str  # of control.live.messages.MODES, or "off"
    position_m: float
    uncertainty_m: float  # half width
    trusted: bool
    trust: str  # why the position is trusted or not
    macro_count: float  # counts
    macro_reference: float  # counts
    micro_m: float  # by the Hall sensor
    micro_reference_m: float
    motor_v: float  # at the D/A; NaN: unknown
    ctrl_v: float
    fan: bool
    temperature_c: float  # of the wires, estimated
    motion: int  # 0: none
    limits: SoftLimits
    fault: Trouble | None
    pace: Pace
    recording: RecordingState
    holder: str  # client in control, or ""
    clients: tuple[str, ...]
    emergency_s: float  # duration of the last emergency stop
    lines: tuple[tuple[str, bool], ...] = ()  # with the stage in front where there are several
    axes: tuple[AxisNow, ...] = ()  # of a machine of several
    target_m: float = math.nan

    @property
    def enabled(self) -> bool:
        return self.mode not in OFF
