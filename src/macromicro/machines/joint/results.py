"""Results of two-axis moves, from recording and paths."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.machines import results
from macromicro.machines.joint import contour
from macromicro.machines.joint.planning import JointPlan
from macromicro.machines.joint.settings import AXES, of
from macromicro.machines.results import MoveResult
from macromicro.machines.sequence import HOLDING
from macromicro.recording import Recording
from macromicro.runs.arrivals import Rest


class Beside(NamedTuple):
    """Contour error while the profile lasts; mm."""

    # rms, peak: of the places that the encoders show
    rms: float
    peak: float
    true_rms: float  # of the true places in the plane
    true_peak: float  # NaN on a rig, which does not know them


class JointMove(NamedTuple):
    """One move; mm. None: unknown."""

    move: int
    name: str  # line, arc, path or trajectory
    target: tuple[float, float]
    way: float  # length of the path
    start_s: float
    profile_s: float  # duration of its profile, s
    arrived_s: float | None  # from its begin until both axes stay within their tolerances, s
    contour: Beside | None  # distance from the path; None for a move that stays where it is
    axes: tuple[MoveResult, MoveResult]
    true_error: float | None  # distance of the true place from the target at rest
    complete: bool  # whether its hold began


def alone(recording: Recording, name: str) -> Recording:
    """One axis of a recording, as that of a single-stage machine."""
    letters = tuple(f"{each}_" for each in AXES)
    kept = [
        c
        for c in recording.columns
        if c.name.startswith(f"{name}_")
        or (not c.name.startswith(letters) and not c.name.startswith("true_"))
    ]
    columns = [c._replace(name=c.name.removeprefix(f"{name}_")) for c in kept]
    values = [recording[c.name] for c in kept]
    return Recording.from_arrays(columns, values, recording.dt, recording.attributes)


def moves(recording: Recording, plan: JointPlan, settings: Any) -> list[JointMove]:
    if not len(recording):
        return []
    each = [
        results.moves(alone(recording, name), own_plan, own.arrival)
        for name, own_plan, own in zip(AXES, plan.plans, of(settings), strict=True)
    ]
    return [_move(recording, plan, pair) for pair in zip(*each, strict=True)]


def rests(those: Iterable[JointMove]) -> list[Rest]:
    """How moves ended, for a verdict."""
    found = []
    for m in those:
        errors = [one.rest_error for one in m.axes if one.rest_error is not None]
        away = 1e-3 * math.hypot(*errors) if len(errors) == len(m.axes) else None
        found.append(Rest(m.move + 1, m.arrived_s is not None, m.complete, away))
    return found


def rows(recording: Recording, move: int) -> slice:
    found = np.flatnonzero(recording["move"] == move)
    return slice(int(found[0]), int(found[-1]) + 1) if len(found) else slice(0, 0)


def under_way(recording: Recording, plan: JointPlan, move: int) -> slice:
    own = rows(recording, move)
    t = recording["t"][own]
    n = int(np.sum(t - t[0] < plan.plans[0].length[move] - 1e-9)) if len(t) else 0
    return slice(own.start, min(own.start + max(n, 1), own.stop))


def _distance(recording: Recording, names: tuple[str, str], part: slice, trace: Any) -> Array:
    """Contour error, mm; a missing reading repeats the last one."""
    columns = [recording[name][part] for name in names]
    if any(np.isnan(column).all() for column in columns):
        return np.full(len(columns[0]), np.nan)
    places = [known(column) * 1e-3 for column in columns]
    return contour.off(trace, *places).distance * 1e3


def known(values: Array) -> Array:
    """A column with gaps filled by the last reading."""
    good = ~np.isnan(values)
    if good.all() or not good.any():
        return np.nan_to_num(values)
    last = np.maximum.accumulate(np.where(good, np.arange(len(values)), 0))
    filled: Array = np.nan_to_num(values[last])
    return filled


def _move(recording: Recording, plan: JointPlan, pair: tuple[MoveResult, MoveResult]) -> JointMove:
    k, first = pair[0].move, pair[0]
    leg, trace = plan.legs[k], plan.traces[k]
    found = None
    if trace.pieces:
        part = under_way(recording, plan, k)
        read = _distance(recording, ("x_position", "y_position"), part, trace)
        true = _distance(recording, ("true_x", "true_y"), part, trace)
        rms = [float(np.sqrt(np.mean(d * d))) for d in (read, true)]
        found = Beside(rms[0], float(read.max()), rms[1], float(true.max()))
    part = rows(recording, k)
    rest = recording["t"][part] > recording["t"][part][-1] - results.REST
    rest &= recording["phase"][part] == HOLDING
    away = None
    if rest.any():
        here = [float(np.mean(recording[name][part][rest])) for name in ("true_x", "true_y")]
        far = float(np.hypot(here[0] - 1e3 * leg.end[0], here[1] - 1e3 * leg.end[1]))
        away = None if np.isnan(far) else far
    times = [m.arrived_s for m in pair if m.arrived_s is not None]
    return JointMove(
        move=k,
        name=leg.name,
        target=(1e3 * leg.end[0], 1e3 * leg.end[1]),
        way=1e3 * float(trace.border[-1]),
        start_s=first.start_s,
        profile_s=first.profile_s,
        arrived_s=max(times) if len(times) == len(pair) else None,
        contour=found,
        axes=pair,
        true_error=away,
        complete=first.complete,
    )
