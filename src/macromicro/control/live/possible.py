"""Which requests a mode allows, for user interfaces; `accept` decides."""

from __future__ import annotations

from macromicro.control.live import alone
from macromicro.control.live import messages as m

_ALWAYS = frozenset({m.Stop, m.EmergencyStop, m.Disable, m.SetGains})
_AXES = frozenset(m.AXES_MOVES)
_ONE = frozenset({*m.ONE_MOVES, m.Zero, m.Fan, m.SetLimits})
_MOTIONS = frozenset({*m.ONE_MOVES, m.Programme, m.Follow})


def possible(
    mode: int,
    *,
    moving: bool,
    trusted: bool,
    supersede: bool = False,
    stages: tuple[str, ...] = m.STAGES,
) -> frozenset[type]:
    if alone.several(stages):
        one = possible(mode, moving=moving, trusted=trusted)
        replaces = supersede and trusted and mode in (m.MOVING_MACRO, m.SETTLING)
        return (one - _ONE) | (_AXES if m.MoveTo in one or replaces else frozenset())
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
    elif mode in (m.MOVING_MACRO, m.MOVING_MICRO):
        found |= {m.EndFollow}
    if mode in (m.MOVING_MACRO, m.SETTLING) or m.MICRO not in stages:
        found -= {m.MoveMicro, m.MoveMicroBy}
    if m.MACRO not in stages:
        found -= {m.MoveMacro, m.MoveMacroBy, m.Home}
    return frozenset(found)
