"""Drive signals for commissioning a piezo stage: slow, and by steps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from macromicro.commission import courses
from macromicro.commission.courses import Corner, course, decaying, drive, play
from macromicro.commission.procedure import Work
from macromicro.commission.stand import CommissionError, Record

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


GAIN, REACH, SWINGS, STEPS = "gain", "reach", "swings", "steps"
LOW, TRIES = 0.05, 3  # of the largest effort, at first; how often
_CLEAR = 20.0  # noises that the first motion must be
REST = 0.05  # s at each corner
_HOLD = 10.0  # s at the top and near the bottom, for creep
_CURVES = (0.1, 0.3, 0.5, 0.7, 0.9, 1.0)  # of the range: where first-order curves turn
SIZES = (0.01, 0.01, 0.02, 0.04, 0.08, 0.16, 0.3)  # of the range: steps
_LONG = 0.4  # s after a step
_FAST = 0.6  # of the greatest speed: what a step may reach, by the steps before it


class Steps:
    """Steps up and back from a base, limited to well below the greatest speed seen before."""

    def __init__(
        self, base: float, sizes: Sequence[float], speed: float, rate: float, dt: float
    ) -> None:
        self.base, self.left, self.speed = base, list(sizes), speed
        self.made: list[float] = []
        self.held = round(_LONG / dt)
        self.queue = course([Corner(base, _LONG, rate)], dt).tolist()
        self.home = [*course([Corner(base, REST, rate)], dt)[::-1].tolist(), 0.0]
        self.peak = 0.0
        self.ended = False

    def __call__(self, t: float, x: float, v: float) -> float | None:
        """Effort of this period; None back at 0."""
        if self.made:
            self.peak = max(self.peak, abs(v))
        if not self.queue:
            self._next()
        return self.queue.pop(0) if self.queue else None

    def _next(self) -> None:
        if self.ended:
            return
        if not self.left:
            self.queue, self.ended = self.home, True
            return
        size = self.left.pop(0)
        if self.made and self.peak > 0.0:
            size = min(size, _FAST * self.speed / self.peak * self.made[-1])
        self.made.append(size)
        self.peak = 0.0
        self.queue = [self.base + size] * self.held + [self.base] * self.held


def gain_intent(work: Work) -> str:
    top = LOW * work.options.effort
    return (
        f"The effort rises slowly from 0 to {top:.3g} V and back to 0, {TRIES + 1} times. The "
        f"stage moves by about {100.0 * LOW:.0f} % of its travel."
    )


def gain(work: Work) -> Gain:
    o, stand = work.options, work.stand
    caution = o.caution(o.speed)
    noise = courses.noise(courses.quiet(stand, caution))
    top, rate = LOW * o.effort, (o.effort - o.bottom) / SLOW
    gains = []
    for k in range(TRIES + 1):
        efforts = course([Corner(top, REST, rate), Corner(0.0, REST, rate)], stand.dt)
        record = play(stand, efforts, caution)
        at_top = record.u >= 0.999 * top
        n = max(int(at_top.sum()) // 2, 1)
        way = float(record.x[at_top][-n:].mean() - record.x[:n].mean())
        if k:  # the first leaves a remanence behind, from which all others begin
            gains.append(way / top)
    mean = float(np.mean(gains))
    if abs(mean * top) < _CLEAR * max(noise, 0.3 * stand.pitch):
        raise CommissionError(
            f"{top:.3g} V move the stage by only {abs(mean * top) * 1e6:.3g} um, but the "
            f"reading is uncertain by {noise * 1e6:.3g} um. Check that the amplifier is on "
            "and that no servo holds the stage, or allow a larger --effort"
        )
    found = Gain(math.copysign(1.0, mean), abs(mean), float(np.std(gains, ddof=1)), noise)
    stand.facing *= found.sign
    return found


def reach_intent(work: Work) -> str:
    o, slope = work.options, work[GAIN].gain
    window = ""
    if o.low is not None and o.high is not None:
        window = f" It also reverses at {o.low * 1e3:.4g} and {o.high * 1e3:.4g} mm."
    return (
        f"The effort goes slowly from 0 to {o.effort:.3g} V, to {o.bottom:.3g} V and back to "
        f"0, about {slope * (o.effort - o.bottom) * 1e3:.3g} mm of motion or a little more; "
        f"it reverses where the stage stops moving.{window}"
    )


def reach(work: Work) -> Reach:
    o, stand = work.options, work.stand
    law = Climb(work, work[GAIN].gain)
    record = drive(stand, law, 30.0 * SLOW, o.caution(o.speed).anywhere)
    rest = float(record.x[-1])
    (top, high, above), (bottom, low, below) = law.reached[1.0], law.reached[-1.0]
    return Reach(bottom, top, low - rest, high - rest, (below, above))


def swings_intent(work: Work) -> str:
    span = work[REACH]
    return (
        f"Slow swings between {span.lowest:.3g} and {span.highest:.3g} V, "
        f"{(span.high - span.low) * 1e3:.4g} mm: a decaying one, and {len(_CURVES)} partial "
        f"ones from the top, with two rests of {_HOLD:.0f} s."
    )


def swings(work: Work) -> list[Record]:
    span, stand = work[REACH], work.stand
    caution = work.options.caution(work.options.speed).anywhere
    rate = span.extent / SLOW
    middle, half = 0.5 * (span.highest + span.lowest), 0.5 * span.extent
    dying = [span.lowest, span.highest, span.lowest, *decaying(middle, 0.9 * half, SWUNG), 0.0]
    partial = [span.lowest, span.highest]
    for part in _CURVES:
        partial += [span.highest - part * span.extent, span.highest]
    records = []
    for efforts in (dying, [*partial, 0.0]):
        rests = [REST] * len(efforts)
        if efforts is not dying:
            rests[-2] = rests[-5] = _HOLD
        corners = [Corner(u, rest, rate) for u, rest in zip(efforts, rests, strict=True)]
        records.append(play(stand, course(corners, stand.dt), caution))
    return records


def steps_intent(work: Work) -> str:
    span = work[REACH]
    return (
        f"Slowly to the middle of the range; there {len(SIZES)} steps of "
        f"{SIZES[0] * span.extent:.2g} to {SIZES[-1] * span.extent:.3g} V up and back, each "
        f"followed by {_LONG} s of ringing; smaller ones where the ringing approaches "
        f"{work.options.speed:.3g} m/s."
    )


def steps(work: Work) -> list[Record]:
    span, stand = work[REACH], work.stand
    caution = work.options.caution(work.options.speed).anywhere
    rate, dt = span.extent / SLOW, stand.dt
    base = span.lowest + 0.4 * span.extent
    law = Steps(base, [size * span.extent for size in SIZES], caution.speed, rate, dt)
    longest = 2.0 * SLOW + (2 * len(SIZES) + 2) * _LONG
    record = drive(stand, law, longest, caution)
    n = round(_LONG / dt)
    least = 0.5 * SIZES[0] * span.extent
    begins = np.flatnonzero(np.abs(np.diff(record.u)) > least).tolist()
    if len(begins) != 2 * len(law.made):
        raise CommissionError("the control period is too long for steps of this stage")
    cuts = [slice(k + 1, k + n) for k in begins]
    return [
        Record(record.t[c] - record.t[c.start], np.r_[record.u[k], record.u[c][1:]], record.x[c])
        for k, c in zip(begins, cuts, strict=True)
    ]
