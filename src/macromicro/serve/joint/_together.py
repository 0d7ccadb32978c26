"""Coordination of both axes: straight lines and programmes."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from macromicro.control.live.guided import Step, slow_down
from macromicro.control.live.leading import REST, Aim, Guide, Guided
from macromicro.control.live.parameters import LiveParameters
from macromicro.control.live.state import LiveState, Played
from macromicro.control.stage_law import Sample, Target
from macromicro.machines import sequence
from macromicro.machines.joint import planning
from macromicro.machines.joint.settings import of
from macromicro.machines.sequence import Arrival, Plan, Progress, begin
from macromicro.machines.stage import Loop
from macromicro.motion.path import line
from macromicro.serve.stage import _playing

Point = tuple[float, float]
_LEAST = 0.25  # of the acceleration is always left for a stop: a path may use all of it


def straight(
    tree: Any,
    guides: tuple[Guide, Guide],
    here: Point,
    goal: Point,
    speeds: Point = (math.inf, math.inf),
) -> list[Guide]:
    """Guides of both axes on a straight line, synchronized within the limits of axes and path."""
    if here == goal:
        return list(guides)
    piece = line(here, goal)
    shares = abs(piece.ux), abs(piece.uy)
    own = min(v / share for v, share in zip(speeds, shares, strict=True) if share > 0.0)
    most = planning.limits(piece, tree, own)
    made = []
    for alone, share in zip(guides, shares, strict=True):
        if share == 0.0:
            made.append(alone)
            continue
        speed, acceleration, jerk = (share * each for each in most)
        made.append(alone._replace(velocity=speed, acceleration=acceleration, jerk=jerk))
    return made


_OUTSIDE = (math.nan, math.nan)  # neither axis is within its tolerance


def _aim(plan: Plan, progress: Progress, t: float) -> Target:
    """The set point at any time of the present move."""
    return sequence.aim(plan, progress._replace(piece=sequence.piece_at(plan, progress, t)), t)


class Slowing(NamedTuple):
    time: float  # of the programme's clock, s
    rate: float  # how fast that goes: 1 before the stop, 0 at rest
    at: float  # when this was so, s
    aims: tuple[Aim, Aim]  # the set points of both axes there


def slower(
    plans: tuple[Plan, Plan], progress: Progress, s: Slowing, most: Point, dt: float
) -> Slowing:
    """A stop along a path, one period later.

    The path runs on a clock t of falling rate r: the speed of q(t) is q' r, its acceleration
    q'' r^2 + q' r', with r' as negative as both axes allow.
    """
    found = [_aim(plan, progress, s.time) for plan in plans]
    r = s.rate
    moving = [
        (abs(t.velocity), math.copysign(t.acceleration, t.velocity * t.acceleration), a)
        for t, a in zip(found, most, strict=True)
        if t.velocity != 0.0
    ]
    if r <= 0.0 or not moving:
        first, second = (REST._replace(position=t.position) for t in found)
        return s._replace(rate=0.0, aims=(first, second))
    # |q'' r^2 - q' fall| at most a, of each axis; `bent` is q'' as it quickens the axis.
    fall = min(max(a + bent * r * r, _LEAST * a) / speed for speed, bent, a in moving)
    fall = min(fall, r / dt)
    first, second = (
        Aim(t.position, t.velocity * r, t.acceleration * r * r - t.velocity * fall, 0.0)
        for t in found
    )
    after = r - fall * dt
    return s._replace(time=s.time + 0.5 * dt * (r + after), rate=after, aims=(first, second))


class Together:
    """A programme of both axes: moves begin once both have arrived; stops stay on the path."""

    def __init__(self, tree: Any) -> None:
        self._arrivals = tuple(Arrival(*own.arrival) for own in of(tree))
        path = tree.path.acceleration
        first, second = (min(own.motion.acceleration, path) for own in of(tree))
        self._most: Point = (first, second)
        self._now = 0.0
        self._slowing: Slowing | None = None
        self.places: Point = (math.nan, math.nan)
        self._plans: tuple[Plan, Plan] | None = None
        self._progress, self._inside = begin(), _OUTSIDE
        self._targets: tuple[Target, Target] | None = None
        self._offsets = (0.0, 0.0)

    def start(self, plans: tuple[Plan, Plan], offsets: Point) -> None:
        """Begin a programme; `offsets` are the encoders' readings at 0."""
        self._plans, self._offsets, self._slowing = plans, offsets, None
        self._progress, self._inside = begin(), _OUTSIDE

    def hold(self, dt: float) -> None:
        """Bring the programme to rest on its path from the next period on."""
        self._slowing = Slowing(self._now + dt, 1.0, math.nan, (REST, REST))

    def free(self) -> None:
        """Let each axis brake by itself."""
        self._slowing = None

    def brake(
        self,
        axis: int,
        p: LiveParameters,
        q: Guide,
        s: LiveState,
        g: Guided,
        place: float,
        dt: float,
    ) -> Step:
        """`guided.slow_down` of one axis, on the path if both follow one."""
        slowing, plans = self._slowing, self._plans
        if slowing is None or plans is None:
            return slow_down(p, q, s, g, place, dt)
        if s.time != slowing.at:  # once for both
            slowing = slower(plans, self._progress, slowing, self._most, dt)
            self._slowing = slowing = slowing._replace(at=s.time)
        aim, over = slowing.aims[axis], all(each[1:] == REST[1:] for each in slowing.aims)
        aim = aim._replace(position=aim.position + self._offsets[axis])
        return slow_down(p, q, s, g, place, dt, lambda q, g, dt: (g._replace(aim=aim), over))

    def step(
        self,
        axis: int,
        p: LiveParameters,
        q: Guide,
        s: LiveState,
        g: Guided,
        place: float,
        dt: float,
    ) -> Step:
        """`playing.step` of one axis, the first one first."""
        work = s.work
        assert isinstance(work, Played)
        if math.isnan(work.start):
            s = s._replace(work=work._replace(start=s.time))

        def follow(
            plan: Plan, arrival: Arrival, progress: Progress, local: Sample
        ) -> tuple[Progress, Target]:
            if axis == 0:
                self._follow(local.t)
            assert self._targets is not None
            return self._progress, self._targets[axis]

        return _playing.step(p, q, s, g, place, dt, follow)

    def _follow(self, now: float) -> None:
        assert self._plans is not None
        self._now = now
        first, second = (
            Loop(None, None, arrival, plan)  # type: ignore[arg-type]
            for arrival, plan in zip(self._arrivals, self._plans, strict=True)
        )
        a, b = (
            Sample(now, place - offset)
            for place, offset in zip(self.places, self._offsets, strict=True)
        )
        self._progress, self._inside, self._targets = sequence.together(2)(
            (first, second), self._progress, self._inside, (a, b)
        )
