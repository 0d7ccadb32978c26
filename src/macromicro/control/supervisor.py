"""The sequence of macro- and micro-stage (Section 6.1, Figure 6.1)."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.columns import Meaning
from macromicro.control import arrival, calibration, macro, micro, outside
from macromicro.control.arrival import TICK, Sequence
from macromicro.control.calibration import Calibration
from macromicro.control.macro import MacroLaw, Memory
from macromicro.control.outside import Kept
from macromicro.control.pi import PiAntiWindup
from macromicro.control.stage_law import Sample as StageSample
from macromicro.control.stage_law import Target
from macromicro.kernel import kernel
from macromicro.programme import moves
from macromicro.types import Command, Outputs, Sample

WAITING, MACRO, SETTLING, MICRO, DONE, FAULT = range(6)


class Supervisor(NamedTuple):
    macro: Annotated[MacroLaw, Meaning("law of the macro-stage, in counts and V")]
    micro: Annotated[
        PiAntiWindup, Meaning("law of the micro-stage, in m and V; of a law in fine, its limits")
    ]
    sequence: Annotated[Sequence, Meaning("arrival, wait, parking")]
    calibration: Annotated[Calibration, Meaning("Hall voltage to m")]
    fan: Annotated[float, Meaning("0 or 1, written in every period")]
    fine: Annotated[
        tuple[Any, ...],
        Meaning(
            "of the law of the micro-stage that drives instead of the PI (micro.prepared), or none"
        ),
    ] = ()

    @property
    def compiles(self) -> bool:
        fine = all(outside.compiles(outside.law_of_gains(gains)) for gains in self.fine)
        return self.macro.compiles and fine


_NONE = np.empty(0)


class Plan(NamedTuple):
    """A programme as arrays of one length."""

    # NaN: when the move before is complete; -inf: when its hold is over, arrived or not.
    start: Annotated[Array, Meaning("beginning of each move; NaN: after the one before", "s")]
    stage: Annotated[npt.NDArray[np.int64], Meaning("0 macro, 1 micro")]
    target: Annotated[Array, Meaning("counts for macro, m for micro")]
    hold: Annotated[Array, Meaning("", "s")]
    end: Annotated[float, Meaning("or NaN", "s")]
    # Of trajectories, at each target; of shape (0,): none.
    velocity: Annotated[Array, Meaning("its velocity, units of the target / s")] = _NONE
    acceleration: Annotated[Array, Meaning("its acceleration, units of the target / s^2")] = _NONE
    turn: Annotated[Array, Meaning("time until the set point turns back", "s")] = _NONE
    correction: Annotated[Array, Meaning("learned feed-forward of the micro-stage", "m")] = _NONE


class Progress(NamedTuple):
    move: Annotated[int, Meaning("index of the present one, -1 before the first")]
    phase: Annotated[int, Meaning("WAITING, MACRO, SETTLING, MICRO or DONE")]
    began: Annotated[float, Meaning("when the move began", "s")]
    entered: Annotated[float, Meaning("when the phase began", "s")]
    inside: Annotated[float, Meaning("since when it is within the tolerance, or NaN", "s")]
    zeroed: Annotated[int, Meaning("whether the laser has been reset for this place, 0 or 1")]
    macro_reference: Annotated[float, Meaning("", "count")]
    micro_reference: Annotated[float, Meaning("", "m")]
    macro: Annotated[Memory, Meaning("memories of the macro laws")]
    integral: Annotated[float, Meaning("integral effort of the micro-stage's PI", "V")]
    fine: Annotated[Kept, Meaning("memory of the law that drives instead of it")] = ()


def begin(position: float, control: Supervisor | None = None) -> Progress:
    """The supervisor before the first move (`position` in counts)."""
    memory = macro.rest(0.0) if control is None else macro.begun(control.macro)
    fine = () if control is None else micro.begin(control.fine)
    return Progress(-1, WAITING, 0.0, 0.0, math.nan, 1, float(position), 0.0, memory, 0.0, fine)


@kernel
def _complete(p: Supervisor, plan: Plan, s: Progress, t: float) -> bool:
    """Whether the present move, with its hold, is over."""
    if s.move < 0:
        return True
    if plan.stage[s.move] == moves.MACRO:
        return s.phase == SETTLING and t - s.entered >= p.sequence.wait + plan.hold[s.move] - TICK
    return bool(t - s.began >= plan.hold[s.move] - TICK)


@kernel
def _due(p: Supervisor, plan: Plan, s: Progress, t: float) -> bool:
    """Whether the next move begins now."""
    following = s.move + 1
    if following >= len(plan.stage):
        return False
    if math.isnan(plan.start[following]):
        return _complete(p, plan, s, t)
    if plan.start[following] < 0.0:  # the set point of a profile, by the clock
        return bool(t - s.began >= plan.hold[s.move] - TICK)
    if t < plan.start[following] - TICK:
        return False
    # A macro move may cut in; a micro move waits until the carriage has settled.
    settled = s.phase == SETTLING and t - s.entered >= p.sequence.wait - TICK
    return bool(plan.stage[following] == moves.MACRO) or s.phase in (WAITING, MICRO) or settled


@kernel
def _over(p: Supervisor, plan: Plan, s: Progress, t: float) -> bool:
    """Whether the programme has ended: by its schedule, else with the last hold."""
    if not math.isnan(plan.end):
        return t >= plan.end - TICK
    return s.move + 1 >= len(plan.stage) and _complete(p, plan, s, t)


@kernel
def _overtaken(plan: Plan, move: int, t: float) -> bool:
    """Whether the next move is a fine one whose successor is due as well."""
    if move + 2 >= len(plan.stage) or plan.stage[move + 1] == moves.MACRO:
        return False
    # NaN and -inf, no time: never
    return bool(plan.start[move + 2] >= 0.0 and t >= plan.start[move + 2] - TICK)


@kernel
def _scheduled(p: Supervisor, plan: Plan, s: Progress, position: float, t: float) -> Progress:
    """Arrival, end of the wait, next move: everything but the laws."""
    move, phase, began, entered = s.move, s.phase, s.began, s.entered
    inside, zeroed = s.inside, s.zeroed
    macro_reference, micro_reference = s.macro_reference, s.micro_reference
    memory, integral = s.macro, s.integral
    if phase == MACRO:
        inside = arrival.since(p.sequence, macro_reference - position, inside, t)
        if arrival.arrived(p.sequence, inside, t) or t - began >= p.sequence.patience:
            phase, entered, zeroed = SETTLING, t, 0
    waiting = phase == MACRO or (phase == SETTLING and t - entered < p.sequence.wait - TICK)
    while waiting and _overtaken(plan, move, t):
        move += 1
    now = Progress(
        move,
        phase,
        began,
        entered,
        inside,
        zeroed,
        macro_reference,
        micro_reference,
        memory,
        integral,
        s.fine,
    )
    if phase != DONE and _over(p, plan, now, t):
        phase, entered = DONE, t
    elif phase != DONE and _due(p, plan, now, t):
        move, began, entered = move + 1, t, t
        if plan.stage[move] == moves.MACRO:
            if p.sequence.park == 1 and phase != MACRO:
                memory = macro.again(memory)
            phase, inside, macro_reference = MACRO, math.nan, plan.target[move]
            if p.sequence.overlap == 0:
                micro_reference, integral = 0.0, 0.0
            elif move + 1 < len(plan.stage) and plan.stage[move + 1] == moves.MICRO:
                micro_reference = plan.target[move + 1]
        else:
            if phase != MICRO:
                zeroed = 0
                if p.sequence.overlap == 0:
                    integral = 0.0
            phase = MICRO
            micro_reference = plan.target[move]
    return Progress(
        move,
        phase,
        began,
        entered,
        inside,
        zeroed,
        macro_reference,
        micro_reference,
        memory,
        integral,
        s.fine,
    )


@kernel
def step(
    p: Supervisor, plan: Plan, s: Progress, sample: Sample, dt: float
) -> tuple[
    Annotated[Progress, Meaning(name="state")],
    Annotated[Command, Meaning(name="command")],
    Annotated[Outputs, Meaning(name="outputs")],
]:
    """One control period; errors in counts (macro) and m (micro)."""
    t = sample.t
    s = _scheduled(p, plan, s, sample.encoder, t)
    fine = calibration.position(p.calibration, sample.hall)
    memory, integral, zeroed, kept = s.macro, s.integral, s.zeroed, s.fine
    motor = 0.0
    moving = s.phase == MACRO or (p.sequence.park == 0 and s.move >= 0 and s.phase != DONE)
    # A missing reading gives no effort and leaves the memory: the guard counts how long.
    if moving and not math.isnan(sample.encoder):
        target = Target(s.macro_reference, 0.0, 0.0, math.inf)
        if s.phase == MACRO and len(plan.velocity) > 0:
            speed, change = plan.velocity[s.move], plan.acceleration[s.move]
            target = Target(s.macro_reference, speed, change, math.inf)
        memory, motor = macro.step(p.macro, memory, target, StageSample(t, sample.encoder), dt)
    ctrl = 0.0
    seen = StageSample(t, fine)
    driven = s.phase == MICRO or (p.sequence.overlap == 1 and s.phase in (MACRO, SETTLING))
    if driven and not math.isnan(sample.hall):
        aim = Target(s.micro_reference, 0.0, 0.0, math.inf)
        if s.phase == MICRO and len(plan.velocity) > 0:
            turn = math.inf
            if len(plan.turn) > 0:
                turn = plan.turn[s.move]
            speed, change = plan.velocity[s.move], plan.acceleration[s.move]
            aim = Target(s.micro_reference, speed, change, turn)
        if s.phase == MICRO and len(plan.correction) > 0:
            place = aim.position + plan.correction[s.move]
            aim = Target(place, aim.velocity, aim.acceleration, aim.turn)
        integral, kept, ctrl = micro.step(p.micro, p.fine, kept, integral, aim, seen, dt)
    else:
        kept = micro.rest(p.fine, kept, seen, dt)
    reset = 0.0
    if zeroed == 0 and (
        s.phase == MICRO or (s.phase == SETTLING and t - s.entered >= p.sequence.wait - TICK)
    ):
        reset, zeroed = 1.0, 1
    s = Progress(
        s.move,
        s.phase,
        s.began,
        s.entered,
        s.inside,
        zeroed,
        s.macro_reference,
        s.micro_reference,
        memory,
        integral,
        kept,
    )
    command = Command(
        s.macro_reference,
        1.0 if moving else 0.0,
        s.micro_reference,
        1.0 if driven else 0.0,
        fine,
    )
    return s, command, Outputs(motor, ctrl, p.fan, reset)
