"""What both axes of a machine do together: straight lines, and programmes in step."""

from __future__ import annotations

import math
from typing import Any

from macromicro.control.live.guided import Step
from macromicro.control.live.leading import Guide, Guided
from macromicro.control.live.parameters import LiveParameters
from macromicro.control.live.state import LiveState, Played
from macromicro.control.stage_law import Sample, Target
from macromicro.machines.joint import loop, planning
from macromicro.machines.joint.loop import Joined
from macromicro.machines.joint.settings import of
from macromicro.machines.sequence import Arrival, Plan, Progress, begin
from macromicro.machines.stage import Loop
from macromicro.motion.path import line
from macromicro.serve.stage import playing

Point = tuple[float, float]


def straight(tree: Any, guides: tuple[Guide, Guide], here: Point, goal: Point) -> list[Guide]:
    """What leads each axis on a straight line from one point to another.

    Both have the profile of the path, within the limits of both axes and of the path, each by its
    share of the way: they begin together, arrive together, and brake on the line.

    Parameters
    ----------
    tree : Any
        Settings of the machine.
    guides : tuple[Guide, Guide]
        What leads each axis alone.
    here, goal : tuple[float, float]
        m.

    Returns
    -------
    list[Guide]
        Of an axis without a way, its own.
    """
    if here == goal:
        return list(guides)
    piece = line(here, goal)
    most = planning.limits(piece, tree)
    made = []
    for own, share in zip(guides, (abs(piece.ux), abs(piece.uy)), strict=True):
        if share == 0.0:
            made.append(own)
            continue
        speed, acceleration, jerk = (share * each for each in most)
        made.append(own._replace(velocity=speed, acceleration=acceleration, jerk=jerk))
    return made


class Together:
    """A programme of both axes: a move begins once both have arrived.

    `places`: where both stand in this period [m of the encoders' own frames], which whoever steps
    them sets before.
    """

    def __init__(self, tree: Any) -> None:
        self._arrivals = tuple(Arrival(*own.arrival) for own in of(tree))
        self.places: Point = (math.nan, math.nan)
        self._plans: tuple[Plan, Plan] | None = None
        self._joined = Joined(begin(), math.nan)
        self._targets: tuple[Target, Target] | None = None
        self._offsets = (0.0, 0.0)

    def start(self, plans: tuple[Plan, Plan], offsets: Point) -> None:
        """A programme begins; `offsets`: what the encoders read at 0 [m]."""
        self._plans, self._joined, self._offsets = plans, Joined(begin(), math.nan), offsets

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
        """`playing.step` of one axis; the first one is stepped first."""
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
            return self._joined.progress, self._targets[axis]

        return playing.step(p, q, s, g, place, dt, follow)

    def _follow(self, now: float) -> None:
        """One period of the sequence of both."""
        assert self._plans is not None
        first, second = (
            Loop(None, None, arrival, plan)  # type: ignore[arg-type]
            for arrival, plan in zip(self._arrivals, self._plans, strict=True)
        )
        a, b = (
            Sample(now, place - offset)
            for place, offset in zip(self.places, self._offsets, strict=True)
        )
        self._joined, one, two = loop.aims((first, second), self._joined, a, b)
        self._targets = one, two
