"""Where the whole positioner is going: what the events tell, and the set points beside it."""

from __future__ import annotations

import math

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Event
from macromicro.serve.snapshot import Snapshot

_TOWARDS = (*(m.MODES[k] for k in m.MOVING), m.MODES[m.HOLDING])
_FINE = (m.MODES[m.MOVING_MICRO], m.MODES[m.HOLDING])


def aim(now: Snapshot, target: float, pitch: float) -> float:
    """Where the whole positioner is going or is held [m]; NaN where it is not."""
    if now.mode not in _TOWARDS or now.mode == m.MODES[m.HOMING]:
        return math.nan
    if math.isfinite(target):
        return target
    if now.mode in _FINE:
        return now.macro_count * pitch + now.micro_reference_mm * 1e-3
    return now.macro_reference * pitch


def aimed(event: Event, target: float) -> float:
    """The absolute target [m] after this event; NaN where there is none."""
    if event.kind != "mode":
        return target
    if event.to_mode not in _TOWARDS:
        return math.nan
    begins = event.cause.endswith((" move", " jog")) or event.cause == "programme"
    return float(event.evidence.get("target_m", math.nan)) if begins else target
