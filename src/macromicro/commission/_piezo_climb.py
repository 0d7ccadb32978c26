"""First motions of a piezo stage: gain at low effort, and the range."""

from __future__ import annotations

import math
from typing import NamedTuple

from macromicro.commission.courses import decaying
from macromicro.commission.procedure import Work

SLOW = 2.0  # s from one end of the range to the other
_WATCHED = 0.01  # of the range: the position must change by then
_FLAT = 0.1  # of what the gain lets expect; twice: an end
SWUNG = 12


class Gain(NamedTuple):
    sign: float  # 1, or -1 where a positive effort makes the reading fall
    gain: float  # m/V
    scatter: float  # standard deviation of single tries, m/V
    noise: float  # standard deviation of the reading, m


class Reach(NamedTuple):
    # lowest, highest: efforts that still move it, V
    lowest: float
    highest: float
    # low, high: where they take it from where it comes to rest at 0 V, m
    low: float
    high: float
    # ends of the range at which no more effort was left (0), the window ended (1), or it moved no
    # more (2); the low one first
    ended: tuple[float, ...]

    @property
    def extent(self) -> float:
        return self.highest - self.lowest


class Climb:
    """Effort up to an end of the range, down to the other, then decaying to 0."""

    def __init__(self, work: Work, gain: float) -> None:
        o, dt = work.options, work.stand.dt
        self.bounds = {1.0: o.effort, -1.0: o.bottom}
        self.window = {1.0: o.high, -1.0: o.low}
        self.reached: dict[float, tuple[float, float, float]] = {}
        extent = o.effort - o.bottom
        self.rise, self.watch = extent * dt / SLOW, _WATCHED * extent
        self.flat = _FLAT * abs(gain) * self.watch
        self.way, self.effort, self.still = 1.0, 0.0, 0
        self.mark, self.begun = (0.0, math.nan), True
        self.corners: list[float] = []

    def __call__(self, t: float, x: float, v: float) -> float | None:
        """Effort of this period; None at rest at 0."""
        if len(self.reached) == 2:
            return self._home()
        why = self._ended(x)
        if why is None:
            bound, step = self.bounds[self.way], self.way * self.rise
            near = self.way * (bound - self.effort) <= 1.001 * self.rise
            self.effort = bound if near else self.effort + step
            return self.effort
        self.reached[self.way] = (self.effort, x, why)
        self.way, self.still, self.mark = -self.way, 0, (self.effort, math.nan)
        self.begun = False
        if len(self.reached) == 2:
            amplitude = min(self.reached[1.0][0], -self.reached[-1.0][0])
            self.corners = [*decaying(0.0, -0.9 * amplitude, SWUNG)[1:], 0.0]
        return self.effort

    def _ended(self, x: float) -> float | None:
        """Reason to turn, as in `Reach.ended`, or None."""
        place, beyond = self.window[self.way], self.way * (self.bounds[self.way] - self.effort)
        if beyond <= 0.0:
            return 0.0
        if place is not None and self.way * (x - place) >= 0.0:
            return 1.0
        if math.isnan(self.mark[1]):
            self.mark = (self.effort, x)
        elif abs(self.effort - self.mark[0]) >= self.watch:
            slow = abs(x - self.mark[1]) < self.flat
            # Off a stop that it was pressed on it moves after a while only.
            self.begun = self.begun or not slow
            self.still = self.still + 1 if slow and self.begun else 0
            self.mark = (self.effort, x)
        return 2.0 if self.still >= 2 else None

    def _home(self) -> float | None:
        """Through the corners, in equal times."""
        if not self.corners:
            return None
        goal = self.corners[0]
        step = min(max(goal - self.effort, -self.rise), self.rise)
        self.effort += step
        if abs(goal - self.effort) < 0.5 * self.rise:
            self.effort = self.corners.pop(0)
        return self.effort
