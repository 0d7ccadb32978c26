"""Shared by moving modes: both laws with missing readings, windows of Hall readings."""

from __future__ import annotations

import math
from typing import NamedTuple

from macromicro.control import macro, micro
from macromicro.control.arrival import TICK
from macromicro.control.live.messages import Notice
from macromicro.control.live.parameters import Fine, LiveParameters
from macromicro.control.live.state import EMPTY, Drive, LiveState, Window, with_work
from macromicro.control.stage_law import Sample as StageSample
from macromicro.control.stage_law import Target
from macromicro.types import Sample


class Efforts(NamedTuple):
    motor: float = 0.0  # V
    ctrl: float = 0.0  # V
    macro_active: float = 0.0  # whether the macro-stage is under control, 0 or 1
    micro_active: float = 0.0  # whether the micro-stage is under control, 0 or 1
    notices: tuple[Notice, ...] = ()


NONE = Efforts()


def without_effort(ended: tuple[LiveState, tuple[Notice, ...]]) -> tuple[LiveState, Efforts]:
    """A period without effort in which a motion ends or is given up."""
    s, notices = ended
    return s, Efforts(notices=notices)


def macro_effort(s: LiveState, encoder: float, reference: float, dt: float) -> tuple[Drive, float]:
    """The macro law towards a reference in raw counts; without a reading no effort."""
    d = s.drive
    if math.isnan(encoder):
        return d._replace(macro_reference=reference), 0.0
    memory, motor = macro.step(
        s.laws.macro,
        d.memory,
        Target(reference, 0.0, 0.0, math.inf),
        StageSample(s.time, encoder),
        dt,
    )
    return Drive(reference, d.micro_reference, memory, d.integral, d.reset, d.fine), motor


class CarriageStep(NamedTuple):
    """The carriage behind a reference in raw counts."""

    reference: float  # no farther ahead than `homing.lead`
    ahead: float  # how far it was before
    drive: Drive
    motor: float  # V
    stuck: bool  # whether the motor pushes and the carriage stands


def lead_carriage(
    p: LiveParameters, s: LiveState, encoder: float, reference: float, dt: float
) -> CarriageStep:
    """Lead the carriage gently: a jog or set points, with what homing may push at most."""
    homing, ahead = p.settings.homing, reference - encoder
    if not math.isnan(ahead):
        reference = encoder + limit_effort(ahead, homing.lead)
    drive, motor = macro_effort(s, encoder, reference, dt)
    motor = limit_effort(motor, homing.volts)
    leans = abs(ahead) >= homing.lead or abs(motor) >= p.settings.jogging.lean
    return CarriageStep(reference, ahead, drive, motor, leans and s.seen.standing > 0.0)


def micro_effort(s: LiveState, hall: float, reference: float, dt: float) -> tuple[Drive, float]:
    """The micro law towards a reference; without a reading no effort."""
    d = s.drive
    if math.isnan(hall):
        return d._replace(micro_reference=reference), 0.0
    laws, aim, seen = (
        s.laws,
        Target(reference, 0.0, 0.0, math.inf),
        StageSample(s.time, s.seen.fine),
    )
    integral, fine, ctrl = micro.step(laws.micro, laws.fine, d.fine, d.integral, aim, seen, dt)
    return Drive(d.macro_reference, reference, d.memory, integral, d.reset, fine), ctrl


def rest_law(s: LiveState, dt: float) -> LiveState:
    """A period without a turn of the micro-stage, for a law whose model runs on."""
    if not s.laws.fine:
        return s
    fine = micro.rest(s.laws.fine, s.drive.fine, StageSample(s.time, s.seen.fine), dt)
    return s._replace(drive=s.drive._replace(fine=fine))


def parked_effort(s: LiveState, sample: Sample, dt: float) -> tuple[Drive, float, float]:
    """The macro-stage during a micro move: off if parked, else held."""
    if s.laws.sequence.park == 1:
        return s.drive, 0.0, 0.0
    drive, motor = macro_effort(s, sample.encoder, s.drive.macro_reference, dt)
    return drive, motor, 1.0


def fine_efforts(
    s: LiveState, sample: Sample, reference: float, dt: float
) -> tuple[LiveState, Efforts]:
    fine, ctrl = micro_effort(s, sample.hall, reference, dt)
    coarse, motor, active = parked_effort(s, sample, dt)
    drive = Drive(
        coarse.macro_reference,
        fine.micro_reference,
        coarse.memory,
        fine.integral,
        s.drive.reset,
        fine.fine,
    )
    return with_work(s, drive, s.work), Efforts(motor, ctrl, active, 1.0)


def limit_effort(volts: float, most: float) -> float:
    return min(max(volts, -most), most)


def observe(p: Fine, w: Window, hall: float, error: float, dt: float) -> Window:
    """A window after one more reading; its mean decides whether the stage is on target."""
    if math.isnan(hall):
        return w
    total, number = w.total + error, w.number + 1
    lives = w.lives or (number > 1 and hall != w.hall)
    span = number * dt
    if span < p.window - TICK:
        return Window(total, number, w.mean, w.held, hall, lives)
    mean = total / number
    held = w.held + span if abs(mean) <= p.band and (lives or number == 1) else 0.0
    return EMPTY._replace(mean=mean, held=held)
