"""Which requests make sense in a mode, whatever is in them: what a client may offer a person.

`accept` decides; this says beforehand what it would refuse for the mode alone, of all requests but
SetSpeed, which no page has. A test holds both equal over every mode.
"""

from __future__ import annotations

from macromicro.control.live import messages as m

_ALWAYS = frozenset({m.Stop, m.EmergencyStop, m.Disable, m.SetGains})
_AXES = frozenset(m.AXES_MOVES)
_ONE = frozenset({*m.ONE_MOVES, m.Zero, m.Fan, m.SetLimits})
_MOTIONS = frozenset({*m.ONE_MOVES, m.Programme})


def possible(
    mode: int,
    *,
    moving: bool,
    trusted: bool,
    supersede: bool = False,
    stages: tuple[str, ...] = m.STAGES,
) -> frozenset[type]:
    """Kinds of requests that a mode does not rule out.

    Parameters
    ----------
    mode : int
        Index into `messages.MODES`.
    moving : bool
        Whether a motion is under way, its braking included.
    trusted : bool
        Whether the position is known.
    supersede : bool, optional
        Whether a new motion may replace one under way.
    stages : tuple[str, ...], optional
        Stages that the machine has.

    Returns
    -------
    frozenset[type]
        Classes of `messages`.
    """
    if stages == m.AXES:
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
    if mode in (m.MOVING_MACRO, m.SETTLING) or m.MICRO not in stages:
        found -= {m.MoveMicro, m.MoveMicroBy}
    if m.MACRO not in stages:
        found -= {m.MoveMacro, m.MoveMacroBy, m.Home}
    return frozenset(found)
