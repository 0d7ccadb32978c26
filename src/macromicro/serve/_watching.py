"""Turns the shared memory into snapshots."""

from __future__ import annotations

import math
import time

import numpy as np

from macromicro.control.live.messages import AXES, DISABLED, MODES, MOVING
from macromicro.control.live.parameters import Live, SoftLimits
from macromicro.place import Place as Units
from macromicro.serve import _lamps, faults
from macromicro.serve._position_store import FLICKER, Place
from macromicro.serve.choosing import AnySettings
from macromicro.serve.shared import ALIVE, EMERGENCY, INDEX, SAFE_SINCE, SEEN, Shared
from macromicro.serve.snapshot import AxisNow, Pace, RecordingState, Snapshot, Trouble

NO_RECORDING = RecordingState(False, "", 0, 0, "")
STALE_S = 0.5  # age of the newest period from which on it says nothing of the present
STOOD_S = 0.2  # without a new count, after which a carriage stands
_NOTHING = np.full(len(INDEX), math.nan)


def snapshot(
    shared: Shared | None,
    running: bool,
    trust: str,
    switched_off: bool,
    trouble: Trouble | None,
    settings: AnySettings,
    recording: RecordingState,
    holder: str,
    clients: tuple[str, ...],
) -> Snapshot:
    """The machine now; without a loop, or with a silent one, the position is unknown."""
    now = shared.now() if shared is not None else None
    live = settings.live
    limits = live.limits
    if shared is None or now is None:
        row, pace, age, offset, fault = _NOTHING, Pace(0, 0, 0.0, 0.0, 0.0), math.nan, 0.0, None
        lit, targets = 0.0, (math.nan, math.nan)
    else:
        _, row, status = now
        pace = Pace(
            int(status.periods), int(status.missed), status.share, status.latest, status.longest
        )
        age = (time.monotonic_ns() - int(shared.cells[ALIVE])) * 1e-9
        lit, targets = status.lamps, (status.target, status.second_target)
        offset, fault = status.offset, faults.trouble(status, live.place)
        limits = SoftLimits(*(getattr(status, name) for name in SoftLimits._fields))
    value = dict(zip(INDEX, row.tolist(), strict=True))
    stale = not running or not age <= STALE_S
    outputs = dict.fromkeys(("motor", "ctrl", "fan"), 0.0 if switched_off else math.nan)
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
        trust=trust,
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
        fault=trouble or fault,
        pace=pace,
        recording=recording,
        holder=holder,
        clients=clients,
        emergency_s=emergency_time(shared),
        lines=_lines(value, lit) if running else (),
        axes=_axes(value, getattr(settings, "lives", ()), stale, running, targets),
        target_m=targets[0] if running else math.nan,
    )


def latched(shared: Shared, units: Units) -> Trouble | None:
    """The latched fault of the loop's status."""
    now = shared.now()
    return None if now is None else faults.trouble(now[2], units)


def _lines(value: dict[str, float], lit: float) -> tuple[tuple[str, bool], ...]:
    """Lines of one axis (columns) or of both (status)."""
    if lit:
        return _lamps.told(lit)
    return tuple((name, value[name] != 0.0) for name in _lamps.NAMES if not math.isnan(value[name]))


def _axes(
    value: dict[str, float],
    lives: tuple[Live, ...],
    stale: bool,
    running: bool,
    targets: tuple[float, float],
) -> tuple[AxisNow, ...]:
    columns = (
        ("position", "uncertainty", "macro_reference", "macro_position", "motor"),
        ("y_position", "y_uncertainty", "y_reference", "y_count", "y_motor"),
    )
    found = []
    for name, live, names, target in zip(AXES, lives, columns, targets, strict=False):
        place, half, reference, count, motor = (value[each] for each in names)
        found.append(
            AxisNow(
                name,
                place * 1e-3,
                math.inf if stale else half * 1e-6,
                place * 1e-3 + (reference - count) * live.pitch,
                motor if running else 0.0,
                live.limits.whole_low,
                live.limits.whole_high,
                target if running else math.nan,
            )
        )
    return tuple(found)


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


def place(shared: Shared, why: str, period: float) -> Place | None:
    """What the position file should say; None before the first row."""
    now = shared.now()
    if now is None:
        return None
    written, row, status = now
    moving = int(row[INDEX["mode"]]) in MOVING or bool(row[INDEX["motion"]] > 0.0)
    return Place(
        written,
        float(row[INDEX["macro_position"]]),
        status.offset,
        bool(row[INDEX["trusted"]] > 0.5),
        why,
        moving or not _stands(shared, written, period),
        float(row[INDEX["laser"]] * 1e-6 - row[INDEX["hall_position"]] * 1e-3),
        float(row[INDEX["y_count"]]),
        status.second_offset,
    )


def _stands(shared: Shared, written: int, period: float) -> bool:
    """Whether the carriage has moved no more than one flickering count in `STOOD_S`."""
    _, _, block = shared.since(max(written - round(STOOD_S / period), 0))
    for name in ("macro_position", "y_count"):
        counts = block[INDEX[name]]
        counts = counts[np.isfinite(counts)]
        if counts.size and np.ptp(counts) > FLICKER:
            return False
    return True
