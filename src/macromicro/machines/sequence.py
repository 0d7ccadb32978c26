"""A sequence of moves of one stage: profile, arrival or time-out, hold."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.columns import Meaning
from macromicro.control import arrival
from macromicro.control.arrival import TICK
from macromicro.control.stage_law import Sample, Target
from macromicro.kernel import kernel
from macromicro.schema.par import Par

WAITING, MOVING, HOLDING, DONE = range(4)


class Arrival(NamedTuple):
    tolerance: Annotated[
        float, Par("m", "error that counts as arrived", "machine choice", shown="um", positive=True)
    ] = 20.0e-6
    dwell: Annotated[
        float, Par("s", "time within the tolerance before arrival", "machine choice", lo=0.0)
    ] = 0.02
    patience: Annotated[
        float,
        Par(
            "s",
            "longest wait for an arrival after the profile's end",
            "machine choice",
            positive=True,
        ),
    ] = 2.0


class Plan(NamedTuple):
    """Moves and the pieces of their profiles."""

    start: Annotated[Array, Meaning("earliest start, s; NaN: after the move before")]
    target: Annotated[Array, Meaning("where each ends", "m")]
    hold: Annotated[Array, Meaning("hold time after the arrival", "s")]
    length: Annotated[Array, Meaning("duration of the profile", "s")]
    first: Annotated[
        npt.NDArray[np.int64], Meaning("its first piece; the last number is that of all pieces")
    ]
    pieces: Annotated[
        Array,
        Meaning(
            "begin within the profile (s), position (m), velocity, acceleration and jerk there"
        ),
    ]
    origin: Annotated[float, Meaning("target before the first move", "m")]
    end: Annotated[float, Meaning("when the programme ends, s; NaN: after the last hold")]


class Progress(NamedTuple):
    phase: Annotated[int, Meaning("one of WAITING, MOVING, HOLDING, DONE")]
    move: Annotated[int, Meaning("index of the present move, -1 before the first")]
    piece: Annotated[int, Meaning("piece of its profile")]
    began: Annotated[float, Meaning("when its profile, or its hold, began", "s")]
    inside: Annotated[float, Meaning("since when it is within the tolerance, s; NaN: it is not")]
    arrived: Annotated[int, Meaning("1 once it has arrived")]


def begin() -> Progress:
    return Progress(WAITING, -1, 0, 0.0, math.nan, 0)


@kernel
def aim(
    plan: Plan, s: Progress, t: float
) -> tuple[Annotated[int, Meaning(name="piece")], Annotated[Target, Meaning(name="target")]]:
    if s.move < 0:
        return 0, Target(plan.origin, 0.0, 0.0, math.inf)
    since = t - s.began
    if s.phase != MOVING or since >= plan.length[s.move] - TICK:
        return s.piece, Target(plan.target[s.move], 0.0, 0.0, math.inf)
    piece, last = s.piece, plan.first[s.move + 1] - 1
    while piece < last and plan.pieces[piece + 1, 0] <= since:
        piece += 1
    h = since - plan.pieces[piece, 0]
    p, v = plan.pieces[piece, 1], plan.pieces[piece, 2]
    a, j = plan.pieces[piece, 3], plan.pieces[piece, 4]
    place = p + h * (v + h * (0.5 * a + h * j / 6.0))
    return piece, Target(place, v + h * (a + 0.5 * h * j), a + h * j, math.inf)


@kernel
def due(plan: Plan, s: Progress, t: float) -> bool:
    following = s.move + 1
    if following >= len(plan.target):
        return False
    if math.isnan(plan.start[following]):
        held = s.phase == HOLDING and t - s.began >= plan.hold[s.move] - TICK
        return s.move < 0 or held
    return bool(t >= plan.start[following] - TICK)


@kernel
def over(plan: Plan, s: Progress, t: float) -> bool:
    if not math.isnan(plan.end):
        return t >= plan.end - TICK
    last = s.move == len(plan.target) - 1
    return last and s.phase == HOLDING and t - s.began >= plan.hold[s.move] - TICK


@kernel
def step(
    plan: Plan, rule: Arrival, s: Progress, sample: Sample
) -> tuple[
    Annotated[Progress, Meaning(name="progress")], Annotated[Target, Meaning(name="target")]
]:
    t = sample.t
    if s.phase == DONE:
        return s, Target(plan.target[s.move], 0.0, 0.0, math.inf)
    if over(plan, s, t):
        done = Progress(DONE, s.move, s.piece, t, s.inside, s.arrived)
        return done, Target(plan.target[s.move], 0.0, 0.0, math.inf)
    if due(plan, s, t):
        s = Progress(MOVING, s.move + 1, plan.first[s.move + 1], t, math.nan, 0)
    piece, target = aim(plan, s, t)
    s = Progress(s.phase, s.move, piece, s.began, s.inside, s.arrived)
    if s.phase == MOVING and t - s.began >= plan.length[s.move] - TICK:
        inside = arrival.since(rule, target.position - sample.position, s.inside, t)
        there = arrival.arrived(rule, inside, t)
        late = t - s.began >= plan.length[s.move] + rule.patience - TICK
        if there or late:
            s = Progress(HOLDING, s.move, piece, t, inside, int(there))
        else:
            s = Progress(MOVING, s.move, piece, s.began, inside, 0)
    return s, target
