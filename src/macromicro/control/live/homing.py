"""Homing without a switch: feel for the low end stop, back off, name that place.

The macro law follows a reference downwards: at the speed `approach`, which a stop may be met
with; at `quick` where the stop is expected farther below than `near`, and slowly from there on.
It is expected where the frame has it, if a homing before or a kept position named it, and where it
was felt the first time. A carriage that is below that, and meets nothing, continues at `approach`.

Where the carriage stands, the motor pushes with the full homing effort - below what the guard
takes for stuck - and a carriage that still stands under it has met the stop. One that had
only stuck is freed by the push. So homing leans on a stop for twice `stand`, whichever law is in
force, wherever it began.

A stop has to be met twice at the same place, the second time slowly, backing off in between: one
that was held up for longer, and is free again then, continues. The second place counts.
"""

from __future__ import annotations

import math

from macromicro.control import arrival
from macromicro.control.arrival import TICK
from macromicro.control.live import brake, survey
from macromicro.control.live import messages as m
from macromicro.control.live import transitions as t
from macromicro.control.live.effort import Efforts, limited, macro_effort
from macromicro.control.live.messages import Notice
from macromicro.control.live.parameters import Homing, LiveParameters
from macromicro.control.live.state import (
    NAN,
    NOWHERE,
    REST,
    Frame,
    LiveState,
    Motion,
    Search,
    position,
)
from macromicro.types import Sample

SEARCH, PUSH, BACK = range(3)
GIVE = 20.0  # counts that a stop's rubber may give under the push
DITHER = 1.0  # count that a carriage which stands may show beside its own
AGAIN = 2.0 * GIVE  # counts to back off before it is felt for again
OVER = 1.4  # of the requested speed, with which a carriage that had stuck may catch up


def start(p: LiveParameters, s: LiveState, motion: Motion) -> tuple[LiveState, tuple[Notice, ...]]:
    """Begin to search; the place is not trusted until it is found again.

    Parameters
    ----------
    p : LiveParameters
        Parameters of the live machine.
    s : LiveState
        State of the live machine.
    motion : Motion
        The motion as accepted.

    Returns
    -------
    state : LiveState
        New state.
    notices : tuple[Notice, ...]
        Trust and the transition.
    """
    trust = t.reported(s, "trust", "homing", {"trusted": False})
    drive = t.idle(s.drive)._replace(macro_reference=s.seen.encoder)
    q = p.settings.homing
    expected = s.frame.offset + q.coordinate - q.back_off if s.frame.named else NAN
    s = s._replace(
        motion=motion,
        work=Search(SEARCH, s.time, s.seen.encoder, NAN, expected=expected),
        drive=drive,
        frame=s.frame._replace(trusted=False),
        target=NOWHERE,
        survey=survey.again(s.survey, p.settings.pitch),
    )
    s, event = t.go(s, m.HOMING, t.HOME, {})
    return s, (trust, event)


def step(
    p: LiveParameters, s: LiveState, motion: Motion, work: Search, sample: Sample, dt: float
) -> tuple[LiveState, Efforts]:
    """One period of homing.

    Parameters
    ----------
    p : LiveParameters
        Parameters of the live machine.
    s : LiveState
        State of the live machine.
    motion : Motion
        The motion under way.
    work : Search
        How far the search is.
    sample : Sample
        What the rig shows.
    dt : float
        Control period, s.

    Returns
    -------
    state : LiveState
        New state.
    efforts : Efforts
        Outputs and notices.
    """
    q = p.settings.homing
    patience = q.patience + (s.laws.sequence.patience if work.phase == BACK else 0.0)
    if s.time - motion.began >= patience - TICK:
        s, notices = brake.start(p, s, m.STALLED, t.STALLED)
        return s, Efforts(notices=notices)
    if math.isnan(sample.encoder):
        return s, Efforts(macro_active=1.0)
    if work.phase == SEARCH:
        return _search(q, s, work, sample, dt)
    if work.phase == PUSH:
        return _push(p, s, work, sample)
    return _back(p, s, work, sample, dt)


def _slow(q: Homing, s: LiveState, motor: float, pace: float = 0.0) -> float:
    """The effort within homing's volts, none above its speed, or well above that of the reference,
    `pace` [count/s]."""
    return 0.0 if abs(s.seen.speed) > max(q.fastest, OVER * pace) else limited(motor, q.volts)


def pace(q: Homing, above: float) -> float:
    """Speed of the search.

    Parameters
    ----------
    q : Homing
        Parameters of homing.
    above : float
        How far above the place where the stop is expected, counts; NaN where it is expected
        nowhere.

    Returns
    -------
    float
        counts/s.
    """
    if above > q.near:
        return max(q.quick, q.speed)
    return q.speed if above >= -GIVE else max(q.approach, q.speed)


def _search(
    q: Homing, s: LiveState, work: Search, sample: Sample, dt: float
) -> tuple[LiveState, Efforts]:
    speed = pace(q, sample.encoder - work.expected)
    if speed < work.pace:  # neither a reference far ahead nor the law's memory drives it on
        s = s._replace(drive=s.drive._replace(macro_reference=sample.encoder, memory=REST))
    floor = sample.encoder - q.lead
    reference = max(s.drive.macro_reference - speed * dt, floor)
    drive, motor = macro_effort(s, sample.encoder, reference, dt)
    work = _watched(work._replace(pace=speed), s.time, sample.encoder)
    if _stands(s, work) >= q.stand - TICK:
        work = work._replace(phase=PUSH, since=s.time, origin=sample.encoder)
    return s._replace(drive=drive, work=work), Efforts(_slow(q, s, motor, speed), 0.0, 1.0)


def _watched(work: Search, now: float, here: float) -> Search:
    """Since when the carriage gets no farther down: a count of dither above is no motion."""
    if work.lowest <= here <= work.lowest + DITHER:
        return work
    return work._replace(lowest=here, rested=now)


def _stands(s: LiveState, work: Search) -> float:
    """For how long the carriage has stood since `since`, s."""
    rests = max(s.seen.standing, 0.0 if math.isnan(work.rested) else s.time - work.rested)
    return min(rests, s.time - work.since)


def _push(
    p: LiveParameters, s: LiveState, work: Search, sample: Sample
) -> tuple[LiveState, Efforts]:
    q = p.settings.homing
    if abs(sample.encoder - work.origin) > GIVE:  # it had only stuck
        drive = s.drive._replace(macro_reference=sample.encoder, memory=REST)
        work = work._replace(phase=SEARCH, since=s.time, origin=NAN)
        return s._replace(work=work, drive=drive), Efforts(0.0, 0.0, 1.0)
    work = _watched(work, s.time, sample.encoder)
    s = s._replace(work=work)
    if _stands(s, work) < q.stand - TICK:
        return s, Efforts(_slow(q, s, -q.volts), 0.0, 1.0)
    drive = s.drive._replace(macro_reference=sample.encoder, memory=REST)
    sure = abs(sample.encoder - work.stop) <= GIVE  # never, the first time: no stop is known
    cause = "end stop confirmed" if sure else "end stop found"
    event = t.reported(s, "move", cause, {"stop_raw_counts": sample.encoder})
    felt = Search(BACK, NAN, NAN, sample.encoder, sure, expected=sample.encoder)
    s = s._replace(work=felt, drive=drive)
    return s, Efforts(0.0, 0.0, 1.0, 0.0, (event,))


def _back(
    p: LiveParameters, s: LiveState, work: Search, sample: Sample, dt: float
) -> tuple[LiveState, Efforts]:
    """Back off; `since`: within the tolerance since then, or NaN."""
    q, sequence = p.settings.homing, s.laws.sequence
    goal = work.stop + (q.back_off if work.sure else AGAIN)
    reference = min(s.drive.macro_reference + q.speed * dt, goal, sample.encoder + q.lead)
    if not work.sure and sample.encoder >= goal - sequence.tolerance:
        drive = s.drive._replace(macro_reference=sample.encoder, memory=REST)
        s = s._replace(work=work._replace(phase=SEARCH, since=s.time, origin=NAN), drive=drive)
        return s, Efforts(0.0, 0.0, 1.0)
    since = arrival.since(sequence, goal - sample.encoder, work.since, s.time)
    # Not while the stop is not sure, which has turned back above.
    if arrival.arrived(sequence, since, s.time):
        offset = goal - q.coordinate
        shift = offset - s.frame.offset  # counts lost or gained since it was last known
        s = s._replace(
            frame=Frame(offset, 0.0, True, s.frame.zero, named=True),
            survey=survey.homed(p.settings.edges, s.survey, offset),
        )
        s = s._replace(seen=s.seen._replace(position=position(p, s)))
        found = {
            "offset_raw_counts": offset,
            "stop_raw_counts": work.stop,
            "shift_counts": shift,
        }
        trust = t.reported(s, "trust", "homed", {"trusted": True, **found})
        s, notices = t.conclude(p, s, m.READY, (m.DONE, t.HOMED), found)
        return s, Efforts(notices=(trust, *notices))
    drive, motor = macro_effort(s, sample.encoder, reference, dt)
    s = s._replace(drive=drive, work=work._replace(since=since))
    return s, Efforts(_slow(q, s, motor), 0.0, 1.0)
