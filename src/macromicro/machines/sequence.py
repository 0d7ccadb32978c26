"""A sequence of moves of one stage or several: profile, arrival or time-out, hold."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.columns import Meaning
from macromicro.control import arrival
from macromicro.control.arrival import TICK
from macromicro.control.stage_law import Sample, Target
from macromicro.kernel import kernel
from macromicro.machines.folding import empty, fold
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

    start: Annotated[Array, Meaning("earliest start; NaN: after the move before", "s")]
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
    end: Annotated[float, Meaning("when the programme ends; NaN: after the last hold", "s")]


class Progress(NamedTuple):
    phase: Annotated[int, Meaning("one of WAITING, MOVING, HOLDING, DONE")]
    move: Annotated[int, Meaning("index of the present move, -1 before the first")]
    piece: Annotated[int, Meaning("piece of its profile")]
    began: Annotated[float, Meaning("when its profile, or its hold, began", "s")]
    inside: Annotated[float, Meaning("since when it is within the tolerance; NaN: it is not", "s")]
    arrived: Annotated[int, Meaning("1 once it has arrived")]


def begin() -> Progress:
    return Progress(WAITING, -1, 0, 0.0, math.nan, 0)


@kernel
def piece_at(plan: Plan, s: Progress, t: float) -> int:
    """The piece of the present profile at a time."""
    piece = s.piece
    if s.phase == MOVING:
        since, last = t - s.began, plan.first[s.move + 1] - 1
        while piece < last and plan.pieces[piece + 1, 0] <= since:
            piece += 1
    return int(piece)


@kernel
def aim(plan: Plan, s: Progress, t: float) -> Target:
    """The set point; the progress holds the piece."""
    if s.move < 0:
        return Target(plan.origin, 0.0, 0.0, math.inf)
    since = t - s.began
    if s.phase != MOVING or since >= plan.length[s.move] - TICK:
        return Target(plan.target[s.move], 0.0, 0.0, math.inf)
    h = since - plan.pieces[s.piece, 0]
    p, v = plan.pieces[s.piece, 1], plan.pieces[s.piece, 2]
    a, j = plan.pieces[s.piece, 3], plan.pieces[s.piece, 4]
    place = p + h * (v + h * (0.5 * a + h * j / 6.0))
    return Target(place, v + h * (a + 0.5 * h * j), a + h * j, math.inf)


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
def begun(plan: Plan, s: Progress, t: float) -> Progress:
    """The progress with what is due at a time: the next move, the end, the next piece."""
    if s.phase == DONE:
        return s
    if over(plan, s, t):
        return Progress(DONE, s.move, s.piece, t, s.inside, s.arrived)
    if due(plan, s, t):
        s = Progress(MOVING, s.move + 1, plan.first[s.move + 1], t, math.nan, 0)
    return Progress(s.phase, s.move, piece_at(plan, s, t), s.began, s.inside, s.arrived)


@kernel
def waits(plan: Plan, s: Progress, t: float) -> bool:
    """Whether a profile has ended and its arrival has not."""
    return bool(s.phase == MOVING and t - s.began >= plan.length[s.move] - TICK)


@kernel
def judged(
    plan: Plan,
    s: Progress,
    t: float,
    inside: Annotated[float, Meaning("since when the stage is within its tolerance", "s")],
    arrived: Annotated[bool, Meaning("whether every stage has arrived")],
    patience: Annotated[float, Meaning("longest wait for an arrival", "s")],
) -> Progress:
    """The progress of a profile that has ended: arrived, given up, or waiting."""
    if arrived or t - s.began >= plan.length[s.move] + patience - TICK:
        return Progress(HOLDING, s.move, s.piece, t, inside, int(arrived))
    return Progress(MOVING, s.move, s.piece, s.began, inside, 0)


@kernel
def step(
    plan: Plan, rule: Arrival, s: Progress, sample: Sample
) -> tuple[
    Annotated[Progress, Meaning(name="progress")], Annotated[Target, Meaning(name="target")]
]:
    t = sample.t
    s = begun(plan, s, t)
    target = aim(plan, s, t)
    if waits(plan, s, t):
        inside = arrival.since(rule, target.position - sample.position, s.inside, t)
        s = judged(plan, s, t, inside, arrival.arrived(rule, inside, t), rule.patience)
    return s, target


@lru_cache(maxsize=16)
def together(count: int) -> Callable[..., tuple[Progress, Any, Any]]:
    """`step` of several stages, whose plans have the same times and pieces.

    A kernel from the loops of the stages (`stage.Loop`), the progress of all, since when each is
    within its tolerance, and their samples to progress, those times and the targets. A move has
    arrived once every stage has.
    """

    def targets(k: int, rest: Any) -> Any:
        def aims(loops: Any, s: Progress, t: float) -> Any:
            return (aim(loops[0].plan, s, t), *rest(loops[1:], s, t))

        return aims

    def waiting(k: int, rest: Any) -> Any:
        def waited(loops: Any, aims: Any, samples: Any, before: Any, t: float) -> Any:
            rule = loops[0].arrival
            error = aims[0].position - samples[0].position
            inside = arrival.since(rule, error, before[0], t)
            others, arrived, patience = rest(loops[1:], aims[1:], samples[1:], before[1:], t)
            all_arrived = arrival.arrived(rule, inside, t) and arrived
            return (inside, *others), all_arrived, float(max(rule.patience, patience))

        return waited

    aims_of = fold(targets, count, empty)
    waited_of = fold(waiting, count, _waited)
    outside = (math.nan,) * count

    def steps(loops: Any, s: Progress, since: Any, samples: Any) -> tuple[Progress, Any, Any]:
        plan, t, move = loops[0].plan, samples[0].t, s.move
        s = begun(plan, s, t)
        if s.move != move:
            since = outside
        aims = aims_of(loops, s, t)
        if waits(plan, s, t):
            since, arrived, patience = waited_of(loops, aims, samples, since, t)
            s = judged(plan, s, t, since[0], arrived, patience)
        return s, since, aims

    return kernel(steps)


@kernel
def _waited(*given: Any) -> tuple[tuple[()], bool, float]:
    """The end of a fold: nothing is awaited."""
    return (), True, 0.0
