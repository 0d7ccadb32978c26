"""From the shared memory to what a person or a file is told."""

from __future__ import annotations

import math
import time

import numpy as np
from numpy.typing import NDArray

from macromicro.control.live.messages import DISABLED, MODES, MOVING
from macromicro.serve import faults
from macromicro.serve.keeping import Place
from macromicro.serve.shared import ALIVE, EMERGENCY, INDEX, SAFE_SINCE, SEEN, WRITTEN, Shared
from macromicro.serve.snapshot import Pace, RecordingState, Snapshot, Trouble

NO_RECORDING = RecordingState(False, "", 0, 0, "")
_NOTHING = np.full(len(INDEX), math.nan)


def snapshot(
    shared: Shared | None,
    running: bool,
    trust: str,
    trouble: Trouble | None,
    recording: RecordingState,
    holder: str,
    clients: tuple[str, ...],
) -> Snapshot:
    """The machine now. `trouble`: a fault that the shared memory does not tell."""
    row = shared.last() if shared is not None else None
    if shared is None or row is None:
        row, pace, age, offset, fault = _NOTHING, Pace(0, 0, 0.0, 0.0, 0.0), math.nan, 0.0, None
    else:
        status = shared.status()
        pace = Pace(
            int(status.periods), int(status.missed), status.share, status.latest, status.longest
        )
        age = (time.monotonic_ns() - int(shared.cells[ALIVE])) * 1e-9
        offset, fault = status.offset, faults.trouble(status)
    value = dict(zip(INDEX, row.tolist(), strict=True))
    mode = int(value["mode"]) if math.isfinite(value["mode"]) else DISABLED
    return Snapshot(
        time_s=value["t"],
        age_s=age,
        running=running,
        mode=MODES[mode] if running else "off",
        position_m=value["position"] * 1e-3,
        uncertainty_m=value["uncertainty"] * 1e-6,
        trusted=value["trusted"] > 0.5,
        trust=trust,
        macro_count=value["macro_position"] - offset,
        macro_reference=value["macro_reference"] - offset,
        micro_mm=value["hall_position"],
        micro_reference_mm=value["micro_reference"],
        motor_v=value["motor"] if running else 0.0,
        ctrl_v=value["ctrl"] if running else 0.0,
        fan=running and value["fan"] > 0.5,
        temperature_c=value["temperature_estimate"],
        motion=int(value["motion"]) if running and math.isfinite(value["motion"]) else 0,
        fault=trouble or fault,
        pace=pace,
        recording=recording,
        holder=holder,
        clients=clients,
        emergency_s=emergency_time(shared),
    )


def emergency_time(shared: Shared | None) -> float:
    """How long the last emergency stop took until the outputs were safe [s]; NaN if none."""
    if shared is None:
        return math.nan
    stamp, safe = int(shared.cells[SEEN]), int(shared.cells[SAFE_SINCE])
    return (safe - stamp) * 1e-9 if stamp and stamp == int(shared.cells[EMERGENCY]) else math.nan


def place(shared: Shared, why: str) -> Place | None:
    """What the position file is to say; None before the first row."""
    written = int(shared.cells[WRITTEN])
    row: NDArray[np.float64] | None = shared.last()
    if row is None:
        return None
    moving = int(row[INDEX["mode"]]) in MOVING or row[INDEX["motion"]] > 0.0
    return Place(
        written,
        float(row[INDEX["macro_position"]]),
        shared.status().offset,
        bool(row[INDEX["trusted"]] > 0.5),
        why,
        bool(moving),
    )
