"""The live machine: `begin`, `accept` a request, `step` a control period, `fault`.

The machine is pure: it takes a sample and gives outputs, reads no clock and no file. It
calls the control laws that the simulator compiles, interpreted.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from macromicro.control import calibration
from macromicro.control.live import brake, homing, jog, moves, programme
from macromicro.control.live import messages as m
from macromicro.control.live import transitions as t
from macromicro.control.live.accept import accept
from macromicro.control.live.effort import NONE, Efforts
from macromicro.control.live.messages import Evidence, Notice
from macromicro.control.live.parameters import LiveParameters
from macromicro.control.live.state import (
    Approach,
    Braking,
    Jogged,
    LiveState,
    Running,
    Search,
    Seen,
    Settle,
    Trouble,
    begin,
)
from macromicro.types import SAFE, Command, Outputs, Sample

__all__ = ["accept", "begin", "fault", "step"]

_SPEED_TIME = 0.01  # s: time constant of the speed that the encoder shows
_LEAP = 0.1  # s: a longer step of the samples' time is no passing of time


def step(
    p: LiveParameters, s: LiveState, sample: Sample, dt: float
) -> tuple[LiveState, Command, Outputs, tuple[Notice, ...]]:
    """One control period `dt` [s]: state, what is asked for, outputs, what happened.

    Motor and CTRL are 0 V in disabled, ready, fault, and in stopped once at rest.
    """
    s, sample = _look(p, s, sample, dt)
    s, efforts = _work(p, s, sample, dt)
    motor, ctrl, macro_active, micro_active, notices = efforts
    d = s.drive
    command = Command(d.macro_reference, macro_active, d.micro_reference, micro_active, s.seen.fine)
    if s.mode == m.FAULT:
        return s, command, SAFE, notices
    reset = 0.0
    if d.reset:
        s, reset = s._replace(drive=d._replace(reset=False)), 1.0
    # A law that gives NaN, for numbers beyond all measure, is the guard's to stop and to tell.
    return s, command, Outputs(motor, ctrl, s.fan, reset), notices


def _work(p: LiveParameters, s: LiveState, sample: Sample, dt: float) -> tuple[LiveState, Efforts]:
    """What the machine does just now, by the kind of its work."""
    work, motion = s.work, s.motion
    if work is None or motion is None:
        return moves.hold(s, sample, dt) if s.mode == m.HOLDING else (s, NONE)
    return _WORKS[type(work)](p, s, motion, work, sample, dt)


_WORKS: dict[type, Callable[..., tuple[LiveState, Efforts]]] = {
    Settle: moves.fine,
    Approach: moves.coarse,
    Jogged: jog.step,
    Running: programme.step,
    Search: homing.step,
    Braking: brake.step,
}


def _look(p: LiveParameters, s: LiveState, sample: Sample, dt: float) -> tuple[LiveState, Sample]:
    """Readings, speed, standstill and position after this sample; what is no number is missing."""
    time, encoder, hall = sample.t, sample.encoder, sample.hall
    begun = not math.isnan(s.seen.encoder)
    if not math.isfinite(time) or (begun and not 0.0 <= time - s.time <= _LEAP):
        time = s.time + dt
    if math.isinf(encoder) or math.isinf(hall) or time != sample.t:
        encoder = encoder if math.isfinite(encoder) else math.nan
        hall = hall if math.isfinite(hall) else math.nan
        sample = sample._replace(t=time, encoder=encoder, hall=hall)
    last, speed, standing, fine, position = s.seen
    frame = s.frame
    if not math.isnan(encoder):
        if math.isnan(last):
            frame = frame._replace(offset=encoder - frame.first)
        else:
            moved = encoder - last
            speed += (moved / dt - speed) * min(dt / _SPEED_TIME, 1.0)
            standing = standing + dt if moved == 0.0 else 0.0
        last = encoder
    if not math.isnan(hall):
        fine = calibration.position(p.calibration, hall)
    position = (last - frame.offset) * p.settings.pitch + fine * 1e-3
    seen = Seen(last, speed, standing, fine, position)
    return s._replace(time=time, seen=seen, frame=frame), sample


def fault(
    p: LiveParameters,
    s: LiveState,
    words: str,
    evidence: Evidence,
    *,
    position_lost: bool = False,
) -> tuple[LiveState, tuple[Notice, ...]]:
    """A fault was found outside (by the guard, by the pacing): it latches, all is off.

    A motion ends as "fault" and the place is no longer trusted; nor is it where the caller
    says that counts may have been missed (`position_lost`). The first fault stays.
    """
    if s.mode == m.FAULT:
        return s, ()
    trusted = s.frame.trusted and s.motion is None and not position_lost
    s = s._replace(
        fault=Trouble(s.time, words, evidence),
        fan=0.0,
        drive=t.idle(s.drive),
        frame=s.frame._replace(trusted=trusted),
    )
    facts = {"words": words, **evidence}
    return t.conclude(p, s, m.FAULT, (m.FAULTED, t.FAULT), facts)
