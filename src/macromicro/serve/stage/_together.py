"""Coordination of several stages: straight lines and programmes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from macromicro.control.live.guided import slow_down
from macromicro.control.live.leading import REST, Aim, Guide, Guided, Period, Step
from macromicro.control.live.state import LiveState, Played
from macromicro.control.stage_law import Sample, Target
from macromicro.machines import sequence
from macromicro.machines.sequence import Arrival, Plan, Progress, begin
from macromicro.machines.stage import Loop
from macromicro.serve.stage import _playing

Point = Sequence[float]
_LEAST = 0.25  # of the acceleration is always left for a stop: a path may use all of it


def _aim(plan: Plan, progress: Progress, t: float) -> Target:
    """The set point at any time of the present move."""
    return sequence.aim(plan, progress._replace(piece=sequence.piece_at(plan, progress, t)), t)


class Slowing(NamedTuple):
    time: float  # of the programme's clock, s
    rate: float  # how fast that goes: 1 before the stop, 0 at rest
    at: float  # when this was so, s
    aims: tuple[Aim, ...]  # the set points of all stages there


def slower(
    plans: Sequence[Plan], progress: Progress, s: Slowing, most: Point, dt: float
) -> Slowing:
    """A stop along a path, one period later.

    The path runs on a clock t of falling rate r: the speed of q(t) is q' r, its acceleration
    q'' r^2 + q' r', with r' as negative as all stages allow.
    """
    found = [_aim(plan, progress, s.time) for plan in plans]
    r = s.rate
    moving = [
        (abs(t.velocity), math.copysign(t.acceleration, t.velocity * t.acceleration), a)
        for t, a in zip(found, most, strict=True)
        if t.velocity != 0.0
    ]
    if r <= 0.0 or not moving:
        rests = tuple(REST._replace(position=t.position) for t in found)
        return s._replace(rate=0.0, aims=rests)
    # |q'' r^2 - q' fall| at most a, of each stage; `bent` is q'' as it quickens the axis.
    fall = min(max(a + bent * r * r, _LEAST * a) / speed for speed, bent, a in moving)
    fall = min(fall, r / dt)
    aims = tuple(
        Aim(t.position, t.velocity * r, t.acceleration * r * r - t.velocity * fall, 0.0)
        for t in found
    )
    after = r - fall * dt
    return s._replace(time=s.time + 0.5 * dt * (r + after), rate=after, aims=aims)


class Together:
    """Lines and programmes of all stages, whose stops stay on the path.

    The next move begins once all have arrived.

    `speed` and `acceleration` are limits along the path of a machine that has a plane.
    """

    def __init__(
        self, trees: Sequence[Any], speed: float = math.inf, acceleration: float = math.inf
    ) -> None:
        self._arrivals = tuple(Arrival(*own.arrival) for own in trees)
        self._fastest, self._quickest = speed, acceleration
        self._most = tuple(min(own.motion.acceleration, acceleration) for own in trees)
        self._now = 0.0
        self._slowing: Slowing | None = None
        self.places: Point = (math.nan,) * len(trees)
        self._plans: tuple[Plan, ...] | None = None
        self._outside = (math.nan,) * len(trees)  # no stage is within its tolerance
        self._progress, self._inside = begin(), self._outside
        self._targets: tuple[Target, ...] | None = None
        self._offsets: Point = (0.0,) * len(trees)
        self._step = sequence.together(len(trees))

    def straight(
        self, guides: Sequence[Guide], here: Point, goal: Point, speeds: Point
    ) -> list[Guide]:
        """Guides of some stages on a straight line, synchronized within all limits."""
        length = math.dist(here, goal)
        if length == 0.0:
            return list(guides)
        shares = [abs(b - a) / length for a, b in zip(here, goal, strict=True)]
        moving = [each for each in zip(guides, shares, speeds, strict=True) if each[1] > 0.0]
        speed = min(self._fastest, *(min(g.velocity, v) / share for g, share, v in moving))
        acceleration = min(self._quickest, *(g.acceleration / share for g, share, _ in moving))
        jerk = min(g.jerk / share for g, share, _ in moving)
        return [
            guide._replace(
                velocity=share * speed, acceleration=share * acceleration, jerk=share * jerk
            )
            if share > 0.0
            else guide
            for guide, share in zip(guides, shares, strict=True)
        ]

    def start(self, plans: tuple[Plan, ...], offsets: Point) -> None:
        """Begin a programme; `offsets` are the encoders' readings at 0."""
        self._plans, self._offsets, self._slowing = plans, offsets, None
        self._progress, self._inside = begin(), self._outside

    def hold(self, dt: float) -> None:
        """Bring the programme to rest on its path from the next period on."""
        self._slowing = Slowing(self._now + dt, 1.0, math.nan, (REST,) * len(self._most))

    def free(self) -> None:
        """Let each stage brake by itself."""
        self._slowing = None

    def brake(self, axis: int, now: Period, s: LiveState, g: Guided) -> Step:
        """`guided.slow_down` of one stage, on the path if all follow one."""
        slowing, plans = self._slowing, self._plans
        if slowing is None or plans is None:
            return slow_down(now, s, g)
        if s.time != slowing.at:  # once for all
            slowing = slower(plans, self._progress, slowing, self._most, now.dt)
            self._slowing = slowing = slowing._replace(at=s.time)
        aim, over = slowing.aims[axis], all(each[1:] == REST[1:] for each in slowing.aims)
        aim = aim._replace(position=aim.position + self._offsets[axis])
        return slow_down(now, s, g, lambda q, g, dt: (g._replace(aim=aim), over))

    def step(self, axis: int, now: Period, s: LiveState, g: Guided) -> Step:
        """`playing.step` of one stage, the first one first."""
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

        return _playing.step(now, s, g, follow)

    def _follow(self, now: float) -> None:
        assert self._plans is not None
        self._now = now
        loops = tuple(
            Loop(None, None, arrival, plan)  # type: ignore[arg-type]
            for arrival, plan in zip(self._arrivals, self._plans, strict=True)
        )
        samples = tuple(
            Sample(now, place - offset)
            for place, offset in zip(self.places, self._offsets, strict=True)
        )
        self._progress, self._inside, self._targets = self._step(
            loops, self._progress, self._inside, samples
        )
