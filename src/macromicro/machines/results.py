"""How the moves of one stage went, from the recording alone."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from macromicro.machines.sequence import HOLDING, MOVING, Arrival, Plan
from macromicro.place import LENGTH, Place
from macromicro.recording import Recording

REST = 0.1  # s; the last of a hold, over which the error at rest is meant


class MoveResult(NamedTuple):
    """One move; places in mm, or deg of a stage that turns. None: cannot be known.

    Attributes
    ----------
    move : int
        Index.
    target : float
        Where to.
    start_s : float
        When it began, s.
    profile_s : float
        Duration of its profile, s.
    arrived_s : float | None
        From its begin until the reading stays within the tolerance, s.
    peak_error : float
        Greatest distance from the set point while the profile lasts.
    rms_error : float
        RMS of the same.
    overshoot : float | None
        Farthest beyond the target after the profile's end, in its direction.
    rest_error : float | None
        Target less reading, mean over the last 0.1 s of the hold.
    true_error : float | None
        The same of the true position.
    complete : bool
        Whether its hold began.
    """

    move: int
    target: float
    start_s: float
    profile_s: float
    arrived_s: float | None
    peak_error: float
    rms_error: float
    overshoot: float | None
    rest_error: float | None
    true_error: float | None
    complete: bool


def moves(
    recording: Recording, plan: Plan, rule: Arrival, place: Place = LENGTH
) -> list[MoveResult]:
    """How each move went.

    Parameters
    ----------
    recording : Recording
        Of a run of the plan.
    plan : Plan
        Its moves.
    rule : Arrival
        When one has arrived.
    place : Place, optional
        What the stage's places are counted in.

    Returns
    -------
    list[MoveResult]
        Those that began.
    """
    index = recording["move"]
    found = []
    for k in range(len(plan.target)):
        rows = np.flatnonzero(index == k)
        if len(rows):
            span = slice(rows[0], rows[-1] + 1)
            found.append(_move(recording, plan, rule, k, span, place.per))
    return found


def arrived(those: Iterable[Any]) -> int:
    """How many moves arrived.

    Parameters
    ----------
    those : Iterable[Any]
        As for `settling`.

    Returns
    -------
    int
        Of them.
    """
    return sum(m.arrived_s is not None for m in those)


def settling(those: Iterable[Any]) -> list[float]:
    """How long after the end of its profile each move arrived.

    Parameters
    ----------
    those : Iterable[Any]
        `MoveResult`, or moves of two axes in step.

    Returns
    -------
    list[float]
        s; below 0 where it arrived before, infinity where it did not.
    """
    return [math.inf if m.arrived_s is None else m.arrived_s - m.profile_s for m in those]


def _move(
    recording: Recording, plan: Plan, rule: Arrival, k: int, rows: slice, per: float
) -> MoveResult:
    t, place, set_point, arrived, phase = (
        recording[name][rows] for name in ("t", "position", "target", "arrived", "phase")
    )
    target = plan.target[k] * per
    origin = (plan.target[k - 1] if k else plan.origin) * per
    way = np.sign(target - origin)
    error = set_point - place
    under_way = t - t[0] < plan.length[k] - 1e-9
    moving = error[under_way] if np.any(under_way) else error[:1]
    after = ~under_way & np.isin(phase, (MOVING, HOLDING))
    holding = phase == HOLDING
    there = np.flatnonzero(arrived == 1)
    rest = holding & (t > t[-1] - REST)
    true = recording["true_position"][rows] if "true_position" in recording else None
    return MoveResult(
        move=k,
        target=float(target),
        start_s=float(t[0]),
        profile_s=float(plan.length[k]),
        arrived_s=float(t[there[0]] - rule.dwell - t[0]) if len(there) else None,
        peak_error=float(np.nanmax(np.abs(moving))),
        rms_error=float(np.sqrt(np.nanmean(moving**2))),
        overshoot=max(float(np.nanmax(way * (place[after] - target))), 0.0)
        if np.any(after) and way
        else None,
        rest_error=float(np.nanmean(error[rest])) if np.any(rest) else None,
        true_error=None
        if true is None or not np.any(rest) or np.isnan(true[rest]).all()
        else float(np.nanmean(target - true[rest])),
        complete=bool(np.any(holding)),
    )
