"""Moves to a target: macro, wait, micro, hold (Section 6.1, Figure 6.1)."""

from __future__ import annotations

import math

from macromicro.control import arrival
from macromicro.control.arrival import TICK
from macromicro.control.live import brake
from macromicro.control.live import messages as m
from macromicro.control.live import transitions as t
from macromicro.control.live._effort import (
    Efforts,
    fine_efforts,
    macro_effort,
    observe,
    parked_effort,
    without_effort,
)
from macromicro.control.live.messages import Evidence, Notice
from macromicro.control.live.parameters import LiveParameters
from macromicro.control.live.state import (
    EMPTY,
    NAN,
    REST,
    Approach,
    LiveState,
    Motion,
    Settle,
    Targets,
    by_laser,
    carriage,
    with_work,
)
from macromicro.types import Sample


def start_macro(
    s: LiveState, motion: Motion, cause: str, evidence: Evidence
) -> tuple[LiveState, tuple[Notice, ...]]:
    """Begin the coarse part; the micro-stage goes off."""
    drive = t.idle(s.drive)._replace(macro_reference=motion.coarse)
    target = Targets(motion.target, motion.coarse - s.frame.offset)
    s = s._replace(motion=motion, work=Approach(NAN, NAN), drive=drive, target=target)
    s, event = t.go(s, m.MOVING_MACRO, cause, evidence)
    return s, (event,)


def start_micro(
    s: LiveState, motion: Motion, cause: str, evidence: Evidence
) -> tuple[LiveState, tuple[Notice, ...]]:
    """Begin the fine part; the laser is reset if the micro-stage was off."""
    off = s.mode not in (m.HOLDING, m.MOVING_MICRO)
    drive = s.drive._replace(micro_reference=motion.fine)
    if off:
        drive = drive._replace(integral=0.0, reset=True)
        if s.mode != m.SETTLING:
            drive = drive._replace(macro_reference=s.seen.encoder)
    work = Settle(s.time, s.seen.encoder, EMPTY)
    target = Targets(motion.target, s.target.macro, motion.fine)
    s = s._replace(motion=motion, work=work, drive=drive, target=target)
    s, event = t.go(s, m.MOVING_MICRO, cause, evidence)
    return s, (event,)


def _macro_error(s: LiveState, motion: Motion, sample: Sample) -> float:
    return motion.coarse - sample.encoder


def coarse(
    p: LiveParameters, s: LiveState, motion: Motion, work: Approach, sample: Sample, dt: float
) -> tuple[LiveState, Efforts]:
    step = approach if math.isnan(work.entered) else settle
    return step(p, s, motion, work, sample, dt)


def approach(
    p: LiveParameters, s: LiveState, motion: Motion, work: Approach, sample: Sample, dt: float
) -> tuple[LiveState, Efforts]:
    q = s.laws.sequence
    error = _macro_error(s, motion, sample)
    inside = arrival.since(q, error, work.inside, s.time)
    if arrival.arrived(q, inside, s.time):
        found = {"error_counts": error, "seconds": s.time - motion.began}
        s, event = t.go(s._replace(work=Approach(inside, s.time)), m.SETTLING, t.ARRIVED, found)
        s, efforts = _park(s, sample, dt)
        return s, efforts._replace(notices=(event,))
    if s.time - motion.began >= q.patience - TICK:
        return without_effort(brake.start(p, s, m.STALLED, t.STALLED))
    drive, motor = macro_effort(s, sample.encoder, motion.coarse, dt)
    return with_work(s, drive, Approach(inside, NAN)), Efforts(motor, 0.0, 1.0)


def _park(s: LiveState, sample: Sample, dt: float) -> tuple[LiveState, Efforts]:
    drive, motor, active = parked_effort(s, sample, dt)
    return with_work(s, drive, s.work), Efforts(motor, 0.0, active)


def settle(
    p: LiveParameters, s: LiveState, motion: Motion, work: Approach, sample: Sample, dt: float
) -> tuple[LiveState, Efforts]:
    """One period of the wait, at whose end the carriage must still be at its target."""
    q = s.laws.sequence
    s, efforts = _park(s, sample, dt)
    if math.isnan(sample.encoder) or s.time - work.entered < q.wait - TICK:
        return s, efforts
    error = _macro_error(s, motion, sample)
    found: Evidence = {"error_counts": error}
    if not arrival.within(q, error):
        if s.time - motion.began >= q.patience - TICK:
            return without_effort(brake.start(p, s, m.STALLED, t.STALLED))
        drive = s.drive._replace(memory=REST) if q.park == 1 else s.drive
        s, event = t.go(
            s._replace(work=Approach(NAN, NAN), drive=drive), m.MOVING_MACRO, t.DRIFTED, found
        )
        return s, efforts._replace(notices=(event,))
    if math.isnan(motion.target) or m.MICRO not in p.stages:
        return without_effort(t.conclude(p, s, m.READY, (m.DONE, t.SETTLED), found))
    rest = remaining(p, s, motion.target)
    if not s.limits.micro_low <= rest <= min(p.settings.fine.bias_high, s.limits.micro_high):
        found["micro_mm"] = rest * 1e3
        return without_effort(brake.start(p, s, m.STALLED, t.STALLED, found))
    found["micro_mm"] = rest * 1e3
    s, notices = start_micro(s, motion._replace(fine=rest), t.SETTLED, found)
    return s, efforts._replace(notices=notices)


def remaining(p: LiveParameters, s: LiveState, target: float) -> float:
    """The contraction from the carriage's position to the target."""
    return target - carriage(p, s)


def fine(
    p: LiveParameters, s: LiveState, motion: Motion, work: Settle, sample: Sample, dt: float
) -> tuple[LiveState, Efforts]:
    s, efforts = fine_efforts(s, sample, motion.fine, dt)
    q = p.settings.fine
    window = observe(q, work.window, sample.hall, motion.fine - s.seen.fine, dt)
    witness = EMPTY
    if by_laser(p, s):  # of a move without such a target the laser says nothing (NaN)
        off = motion.target - s.seen.position
        witness = observe(q, work.witness, sample.laser, off, dt)
    s = with_work(s, s.drive, Settle(work.entered, work.base, window, witness))
    found: Evidence = {"error_mm": window.mean * 1e3, "window_s": q.window}
    if not math.isnan(witness.mean):
        found["error_by_laser_mm"] = witness.mean * 1e3
    # Only full windows are reported.
    if window.held >= q.dwell - TICK and window.number == 0 and not math.isnan(sample.encoder):
        rests = s.seen.encoder == work.base or math.isnan(motion.target)
        # NaN where no laser speaks; it fails the comparison.
        if rests and not abs(witness.mean) > q.band:
            s, notices = t.conclude(p, s, m.HOLDING, (m.DONE, t.ON_TARGET), found)
            return s, efforts._replace(notices=notices)
        # The carriage is not where it was, or the laser shows another place than the Hall
        # sensor: choose the target again, by both.
        rest = motion.fine + witness.mean if rests else remaining(p, s, motion.target)
        again = motion._replace(fine=rest)
        s = s._replace(motion=again, work=Settle(work.entered, s.seen.encoder, EMPTY))
        if s.limits.micro_low <= again.fine <= s.limits.micro_high:
            return s, efforts
        return _gives_up(p, s, {**found, "micro_mm": again.fine * 1e3})
    if s.time - work.entered >= q.patience - TICK:
        return _gives_up(p, s, found)
    return s, efforts


def _gives_up(p: LiveParameters, s: LiveState, found: Evidence) -> tuple[LiveState, Efforts]:
    error, laser = found["error_mm"], found.get("error_by_laser_mm", math.nan)
    if abs(laser) > p.settings.fine.band * 1e3:
        found["reason"] = (
            f"the Hall sensor is {error * 1e3:.1f} um and the laser {laser * 1e3:.1f} um off, "
            f"allowed {p.settings.fine.band * 1e6:g} um by each: recalibrate the Hall sensor"
        )
    s, notices = t.conclude(p, s, m.STOPPED, (m.STALLED, t.STALLED), found)
    return s, Efforts(notices=notices)


def hold(s: LiveState, sample: Sample, dt: float) -> tuple[LiveState, Efforts]:
    return fine_efforts(s, sample, s.drive.micro_reference, dt)


def stay(
    p: LiveParameters, s: LiveState, outcome: str, cause: str, found: Evidence | None = None
) -> tuple[LiveState, tuple[Notice, ...]]:
    """End a motion of the micro-stage and hold it where it is, even beyond the soft limits."""
    here = max(s.seen.fine, 0.0)
    s = s._replace(drive=s.drive._replace(micro_reference=here))
    return t.conclude(p, s, m.HOLDING, (outcome, cause), {"micro_mm": here * 1e3, **(found or {})})
