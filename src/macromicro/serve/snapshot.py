"""What a client sees of the machine at one instant."""

from __future__ import annotations

import math
from typing import NamedTuple

from macromicro.control.live.parameters import SoftLimits


class Trouble(NamedTuple):
    """A latched fault in words. `code`: of `rig.codes`, or from 100 on of `serve.faults`."""

    code: int
    name: str
    message: str
    evidence: str
    remedy: str


class Pace(NamedTuple):
    """How well the loop keeps its period. `missed` of `periods` since the start; `share`:
    missed in the last window (0..1); `latest`, `longest` [s]: greatest lateness of a period
    and greatest time that one took to compute, since the start."""

    periods: int
    missed: int
    share: float
    latest_s: float
    longest_s: float


class RecordingState(NamedTuple):
    """The recording under way, or the last one. `active`: is it being written? `path`: ""
    before the first; `rows`: safe in the file; `lost`: rows that came too fast for the disk;
    `error`: why it ended early, or ""."""

    active: bool
    path: str
    rows: int
    lost: int
    error: str


class AxisNow(NamedTuple):
    """One axis of a machine of two: its position, half width and set point [m], its effort [V],
    how far it may go [m], and where it goes or rests on target [m], NaN where it does neither."""

    name: str
    position_m: float
    uncertainty_m: float
    reference_m: float
    motor_v: float
    low_m: float
    high_m: float
    target_m: float = math.nan


class Snapshot(NamedTuple):
    """The machine at one instant.

    `time_s`: of the newest period, since the loop's start; `age_s`: how long ago that was;
    `running`: is there a loop process? `mode`: one of `control.live.messages.MODES`, or "off"
    without a loop process.

    Positions are NaN before the first period. `position_m` with `uncertainty_m` is the whole
    system's, `trusted` whether it is known since homing, `trust` why (not). `macro_count`,
    `macro_reference` [counts]; `micro_m`, `micro_reference_m` by the Hall calibration.
    Efforts: `motor_v`, `ctrl_v` [V at the D/A], `fan`, as last written to the rig; where the loop
    is gone and nobody has stopped the rig, the volts are NaN and `fan` is as last written.
    `temperature_c`: of the wires, estimated from CTRL. `motion`: number of the motion under
    way, 0 for none. `limits`: soft limits in force.

    `fault`: None if all is well. `holder`: client that holds control, or ""; `clients`:
    all that are connected. `emergency_s`: how long the last emergency stop took until the
    outputs were safe, NaN before the first. `lines`: switches and lines of the drive that there are
    (`types.Lines` without the index, and "enable"; with "x_" or "y_" in front of a machine of two
    axes), and whether each is on. `axes`: both of a machine of two axes, whose other positions are
    those of the first one. `target_m`: where the whole positioner goes, or rests on target, NaN
    where it does neither.
    """

    time_s: float
    age_s: float
    running: bool
    mode: str
    position_m: float
    uncertainty_m: float
    trusted: bool
    trust: str
    macro_count: float
    macro_reference: float
    micro_m: float
    micro_reference_m: float
    motor_v: float
    ctrl_v: float
    fan: bool
    temperature_c: float
    motion: int
    limits: SoftLimits
    fault: Trouble | None
    pace: Pace
    recording: RecordingState
    holder: str
    clients: tuple[str, ...]
    emergency_s: float
    lines: tuple[tuple[str, bool], ...] = ()
    axes: tuple[AxisNow, ...] = ()
    target_m: float = math.nan
