"""Laws for commissioning a wire: a slow ramp, pulses and reversals."""

from __future__ import annotations

import math
from typing import NamedTuple

from macromicro.commission.procedure import Work

RISE = 40.0  # s from no effort to the largest
HOLD = 20.0  # s at the largest, at most, while it still contracts
_PART = 0.02  # of the largest effort: the position must go on by then
_FLAT = 0.01  # of the way so far
_STOPS = 3  # so many times in turn: it is contracted
_STILL = 0.25  # of that share at the largest effort, where a thick wire follows slowly
_CONTRACTED, EXTENDED = 0.97, 0.03  # of the way: where a pulse and its cooling end
LONG = 3.0  # a pulse may last so many times as long as the ramp
_HELD = 0.25  # of the ramp's time: a contracted wire is held that long
PATIENCE = 300.0  # s


class Warmth(NamedTuple):
    sign: float  # 1, or -1 where it makes the reading fall
    effort: float  # at which it was seen, rising slowly, V
    noise: float  # standard deviation of the reading, m


class Ramp:
    """Effort that rises slowly until contraction ends, then falls to zero."""

    def __init__(self, work: Work, least: float, *, seen: bool) -> None:
        o = work.options
        self.rise = o.effort * work.stand.dt / RISE
        self.most, self.step = o.effort, _PART * o.effort
        self.edge = math.inf if o.high is None else o.high
        self.least, self.seen = least, seen
        self.effort, self.level, self.start = 0.0, 0.0, math.nan
        self.mark = (0.0, math.nan)
        self.still, self.moved, self.contracted, self.falling = 0, False, False, False

    def __call__(self, t: float, x: float, v: float) -> float | None:
        """Effort of this period; None when it ends."""
        if math.isnan(self.start):
            self.start, self.mark = x, (0.0, x)
        if self.falling:
            self.effort = max(self.effort - self.rise, 0.0)
            return self.effort or None
        way = abs(x - self.start)
        self.moved = self.moved or way > self.least
        if self.level - self.mark[0] >= self.step:
            flat = _FLAT if self.effort < self.most else _STILL * _FLAT
            slow = abs(x - self.mark[1]) < max(flat * way, 0.3 * self.least)
            self.still = self.still + 1 if slow and self.moved else 0
            self.mark = (self.level, x)
        self.contracted = self.still >= _STOPS
        if self.contracted and not self.seen:
            self.falling = True
            return self.effort
        ended = self.contracted or (self.seen and self.moved) or x - self.start >= self.edge
        # The level goes on where the effort cannot: it counts the time at the largest.
        last = self.most if self.seen else self.most * (1.0 + HOLD / RISE)
        if ended or self.level >= last:
            return None
        self.level += self.rise
        self.effort = min(self.level, self.most)
        return self.effort


class Pulses:
    """Heat until contracted, hold, cool until extended, for several efforts."""

    def __init__(self, efforts: list[float], hold: float, way: float, longest: float) -> None:
        self.efforts, self.hold, self.way = list(efforts), hold, way
        self.longest, self.held = longest, _HELD * longest / LONG
        self.phase, self.since, self.start, self.cooled = 0, 0.0, math.nan, 0.0

    def __call__(self, t: float, x: float, v: float) -> float | None:
        """Effort of this period; None at the end."""
        if math.isnan(self.start):
            self.start = x
        share, took = (x - self.start) / self.way, t - self.since
        done = (
            share >= _CONTRACTED or took > self.longest,
            took > self.held,
            share <= EXTENDED or took > PATIENCE,
            took > self.cooled,
        )[self.phase]
        if done:
            if self.phase == 2:
                self.cooled = took
            if self.phase == 3:
                self.efforts.pop(0)
            self.phase, self.since = (self.phase + 1) % 4, t
        if not self.efforts:
            return None
        return (self.efforts[0], self.hold, 0.0, 0.0)[self.phase]


class Turns:
    """Slow warming, then cooling to several shares of the travel, each warmed again."""

    def __init__(
        self, shares: tuple[float, ...], way: float, most: float, rate: float, dt: float
    ) -> None:
        self.shares, self.way, self.most, self.step = list(shares), way, most, rate * dt
        self.effort, self.start, self.rising = 0.0, math.nan, True

    def __call__(self, t: float, x: float, v: float) -> float | None:
        """Effort of this period; None at the end."""
        if math.isnan(self.start):
            self.start = x
        share = (x - self.start) / self.way
        if self.rising and (share >= _CONTRACTED or self.effort >= self.most):
            self.rising = False
        elif not self.rising and self.shares and (share <= self.shares[0] or self.effort <= 0.0):
            self.shares.pop(0)
            self.rising = True
        ended = not (self.rising or self.shares) and self.effort <= 0.0
        wanted = self.effort + (self.step if self.rising else -self.step)
        self.effort = min(max(wanted, 0.0), self.most)
        return None if ended else self.effort
