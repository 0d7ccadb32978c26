"""Which requests make sense in a mode, whatever is in them: what a client may offer a person.

`accept` decides; this says beforehand what it would refuse for the mode alone. A test holds
both equal over every mode.
"""

from __future__ import annotations

from macromicro.control.live import messages as m

_ALWAYS = frozenset({m.Stop, m.EmergencyStop, m.Disable, m.SetGains})
_MOTIONS = frozenset({m.MoveTo, m.MoveBy, m.MoveMacro, m.MoveMicro, m.Programme})


def possible(mode: int, *, moving: bool, trusted: bool, supersede: bool = False) -> frozenset[type]:
    """Kinds of requests that `mode` (index into `messages.MODES`) does not rule out.

    `moving`: is a motion under way, its braking included? `trusted`: is the position known?
    `supersede`: may a new motion replace one under way?
    """
    if mode == m.FAULT:
        return _ALWAYS | {m.ClearFault, m.SetLimits}
    found = set(_ALWAYS) | {m.Fan}
    if not moving:
        found |= {m.Zero, m.SetLimits}
    if mode == m.DISABLED:
        return frozenset(found | {m.Enable})
    replacing = supersede and mode in (m.MOVING_MACRO, m.SETTLING, m.MOVING_MICRO)
    if not moving or replacing:
        found |= {m.Jog}
        found |= _MOTIONS if trusted else set()
    if not moving:
        found |= {m.Home}
    if mode in (m.MOVING_MACRO, m.SETTLING):
        found -= {m.MoveMicro}
    return frozenset(found)
