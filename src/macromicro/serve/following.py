"""What clients are told of the machine beside its snapshot, derived alike for all of them."""

from __future__ import annotations

from macromicro.control.live.messages import Event
from macromicro.control.live.parameters import SoftLimits
from macromicro.control.settings import Control
from macromicro.programme import Limits
from macromicro.schema.par import entries, replaced


def gains(control: Control, event: Event, own: Control) -> Control:
    """The controller's settings in force after an event, `control` before it; `own`: those
    that a loop starts with."""
    if event.kind == "loop" and event.cause == "started":
        return own
    if event.kind == "gains":
        known = {e.path for e in entries(control)}
        for path, change in event.evidence.items():
            if path in known:
                control = replaced(control, path, change["new"])
    return control


def programme_limits(soft: SoftLimits, pitch: float) -> Limits:
    """Limits of a programme for these soft limits and this pitch [m]. Its micro targets may
    be 0: there the micro-stage is let go."""
    return Limits(soft.macro_low, soft.macro_high, 0.0, soft.micro_high * 1e-3, 1.0 / pitch)
