"""Moves of one stage one after the other: profile, arrival or time-out, hold."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.control import arrival
from macromicro.control.arrival import TICK
from macromicro.control.stage_law import Sample, Target
from macromicro.kernel import kernel
from macromicro.schema.par import Par

WAITING, MOVING, HOLDING, DONE = range(4)


class Arrival(NamedTuple):
    """When a move counts as arrived, and how long that is waited for."""

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
    """Moves and the pieces of their profiles.

    Attributes
    ----------
    start : ndarray, shape (n,)
        Earliest start, s; NaN: as soon as the move before is complete.
    target : ndarray, shape (n,)
        Where each ends, m.
    hold : ndarray, shape (n,)
        How long that is held after the arrival, s.
    length : ndarray, shape (n,)
        Duration of the profile, s.
    first : ndarray of int, shape (n + 1,)
        Its first piece; the last number is that of all pieces.
    pieces : ndarray, shape (pieces, 5)
        Begin within the profile (s), position (m), velocity, acceleration and jerk there.
    origin : float
        Target before the first move, m.
    end : float
        When the programme ends, s; NaN: after the last hold.
    """

    start: Array
    target: Array
    hold: Array
    length: Array
    first: npt.NDArray[np.int64]
    pieces: Array
    origin: float
    end: float


class Progress(NamedTuple):
    """State of the sequence.

    Attributes
    ----------
    phase : int
        One of WAITING, MOVING, HOLDING, DONE.
    move : int
        Index of the present move, -1 before the first.
    piece : int
        Piece of its profile.
    began : float
        When its profile, or its hold, began, s.
    inside : float
        Since when it is within the tolerance, s; NaN: it is not.
    arrived : int
        1 once it has arrived.
    """

    phase: int
    move: int
    piece: int
    began: float
    inside: float
    arrived: int


def begin() -> Progress:
    """Before the first move.

    Returns
    -------
    Progress
        Waiting.
    """
    return Progress(WAITING, -1, 0, 0.0, math.nan, 0)


@kernel
def aim(plan: Plan, s: Progress, t: float) -> tuple[int, Target]:
    """The set point now.

    Parameters
    ----------
    plan : Plan
        The moves.
    s : Progress
        State.
    t : float
        Now, s.

    Returns
    -------
    piece : int
        Of the profile that it is on.
    target : Target
        With its derivatives.
    """
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
    """Whether the next move begins now.

    Parameters
    ----------
    plan : Plan
        The moves.
    s : Progress
        State.
    t : float
        Now, s.

    Returns
    -------
    bool
        True if its time has come, or the hold before it has ended.
    """
    following = s.move + 1
    if following >= len(plan.target):
        return False
    if math.isnan(plan.start[following]):
        held = s.phase == HOLDING and t - s.began >= plan.hold[s.move] - TICK
        return s.move < 0 or held
    return bool(t >= plan.start[following] - TICK)


@kernel
def over(plan: Plan, s: Progress, t: float) -> bool:
    """Whether the programme ends now.

    Parameters
    ----------
    plan : Plan
        The moves.
    s : Progress
        State.
    t : float
        Now, s.

    Returns
    -------
    bool
        True at its end, or after the last hold.
    """
    if not math.isnan(plan.end):
        return t >= plan.end - TICK
    last = s.move == len(plan.target) - 1
    return last and s.phase == HOLDING and t - s.began >= plan.hold[s.move] - TICK


@kernel
def step(plan: Plan, rule: Arrival, s: Progress, sample: Sample) -> tuple[Progress, Target]:
    """One control period of the sequence.

    Parameters
    ----------
    plan : Plan
        The moves.
    rule : Arrival
        When one has arrived.
    s : Progress
        State.
    sample : Sample
        What the stage shows.

    Returns
    -------
    progress : Progress
        New state.
    target : Target
        The set point with its derivatives.
    """
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
