"""Runs a programme on a live stage, or on several that are coordinated, and straight lines."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from macromicro.control.arrival import TICK
from macromicro.control.live import alone, brake, following
from macromicro.control.live import messages as m
from macromicro.control.live import transitions as t
from macromicro.control.live.guided import has_reached, slow_down, slow_limits
from macromicro.control.live.leading import (
    REST,
    Aim,
    Guide,
    Guided,
    Period,
    Piece,
    Step,
    lead,
    to_rest,
)
from macromicro.control.live.messages import Evidence, Notice, Refused
from macromicro.control.live.parameters import LiveParameters
from macromicro.control.live.state import NAN, NOWHERE, LiveState, Motion, Played, Targets
from macromicro.control.stage_law import Sample, Target
from macromicro.machines import sequence
from macromicro.machines.sequence import DONE, MOVING, Arrival, Plan, Progress, begin
from macromicro.machines.stage import Loop
from macromicro.place import LENGTH, Place

Follow = Callable[[Plan, Arrival, Progress, Sample], tuple[Progress, Target]]


def motion(s: LiveState, plan: Any, pitch: float, unit: Place = LENGTH) -> Motion | Refused:
    """A programme as a motion within the soft limits."""
    if not isinstance(plan, Plan) or not len(plan.target):
        return Refused("no programme is loaded", "load one first")
    low, high = s.limits.macro_low * pitch, s.limits.macro_high * pitch
    places = np.concatenate(([plan.origin], plan.target, plan.pieces[:, 1]))
    for place in (float(places.min()), float(places.max())):
        if not low - pitch <= place <= high + pitch:
            return Refused(
                f"the programme goes to {place * unit.per:.9g} {unit.unit}, beyond the soft limits",
                f"stay within {low * unit.per:.9g} to {high * unit.per:.9g} {unit.unit}",
                True,
            )
    return Motion(s.given + 1, "programme", NAN, NAN, NAN, s.time)


def start(s: LiveState, motion: Motion, plan: Plan) -> tuple[LiveState, tuple[Notice, ...]]:
    """Begin the move to the programme's start."""
    work = Played(plan, sequence.begin(), NAN, None)
    s = s._replace(motion=motion, work=work, target=NOWHERE)
    s, event = t.go(s, m.MOVING_MACRO, t.PROGRAMME, {"moves": len(plan.target)})
    return s, (event,)


def step(now: Period, s: LiveState, g: Guided, follow: Follow = sequence.step) -> Step:
    p, q, place, dt = now
    work, offset = s.work, s.frame.offset * p.settings.pitch
    assert isinstance(work, Played)
    if math.isnan(work.start):
        return _approach(now, s, g)
    plan, before = work.plan, work.progress
    local = Sample(s.time - work.start, place - offset)
    progress, target = follow(plan, Arrival(*q.arrival), before, local)
    aim = _aim(plan, progress, target, local.t, offset)
    g = g._replace(aim=aim, later=_later(plan, progress, local.t, offset, dt))
    unit = p.settings.place
    found: Evidence = {
        "move": before.move,
        f"error_{unit.fine}": (g.aim.position - place) * unit.fines,
    }
    notices: tuple[Notice, ...] = ()
    if before.phase == MOVING and not progress.arrived and _has_ended(before, progress):
        if math.isnan(plan.start[before.move]):
            return to_rest(p, s, g, m.STALLED, t.STALLED, found)
        work = work._replace(cut_off=work.cut_off or found)
        notices = (t.report(s, "move", "cut off", found),)
    work = work._replace(progress=progress)
    s = s._replace(work=work)
    if progress.phase == DONE:
        s, ends = _end(p, s, work, place - offset)
        return s, g._replace(aim=REST._replace(position=g.aim.position)), (*notices, *ends)
    if progress.move != before.move:
        if s.mode == m.SETTLING:
            s, event = t.go(s, m.MOVING_MACRO, t.NEXT_MOVE, {"move": progress.move})
            notices = (*notices, event)
        there = float(plan.target[progress.move]) * unit.per
        goal = {"move": progress.move, f"target_{unit.unit}": there}
        notices = (*notices, t.report(s, "move", "next move", goal))
    if progress.arrived and s.mode == m.MOVING_MACRO:
        s, event = t.go(s, m.SETTLING, t.ARRIVED, found)
        notices = (*notices, event)
    return s, g, notices


def _approach(now: Period, s: LiveState, g: Guided) -> Step:
    """One period of the move to the programme's start."""
    p, q, place, dt = now
    work, motion = s.work, s.motion
    assert isinstance(work, Played) and motion is not None
    goal = work.plan.origin + s.frame.offset * p.settings.pitch
    g, late = lead(slow_limits(q, g), g, motion.id, goal, s.time, dt)
    if late < 0.0:
        return s, g, ()
    g, there = has_reached(q, g, goal, place, s.time)
    if there:
        return s._replace(work=work._replace(start=s.time + dt)), g, ()
    if late >= q.arrival.patience - TICK:
        unit = p.settings.place
        found = {"move": -1, f"error_{unit.fine}": (goal - place) * unit.fines}
        return to_rest(p, s, g, m.STALLED, t.STALLED, found)
    return s, g, ()


def _has_ended(before: Progress, progress: Progress) -> bool:
    """Whether the move that was under way is over."""
    return progress.phase != MOVING or progress.move != before.move


def _aim(plan: Plan, progress: Progress, target: Target, now: float, offset: float) -> Aim:
    """The set point with the jerk of its profile."""
    jerk = 0.0
    if progress.phase == MOVING and now - progress.began < plan.length[progress.move] - TICK:
        jerk = float(plan.pieces[progress.piece, 4])
    position, velocity, acceleration = (float(x) for x in target[:3])
    return Aim(position + offset, velocity, acceleration, jerk)


def _later(
    plan: Plan, progress: Progress, now: float, offset: float, dt: float
) -> tuple[Piece, ...]:
    """The pieces of its profile, and its end, that the coming period reaches."""
    if progress.phase != MOVING:
        return ()
    since = now - progress.began
    last = sequence.piece_at(plan, progress, now + dt)
    rows = plan.pieces[progress.piece + 1 : last + 1].tolist()
    rows.append([plan.length[progress.move], plan.target[progress.move], 0.0, 0.0, 0.0])
    return tuple(
        (begin - since, Aim(place + offset, *rates))
        for begin, place, *rates in rows
        if TICK < begin - since < dt - TICK
    )


def _end(
    p: LiveParameters, s: LiveState, work: Played, place: float
) -> tuple[LiveState, tuple[Notice, ...]]:
    """Finish the plan: complete, and the stage on target or not."""
    plan, move = work.plan, work.progress.move
    left, off = len(plan.target) - move - 1, float(plan.target[move]) - place
    unit = p.settings.place
    found: Evidence = {"moves": move + 1, f"error_{unit.fine}": off * unit.fines}
    if lacks := following.lacking(left, work.cut_off):
        return brake.start(p, s, m.STALLED, t.STALLED, found | lacks)
    whole = float(plan.target[move])
    s = s._replace(target=Targets(whole, alone.nearest(whole, p.settings.pitch)))
    return t.conclude(p, s, m.READY, (m.DONE, t.PROGRAMME_DONE), found)


Point = Sequence[float]
_LEAST = 0.25  # of the acceleration is always left for a stop: a path may use all of it


def _target_at(plan: Plan, progress: Progress, time: float) -> Target:
    """The set point at any time of the present move."""
    piece = sequence.piece_at(plan, progress, time)
    return sequence.aim(plan, progress._replace(piece=piece), time)


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
    found = [_target_at(plan, progress, s.time) for plan in plans]
    r = s.rate
    moving = [
        (abs(q.velocity), math.copysign(q.acceleration, q.velocity * q.acceleration), a)
        for q, a in zip(found, most, strict=True)
        if q.velocity != 0.0
    ]
    if not moving:
        rests = tuple(REST._replace(position=q.position) for q in found)
        return s._replace(rate=0.0, aims=rests)
    # |q'' r^2 - q' fall| at most a, of each stage; `bent` is q'' as it quickens the axis.
    fall = min(max(a + bent * r * r, _LEAST * a) / speed for speed, bent, a in moving)
    fall = min(fall, r / dt)
    aims = tuple(
        Aim(q.position, q.velocity * r, q.acceleration * r * r - q.velocity * fall, 0.0)
        for q in found
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
        self.places: Point = ()  # of all stages, before each period
        self._outside = (math.nan,) * len(trees)  # no stage is within its tolerance
        self._targets: tuple[Target, ...] | None = None
        self._step = sequence.together(len(trees))
        # Of a programme, from its start on.
        self._plans: tuple[Plan, ...]
        self._offsets: Point
        self._progress: Progress
        self._inside: Point

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
        self._slowing = Slowing(self._now + dt, 1.0, math.nan, ())

    def free(self) -> None:
        """Let each stage brake by itself."""
        self._slowing = None

    def brake(self, axis: int, now: Period, s: LiveState, g: Guided) -> Step:
        """`guided.slow_down` of one stage, on the path if all follow one."""
        slowing = self._slowing
        if slowing is None:
            return slow_down(now, s, g)
        if s.time != slowing.at:  # once for all
            slowing = slower(self._plans, self._progress, slowing, self._most, now.dt)
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

        return step(now, s, g, follow)

    def _follow(self, now: float) -> None:
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
