"""Results of moves, from the recording."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.machines import composite, planning
from macromicro.machines.composite import AnyMachine
from macromicro.machines.joint import contour
from macromicro.machines.moves import Move
from macromicro.machines.planning import Planned, Schedule
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


class Contour(NamedTuple):
    """Distance from the path while the profile lasts; mm."""

    # rms, peak: of the positions that the encoders show
    rms: float
    peak: float
    true_rms: float  # of the true positions in the plane
    true_peak: float  # NaN on a rig, which does not know them


class JointMove(NamedTuple):
    """One move of several stages; mm or deg. None: unknown."""

    move: int
    name: str  # line, arc, path or trajectory
    target: tuple[float, ...]
    way: float  # length of the path
    start_s: float
    profile_s: float  # duration of its profile, s
    arrived_s: float | None  # from its begin until all stages stay within their tolerances, s
    contour: Contour | None  # distance from the path; None for a move that stays where it is
    axes: tuple[MoveResult, ...]
    true_error: float | None  # distance of the true position from the target at rest
    complete: bool  # whether its hold began


def of(machine: AnyMachine, recording: Recording, planned: Planned, settings: Any) -> list[Any]:
    """A `MoveResult` a move of a machine of one stage, a `JointMove` of one of several."""
    trees, plans = machine.trees(settings), planning.each(planned)
    places = composite.places(machine)
    if isinstance(planned, Plan):
        return moves(recording, planned, settings.arrival, places[0])
    if not len(recording):
        return []
    names = composite.names(machine)
    stages = [
        moves(alone(recording, names, name), plan, own.arrival, place)
        for name, plan, own, place in zip(names, plans, trees, places, strict=True)
    ]
    return [_joint(recording, planned, each) for each in zip(*stages, strict=True)]


def planned_moves(machine: AnyMachine, recording: Recording) -> Planned:
    """The moves of a recording as its set points show them."""
    t, index = recording["t"], recording["move"]
    count = int(np.max(index, initial=-1)) + 1
    spans = [np.flatnonzero(index == k) for k in range(count)]
    names = [f"{name}_target" if name else "target" for name in composite.names(machine)]
    targets = [
        recording[column] / one.kind.place.per
        for column, (_, one) in zip(names, machine.stages, strict=True)
    ]
    under_way = [
        max(int(np.sum(np.cumsum(own[span][::-1] != own[span][-1]) > 0)) for own in targets)
        for span in spans
    ]
    length = np.array([t[span[n]] - t[span[0]] for span, n in zip(spans, under_way, strict=True)])
    plans = tuple(
        Plan(
            start=np.full(count, math.nan),
            target=np.array([own[span[-1]] for span in spans]),
            hold=np.zeros(count),
            length=length,
            first=np.zeros(count + 1, np.int64),
            pieces=np.empty((0, 5)),
            origin=float(own[0]) if len(own) else 0.0,
            end=math.nan,
        )
        for own in targets
    )
    if len(plans) == 1:
        return plans[0]
    ends = zip(*(plan.target.tolist() for plan in plans), strict=True)
    return Schedule(plans, tuple(Move("move", end, 0.0) for end in ends))


def alone(recording: Recording, names: tuple[str, ...], name: str) -> Recording:
    """One stage of a recording, as that of a single-stage machine."""
    starts = tuple(f"{each}_" for each in names)
    kept = [
        c
        for c in recording.columns
        if c.name.startswith(f"{name}_")
        or (not c.name.startswith(starts) and not c.name.startswith("true_"))
    ]
    columns = [c._replace(name=c.name.removeprefix(f"{name}_")) for c in kept]
    values = [recording[c.name] for c in kept]
    return Recording.from_arrays(columns, values, recording.dt, recording.attributes)


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


def count_arrived(those: Iterable[Any]) -> int:
    """Number of moves that arrived."""
    return sum(m.arrived_s is not None for m in those)


def rests(those: Iterable[Any], places: Sequence[Place]) -> list[Rest]:
    """How moves ended, for a verdict; `places` are the units of the stages."""
    return [Rest(m.move + 1, m.arrived_s is not None, m.complete, _away(m, places)) for m in those]


def _away(m: Any, places: Sequence[Place]) -> float | None:
    """Distance from the target at rest, by the readings, in m or rad; None: lengths and angles."""
    stages = (m,) if isinstance(m, MoveResult) else m.axes
    errors = [one.rest_error for one in stages if one.rest_error is not None]
    if len(errors) < len(stages) or len(set(places)) > 1:
        return None
    return math.hypot(*errors) / places[0].per


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


def rows(recording: Recording, move: int) -> slice:
    """The rows of a move."""
    found = np.flatnonzero(recording["move"] == move)
    return slice(int(found[0]), int(found[-1]) + 1) if len(found) else slice(0, 0)


def under_way(recording: Recording, planned: Planned, move: int) -> slice:
    """The rows of a move while its profile lasts."""
    own = rows(recording, move)
    t = recording["t"][own]
    length = planning.each(planned)[0].length[move]
    n = int(np.sum(t - t[0] < length - 1e-9)) if len(t) else 0
    return slice(own.start, min(own.start + max(n, 1), own.stop))


def fill_gaps(values: Array) -> Array:
    """A column with gaps filled by the last reading."""
    good = ~np.isnan(values)
    if good.all() or not good.any():
        return np.nan_to_num(values)
    last = np.maximum.accumulate(np.where(good, np.arange(len(values)), 0))
    filled: Array = np.nan_to_num(values[last])
    return filled


def _distance(recording: Recording, names: tuple[str, str], part: slice, trace: Any) -> Array:
    """Contour error, mm; a missing reading repeats the last one."""
    columns = [recording[name][part] for name in names if name in recording]
    if len(columns) < len(names) or any(np.isnan(column).all() for column in columns):
        return np.full(part.stop - part.start, np.nan)
    places = [fill_gaps(column) * 1e-3 for column in columns]
    return contour.contour_error(trace, *places).distance * 1e3


def _contour(recording: Recording, planned: Schedule, move: int) -> Contour | None:
    if not planned.traces or not planned.traces[move].pieces:
        return None
    part, trace = under_way(recording, planned, move), planned.traces[move]
    read = _distance(recording, ("x_position", "y_position"), part, trace)
    true = _distance(recording, ("true_x", "true_y"), part, trace)
    rms = [float(np.sqrt(np.mean(d * d))) for d in (read, true)]
    return Contour(rms[0], float(read.max()), rms[1], float(true.max()))


def _true_error(recording: Recording, planned: Schedule, move: int) -> float | None:
    part = rows(recording, move)
    rest = recording["t"][part] > recording["t"][part][-1] - REST
    rest &= recording["phase"][part] == HOLDING
    if "true_x" not in recording or not rest.any():
        return None
    end = planned.legs[move].end
    here = [float(np.mean(recording[name][part][rest])) for name in ("true_x", "true_y")]
    far = float(np.hypot(here[0] - 1e3 * end[0], here[1] - 1e3 * end[1]))
    return None if np.isnan(far) else far


def _joint(recording: Recording, planned: Schedule, stages: tuple[MoveResult, ...]) -> JointMove:
    k, first = stages[0].move, stages[0]
    times = [m.arrived_s for m in stages if m.arrived_s is not None]
    return JointMove(
        move=k,
        name=planned.legs[k].name,
        target=tuple(m.target for m in stages),
        way=1e3 * float(planned.traces[k].border[-1]) if planned.traces else 0.0,
        start_s=first.start_s,
        profile_s=first.profile_s,
        arrived_s=max(times) if len(times) == len(stages) else None,
        contour=_contour(recording, planned, k),
        axes=stages,
        true_error=_true_error(recording, planned, k),
        complete=first.complete,
    )
