"""The table of transitions, and the only functions that change the mode.

`TRANSITIONS` is complete: (from, to, cause).

    disabled        enable -> ready
    ready, stopped, home -> homing; macro move, macro jog, macro follow, programme ->
      holding       moving-macro; micro move, micro jog, micro follow -> moving-micro
    homing          homed -> ready
    moving-macro    arrived -> settling; limit reached, jog ended, hold time over ->
                    stopped
    settling        settled -> moving-micro, or ready after a macro move; drifted -> moving-macro
    moving-micro    on target, limit reached, jog ended, hold time over, stop, link lost
                    -> holding;
                    stalled, link lost -> stopped
    holding         link lost -> stopped
    in a programme  next move: among moving-macro, settling, moving-micro; programme done -> ready
    homing, moving-macro, settling: stop, stalled, link lost -> stopped
    moving-macro, settling, moving-micro: replaced by another motion where that is configured
    all but fault: fault -> fault; all enabled: disable, emergency stop -> disabled
    fault           fault cleared -> disabled

Motor and CTRL are at zero in disabled, ready, fault, and in stopped once at rest; stopped
begins with braking. Holding: the micro-stage under control, the carriage parked.
"""

from __future__ import annotations

from macromicro.control.live import messages as m
from macromicro.control.live import survey
from macromicro.control.live.messages import Event, Evidence, Finished, Notice
from macromicro.control.live.parameters import LiveParameters
from macromicro.control.live.state import (
    NAN,
    NOWHERE,
    REST,
    Drive,
    Frame,
    LiveState,
    by_laser,
    now,
    position,
    uncertainty,
)

_AT_REST = (m.READY, m.HOLDING, m.STOPPED)
_STARTS = (*_AT_REST, m.MOVING_MACRO, m.SETTLING, m.MOVING_MICRO)  # the latter superseded
_FINE = (m.MOVING_MICRO, m.HOLDING)
_ENDS_BY_BRAKING = (m.HOMING, m.MOVING_MACRO, m.SETTLING)
_ON = tuple(k for k in range(len(m.MODES)) if k not in (m.DISABLED, m.FAULT))

ENABLE, DISABLE, FAULT_CLEARED = "enable", "disable", "fault cleared"
EMERGENCY, FAULT = "emergency stop", "fault"
STOP, LINK_LOST, JOG_ENDED = "stop", "link lost", "jog ended"
HOME, HOMED, STALLED, LIMIT = "home", "homed", "stalled", "limit reached"
MACRO_MOVE, MICRO_MOVE = "macro move", "micro move"
MACRO_JOG, MICRO_JOG, PROGRAMME = "macro jog", "micro jog", "programme"
MACRO_FOLLOW, MICRO_FOLLOW, LAPSED = "macro follow", "micro follow", "hold time over"
ARRIVED, SETTLED, DRIFTED, ON_TARGET = "arrived", "settled", "drifted", "on target"
NEXT_MOVE, PROGRAMME_DONE = "next move", "programme done"


def _table() -> tuple[tuple[int, int, str], ...]:
    rows = [(m.DISABLED, m.READY, ENABLE), (m.FAULT, m.DISABLED, FAULT_CLEARED)]
    rows += [(a, m.FAULT, FAULT) for a in range(len(m.MODES)) if a != m.FAULT]
    rows += [(a, m.DISABLED, cause) for a in _ON for cause in (DISABLE, EMERGENCY)]
    rows += [(a, m.HOMING, HOME) for a in _AT_REST]
    for a in _STARTS:
        rows += [
            (a, m.MOVING_MACRO, cause) for cause in (MACRO_MOVE, MACRO_JOG, MACRO_FOLLOW, PROGRAMME)
        ]
    for a in (*_AT_REST, m.MOVING_MICRO):
        rows += [(a, m.MOVING_MICRO, cause) for cause in (MICRO_MOVE, MICRO_JOG, MICRO_FOLLOW)]
    for a in _ENDS_BY_BRAKING:
        rows += [(a, m.STOPPED, cause) for cause in (STOP, LINK_LOST, STALLED)]
    rows += [(m.MOVING_MACRO, m.STOPPED, cause) for cause in (JOG_ENDED, LAPSED, LIMIT)]
    rows += [(m.HOMING, m.READY, HOMED), (m.SETTLING, m.READY, SETTLED)]
    rows += [(m.MOVING_MACRO, m.SETTLING, ARRIVED), (m.SETTLING, m.MOVING_MACRO, DRIFTED)]
    rows += [(m.SETTLING, m.MOVING_MICRO, SETTLED)]
    rows += [(m.MOVING_MICRO, m.HOLDING, ON_TARGET)]
    rows += [(m.MOVING_MICRO, m.HOLDING, c) for c in (STOP, LINK_LOST, JOG_ENDED, LAPSED, LIMIT)]
    rows += [(m.MOVING_MICRO, m.STOPPED, cause) for cause in (LINK_LOST, STALLED)]
    rows += [(m.HOLDING, m.STOPPED, LINK_LOST)]
    rows += [(a, m.MOVING_MICRO, NEXT_MOVE) for a in (m.MOVING_MACRO, m.SETTLING)]
    rows += [(a, m.MOVING_MACRO, NEXT_MOVE) for a in (m.SETTLING, m.MOVING_MICRO)]
    rows += [(a, m.READY, PROGRAMME_DONE) for a in (m.SETTLING, m.MOVING_MICRO)]
    return tuple(rows)


TRANSITIONS = _table()


def go(s: LiveState, mode: int, cause: str, evidence: Evidence) -> tuple[LiveState, Event]:
    """Change the mode and report it."""
    event = Event(now(s), "mode", m.MODES[s.mode], m.MODES[mode], cause, evidence)
    return s._replace(mode=mode), event


def report(s: LiveState, kind: str, cause: str, evidence: Evidence) -> Event:
    """An event without a transition."""
    return Event(now(s), kind, m.MODES[s.mode], m.MODES[s.mode], cause, evidence)


def distrust(s: LiveState, why: str) -> tuple[LiveState, tuple[Event, ...]]:
    """The machine with an unknown position."""
    if not s.frame.trusted or not s.frame.carriage:  # what stands cannot be lost
        return s, ()
    s = s._replace(frame=s.frame._replace(trusted=False))
    return s, (report(s, "trust", why, {"trusted": False}),)


def trust(s: LiveState, why: str, offset: float) -> tuple[LiveState, Event]:
    """The machine with its position known again."""
    frame = s.frame._replace(offset=offset, trusted=True, named=True)
    facts = {"trusted": True, "offset_raw_counts": offset}
    return s._replace(frame=frame), report(s, "trust", why, facts)


def homed(
    p: LiveParameters, s: LiveState, offset: float, stop: float
) -> tuple[LiveState, tuple[Notice, ...]]:
    """The end of a homing: the position is known by the raw count of coordinate 0."""
    found = {
        "offset_raw_counts": offset,
        "stop_raw_counts": stop,
        "shift_counts": offset - s.frame.offset,  # lost or gained since it was last known
    }
    s = s._replace(
        frame=Frame(offset, 0.0, True, s.frame.zero, named=True),
        survey=survey.rebase(p.settings.edges, s.survey, offset),
    )
    s = s._replace(seen=s.seen._replace(position=position(p, s)))
    trust = report(s, "trust", "homed", {"trusted": True, **found})
    s, notices = conclude(p, s, m.READY, (m.DONE, HOMED), found)
    return s, (trust, *notices)


def idle(d: Drive) -> Drive:
    """Both stages off, memories empty; a pending reset of the laser stays pending."""
    return Drive(d.macro_reference, 0.0, REST, 0.0, d.reset, d.fine)


def finish(
    p: LiveParameters, s: LiveState, outcome: str, evidence: Evidence
) -> tuple[LiveState, tuple[Finished, ...]]:
    """End the motion under way, if any; the mode stays."""
    if s.motion is None:
        return s._replace(work=None), ()
    by = "laser" if by_laser(p, s) else "encoder"
    facts = {"kind": s.motion.kind, "seconds": s.time - s.motion.began, "by": by, **evidence}
    end = Finished(s.motion.id, outcome, s.seen.position, uncertainty(p, s), facts)
    target = s.target
    if outcome == m.DONE:  # `conclude` forgets it unless the micro-stage holds it
        target = target._replace(micro=s.drive.micro_reference)
    elif outcome not in (m.DONE, m.SUPERSEDED):  # a carriage that stands is where it was sent
        target = NOWHERE._replace(macro=target.macro) if s.mode in _FINE else NOWHERE
    return s._replace(motion=None, work=None, target=target), (end,)


def arrived(
    p: LiveParameters, s: LiveState, evidence: Evidence
) -> tuple[LiveState, tuple[Notice, ...]]:
    """The end of a motion of a stage that rests where it was to be."""
    s, event = go(s, m.SETTLING, ARRIVED, evidence)
    s, notices = conclude(p, s, m.READY, (m.DONE, SETTLED), evidence)
    return s, (event, *notices)


def conclude(
    p: LiveParameters, s: LiveState, mode: int, how: tuple[str, str], evidence: Evidence
) -> tuple[LiveState, tuple[Notice, ...]]:
    outcome, cause = how
    s, ends = finish(p, s, outcome, evidence)
    s, event = go(s, mode, cause, evidence)
    if mode != m.HOLDING:  # only a carriage that has arrived stays on target with both stages off
        target = s.target._replace(micro=NAN) if mode == m.READY else NOWHERE
        s = s._replace(drive=idle(s.drive), target=target)
    return s, (*ends, event)
