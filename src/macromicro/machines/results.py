"""Results of single-stage moves, from the recording."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from macromicro.machines.sequence import HOLDING, MOVING, Arrival, Plan
from macromicro.place import LENGTH, Place
from macromicro.recording import Recording
from macromicro.runs.arrivals import Rest

REMEDY = (
    "Try a longer arrival.patience, a wider arrival.tolerance, or gains for this machine "
    "(macromicro tune)."
)
REST = 0.1  # s; the last of a hold, over which the error at rest is meant


class MoveResult(NamedTuple):
    """One move; mm or deg. None: unknown."""

    move: int
    target: float
    start_s: float
    profile_s: float  # duration of its profile, s
    arrived_s: float | None  # from its begin until the reading stays within the tolerance, s
    peak_error: float  # greatest distance from the set point while the profile lasts
    true_peak_error: float | None  # the same of the true position
    rms_error: float  # RMS of the peak's distance
    overshoot: float | None  # farthest beyond the target after the profile's end, in its direction
    rest_error: float | None  # target less reading, mean over the last 0.1 s of the hold
    true_error: float | None  # the same of the true position
    complete: bool  # whether its hold began


def moves(
    recording: Recording, plan: Plan, rule: Arrival, place: Place = LENGTH
) -> list[MoveResult]:
    index = recording["move"]
    found = []
    for k in range(len(plan.target)):
        rows = np.flatnonzero(index == k)
        if len(rows):
            span = slice(rows[0], rows[-1] + 1)
            found.append(_move(recording, plan, rule, k, span, place.per))
    return found


def arrived(those: Iterable[Any]) -> int:
    """Number of moves that arrived."""
    return sum(m.arrived_s is not None for m in those)


def rests(those: Iterable[MoveResult], place: Place = LENGTH) -> list[Rest]:
    """How moves ended, for a verdict."""
    return [
        Rest(
            m.move + 1,
            m.arrived_s is not None,
            m.complete,
            None if m.rest_error is None else abs(m.rest_error) / place.per,
        )
        for m in those
    ]


def settling(those: Iterable[Any]) -> list[float]:
    """Settling time of each move after the end of its profile."""
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
    after = ~under_way & np.isin(phase, (MOVING, HOLDING))
    holding = phase == HOLDING
    there = np.flatnonzero(arrived == 1)
    rest = holding & (t > t[-1] - REST)
    true = recording["true_position"][rows] if "true_position" in recording else None
    if true is not None and np.isnan(true).all():
        true = None
    first = under_way if np.any(under_way) else slice(0, 1)
    moving = error[first]
    return MoveResult(
        move=k,
        target=float(target),
        start_s=float(t[0]),
        profile_s=float(plan.length[k]),
        arrived_s=float(t[there[0]] - rule.dwell - t[0]) if len(there) else None,
        peak_error=float(np.nanmax(np.abs(moving))),
        true_peak_error=None
        if true is None
        else float(np.nanmax(np.abs(set_point[first] - true[first]))),
        rms_error=float(np.sqrt(np.nanmean(moving**2))),
        overshoot=max(float(np.nanmax(way * (place[after] - target))), 0.0)
        if np.any(after) and way
        else None,
        rest_error=float(np.nanmean(error[rest])) if np.any(rest) else None,
        true_error=None
        if true is None or not np.any(rest)
        else float(np.nanmean(target - true[rest])),
        complete=bool(np.any(holding)),
    )
