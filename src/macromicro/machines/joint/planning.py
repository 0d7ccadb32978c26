"""Plans a programme of two axes: one profile along the path within all limits."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.machines import planning
from macromicro.machines.joint.course import Leg
from macromicro.machines.joint.settings import AXES, of
from macromicro.machines.moves import Course
from macromicro.machines.planning import Schedule, Way
from macromicro.motion.feed import Limits, feed
from macromicro.motion.path import MEET, Piece, line
from macromicro.motion.profile import Segment
from macromicro.schema.text import printable
from macromicro.units import shown

CENTRAL, FORWARD = 0.8, 0.6  # shares of the acceleration in an arc: to its centre, along it
TURN = 0.02  # rad; an arc is cut into cubics of at most so much
STEP = 1e-3  # s; and of at most so much while the speed changes
FINE = 4  # pieces of a trajectory for each control period


class Trace(NamedTuple):
    """The path of one move."""

    pieces: tuple[Piece, ...]  # of the path; none where it stays
    border: Array  # way at the beginning of each piece, and at the end, m
    s: Array  # way of the set point at each control period since the move's begin, m


def limits(piece: Piece, tree: Any, speed: float = math.inf) -> Limits:
    """Limits of axes and path along a piece."""
    x, y = (each.motion for each in of(tree))
    path = tree.path
    if piece.curvature == 0.0:
        shares = [(m, abs(u)) for m, u in ((x, piece.ux), (y, piece.uy)) if u != 0.0]
        return Limits(
            min(speed, path.speed, *(m.velocity / u for m, u in shares)),
            min(path.acceleration, *(m.acceleration / u for m, u in shares)),
            min(m.jerk / u for m, u in shares),
        )
    radius = 1.0 / abs(piece.curvature)
    most = min(path.acceleration, x.acceleration, y.acceleration)
    jerk = min(x.jerk, y.jerk)
    central = math.sqrt(CENTRAL * most * radius)
    swept = math.cbrt(CENTRAL * jerk * radius * radius)  # the centre's direction turns: v^3/r^2
    fastest = min(speed, path.speed, x.velocity, y.velocity, central, swept)
    return Limits(fastest, FORWARD * most, FORWARD * jerk)


def plan(course: Course, tree: Any, *, step: float | None = None) -> Schedule:
    """Moves and their profiles, from (0, 0) on."""
    where = printable(course.source, 300)
    ways: tuple[list[Way], list[Way]] = ([], [])
    traces = []
    for number, leg in enumerate(course.legs, 1):
        _check_travel(leg, tree, f"{where}, move {number}")
    for leg in course.legs:
        made, trace = _leg(leg, tree, step or min(STEP, tree.x.timing.period))
        for each, pieces, end in zip(ways, made, leg.end, strict=True):
            each.append(Way(math.nan, end, leg.hold, pieces))
        traces.append(trace)
    for name, each, own in zip(AXES, ways, of(tree), strict=True):
        planning.check(each, own, f"{where}, {name}")
    first, second = (planning.join(each, math.nan) for each in ways)
    return Schedule((first, second), course.legs, tuple(traces))


def _check_travel(leg: Leg, tree: Any, where: str) -> None:
    boxes = [piece.extent for piece in leg.pieces]
    if leg.times.size:
        boxes = [tuple(f(leg.times[k]) for k in (1, 2) for f in (np.min, np.max))]
    for k, (name, own) in enumerate(zip(AXES, of(tree), strict=True)):
        low, high = own.travel.low, own.travel.high
        for box in boxes:
            for value in (box[2 * k], box[2 * k + 1]):
                if not low - MEET <= value <= high + MEET:
                    accepted = (
                        f"{shown(low, 'm', 'mm', 6)} to {shown(high, 'm', 'mm', 6)} ({name}.travel)"
                    )
                    raise InputError(f"{where}, {name}", shown(value, "m", "mm", 6), accepted)


def _leg(leg: Leg, tree: Any, step: float) -> tuple[tuple[Array, Array], Trace]:
    """Profile pieces of both axes, and the path."""
    dt = tree.x.timing.period
    if leg.times.size:
        return _splines(leg, dt)
    if not leg.pieces:
        nothing = np.empty((0, 5))
        return (nothing, nothing), Trace((), np.zeros(1), np.zeros(1))
    most = [limits(p, tree, v) for p, v in zip(leg.pieces, leg.speeds, strict=True)]
    lengths = [piece.length for piece in leg.pieces]
    runs = feed(lengths, most)
    rows = [
        row
        for piece, run in zip(leg.pieces, runs, strict=True)
        for segment in run
        for row in _cubics(piece, segment, step)
    ]
    both = np.array(rows)
    border = np.concatenate(([0.0], np.cumsum(lengths)))
    s = _ways(runs, border, dt)
    return (both[:, (0, 1, 2, 3, 4)], both[:, (0, 5, 6, 7, 8)]), Trace(leg.pieces, border, s)


def _cubics(piece: Piece, segment: Segment, step: float) -> Iterator[tuple[float, ...]]:
    """A segment as cubics of both axes: duration, then x and y with derivatives."""
    h, s, v, a, j = segment
    if piece.curvature == 0.0:
        x, y = (float(p) for p in piece.at(s))
        yield (
            h, x, piece.ux * v, piece.ux * a, piece.ux * j, y, piece.uy * v, piece.uy * a,
            piece.uy * j,
        )  # fmt: skip
        return
    turned = abs(piece.curvature) * h * max(v, v + h * (a + 0.5 * h * j))
    n = math.ceil(max(turned / TURN, 0.0 if a == j == 0.0 else h / step, 1.0))
    t = np.linspace(0.0, h, n + 1)
    along, speed = s + t * (v + t * (0.5 * a + t * j / 6.0)), v + t * (a + 0.5 * t * j)
    columns = []
    for place, u in zip(piece.at(along), piece.direction(along), strict=True):
        columns.append(planning.hermite(h / n, place, speed * u))
    for k in range(n):
        yield (h / n, *(float(c[k]) for column in columns for c in column))


def _ways(runs: list[list[Segment]], border: Array, dt: float) -> Array:
    """Distance along the path each control period."""
    rows = np.array(
        [
            (s.duration, border[k] + s.position, s.velocity, s.acceleration, s.jerk)
            for k, run in enumerate(runs)
            for s in run
        ]
    )
    return _resample(rows, dt)


def _resample(rows: Array, dt: float) -> Array:
    begin = np.concatenate(([0.0], np.cumsum(rows[:, 0])))
    t = np.arange(math.ceil(begin[-1] / dt) + 1) * dt
    k = np.clip(np.searchsorted(begin, t, side="right") - 1, 0, len(rows) - 1)
    h = np.minimum(t - begin[k], rows[k, 0])
    p, v, a, j = rows[k, 1:].T
    found: Array = p + h * (v + h * (0.5 * a + h * j / 6.0))
    return found


def _splines(leg: Leg, dt: float) -> tuple[tuple[Array, Array], Trace]:
    """A trajectory as splines, and its path as short straight pieces."""
    t, x, y = leg.times
    first, second = (planning.track(t, place).pieces for place in (x, y))
    fine = dt / FINE
    points = np.stack([_resample(each, fine) for each in (first, second)], axis=1)
    steps = np.hypot(*np.diff(points, axis=0).T)
    kept = np.concatenate(([True], steps > 0.0))
    corners = points[kept]
    ends = [(float(px), float(py)) for px, py in corners]
    pieces = tuple(line(a, b) for a, b in itertools.pairwise(ends))
    border = np.concatenate(([0.0], np.cumsum([p.length for p in pieces])))
    s = np.concatenate(([0.0], np.cumsum(steps)))[::FINE]
    return (first, second), Trace(pieces, border, s)
