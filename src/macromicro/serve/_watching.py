"""Turns the shared memory into snapshots."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from itertools import repeat
from typing import TYPE_CHECKING

import numpy as np

from macromicro.control.live.messages import DISABLED, MODES, MOVING
from macromicro.control.live.parameters import SoftLimits
from macromicro.serve import faults
from macromicro.serve.persist import FLICKER, Kept, Shown
from macromicro.serve.settings import AnySettings
from macromicro.serve.shared import (
    ALIVE,
    EMERGENCY,
    INDEX,
    LAMPS,
    SAFE_SINCE,
    SEEN,
    Shared,
    StageStatus,
    Status,
)
from macromicro.serve.snapshot import AxisNow, Pace, RecordingState, Snapshot, Trouble

if TYPE_CHECKING:
    from macromicro.serve._holders import Holders
    from macromicro.serve._loop_connection import LoopConnection

NO_RECORDING = RecordingState(False, "", 0, 0, "")
STALE_S = 0.5  # age of the newest period from which on it says nothing of the present
STOOD_S = 0.2  # without a new count, after which a carriage stands
_UNKNOWN = repeat(StageStatus())


def snapshot(
    connection: LoopConnection, settings: AnySettings, recording: RecordingState, holders: Holders
) -> Snapshot:
    """The machine now; without a loop, or with a silent one, the position is unknown."""
    shared, running = connection.shared, connection.running
    now = shared.now() if shared is not None else None
    live = settings.live
    limits, columns = live.limits, settings.telemetry.names
    if shared is None or now is None:
        row, pace, age = np.full(len(columns), math.nan), Pace(0, 0, 0.0, 0.0, 0.0), math.nan
        offset, fault = 0.0, None
        status = Status()
    else:
        _, row, status = now
        pace = Pace(
            int(status.periods), int(status.missed), status.share, status.latest, status.longest
        )
        age = (time.monotonic_ns() - int(shared.cells[ALIVE])) * 1e-9
        offset, fault = status.offset, faults.trouble(status, live.place, settings.axes)
        limits = SoftLimits(*(getattr(status, name) for name in SoftLimits._fields))
    value = dict(zip(columns, row.tolist(), strict=True))
    stale = not running or not age <= STALE_S
    outputs = dict.fromkeys(("motor", "ctrl", "fan"), 0.0 if connection.switched_off else math.nan)
    if running:
        outputs = {name: value[name] for name in outputs}
    mode = int(value["mode"]) if math.isfinite(value["mode"]) else DISABLED
    return Snapshot(
        time_s=value["t"],
        age_s=age,
        running=running,
        mode=MODES[mode] if running else "off",
        position_m=value["position"] * 1e-3,
        uncertainty_m=math.inf if stale else value["uncertainty"] * 1e-6,
        trusted=value["trusted"] > 0.5 and not stale,
        trust=connection.trust,
        macro_count=value["macro_position"] - offset,
        macro_reference=value["macro_reference"] - offset,
        micro_m=value["hall_position"] * 1e-3,
        micro_reference_m=value["micro_reference"] * 1e-3,
        motor_v=outputs["motor"],
        ctrl_v=outputs["ctrl"],
        fan=outputs["fan"] > 0.5 or (math.isnan(outputs["fan"]) and value["fan"] > 0.5),
        temperature_c=value["temperature_estimate"],
        motion=int(value["motion"]) if running and math.isfinite(value["motion"]) else 0,
        limits=limits,
        fault=connection.trouble or fault,
        pace=pace,
        recording=recording,
        holder=holders.holder,
        clients=holders.clients,
        emergency_s=emergency_time(shared),
        lines=tuple(_lines(settings, status)) if running else (),
        axes=tuple(_axes(settings, value, status, stale, running)),
        target_m=status.target if running else math.nan,
    )


def latched_fault(shared: Shared, settings: AnySettings) -> Trouble | None:
    """The latched fault of the loop's status."""
    now = shared.now()
    return None if now is None else faults.trouble(now[2], settings.live.place, settings.axes)


def _lines(settings: AnySettings, status: Status) -> Iterator[tuple[str, bool]]:
    for stage, own in zip(settings.telemetry.stages, status.stages, strict=False):
        before = f"{stage}_" if stage else ""
        each = zip(LAMPS, own.lamps, strict=True)
        yield from ((f"{before}{name}", on > 0.0) for name, on in each if not math.isnan(on))


def _counts(settings: AnySettings) -> list[str]:
    """The column of each stage's encoder."""
    further = settings.telemetry.stages[1:]
    return ["macro_position", *(f"{name}_count" for name in further)]


def _axes(
    settings: AnySettings, value: dict[str, float], status: Status, stale: bool, running: bool
) -> Iterator[AxisNow]:
    own = zip(settings.axes, _counts(settings), status.stages or _UNKNOWN, strict=False)
    for k, ((name, live), counts, stage) in enumerate(own):
        before, aim = (f"{name}_", f"{name}_reference") if k else ("", "macro_reference")
        place = value[f"{before}position"] * 1e-3
        yield AxisNow(
            name,
            place,
            math.inf if stale else value[f"{before}uncertainty"] * 1e-6,
            place + (value[aim] - value[counts]) * live.pitch,
            value[f"{before}motor"] if running else 0.0,
            live.limits.whole_low,
            live.limits.whole_high,
            stage.target if running else math.nan,
        )


def last_written(shared: Shared | None) -> str:
    """The last outputs, in words."""
    row = shared.last() if shared is not None else None
    if row is None:
        return "no output had been written to the rig"
    motor, ctrl, fan = (float(row[INDEX[name]]) for name in ("motor", "ctrl", "fan"))
    on = "on" if fan > 0.5 else "off"
    return f"last written to the rig: motor {motor:.2f} V, CTRL {ctrl:.2f} V, fan {on}"


def emergency_time(shared: Shared | None) -> float:
    """Duration of the last emergency stop, or NaN."""
    if shared is None:
        return math.nan
    stamp, safe = int(shared.cells[SEEN]), int(shared.cells[SAFE_SINCE])
    return (safe - stamp) * 1e-9 if stamp and stamp == int(shared.cells[EMERGENCY]) else math.nan


def place(shared: Shared, why: str, settings: AnySettings) -> Shown | None:
    """What the position file should say of machine and rig; None before the first row."""
    now = shared.now()
    if now is None:
        return None
    written, row, status = now
    names = shared.form.names
    encoders = [names.index(name) for name in _counts(settings)]
    moving = int(row[INDEX["mode"]]) in MOVING or bool(row[INDEX["motion"]] > 0.0)
    offsets = [each.offset for each in status.stages] or [status.offset]
    found = [(float(row[encoders[k]]), offsets[k]) for k in settings.homing]
    return written, Kept(
        "",
        *found[0],
        bool(row[INDEX["trusted"]] > 0.5),
        why,
        moving or not _stands(shared, written, settings.period, encoders),
        0.0,
        float(row[INDEX["laser"]] * 1e-6 - row[INDEX["hall_position"]] * 1e-3),
        tuple(found[1:]),
    )


def _stands(shared: Shared, written: int, period: float, encoders: Sequence[int]) -> bool:
    """Whether no stage has moved by more than one flickering count in `STOOD_S`."""
    _, _, block = shared.since(max(written - round(STOOD_S / period), 0))
    for counts in block[encoders]:
        known = counts[np.isfinite(counts)]
        if known.size and np.ptp(known) > FLICKER:
            return False
    return True
