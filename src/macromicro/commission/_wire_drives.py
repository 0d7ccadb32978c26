"""Drive signals for commissioning a wire: a slow ramp, pulses and reversals."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from macromicro.commission import courses
from macromicro.commission.courses import drive
from macromicro.commission.procedure import Work
from macromicro.commission.stand import Caution, CommissionError, Record, Stand

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


WARMTH, RAMP, PULSES, CURVES = "warmth", "ramp", "pulses", "curves"
TURNS = (0.75, 0.5, 0.25)  # shares of the way at which first-order curves turn
_SEEN = 12.0  # noises that a motion must be
_AT_REST = 3.0  # s in which a wire that has cooled moves by no more than its noise
EFFORTS = (0.6, 1.0, 0.8, 0.45)  # of what lies above the effort that contracts it


def _wide(work: Work) -> Caution:
    """Without a window: a warm wire may be anywhere in its travel."""
    return work.options.caution(work.options.speed).anywhere


def cool(
    stand: Stand, least: float, work: Work, start: float = math.nan, way: float = math.nan
) -> None:
    """Wait without effort until the wire stops moving."""
    # A hot wire also stands, contracted until it has cooled enough; so it must first return, and
    # then stand for as long as that took.
    at, since, came = math.nan, 0.0, 0.0
    back = math.isnan(start)

    def idle(t: float, x: float, v: float) -> float | None:
        nonlocal at, since, back, came
        if not back and x - start <= max(EXTENDED * way, 0.5 * least):
            back, came = True, t
        if not abs(x - at) < least:
            at, since = x, t
        return None if back and t - since >= _AT_REST and t >= 2.0 * came else 0.0

    record = stand.drive(idle, PATIENCE, _wide(work))
    if not back:
        raise CommissionError(
            f"the wire is still contracted after {PATIENCE:.0f} s without effort. Check that "
            "its spring stretches it again"
        )
    if len(record.t) * stand.dt >= PATIENCE:
        raise CommissionError(f"the wire is not at rest after {PATIENCE:.0f} s without effort")


def warmth_intent(work: Work) -> str:
    return (
        f"The effort rises slowly from 0 V, {work.options.effort / RISE:.2g} V/s up to "
        f"{work.options.effort:.3g} V at most, and is removed as soon as the wire contracts "
        f"by {_SEEN:.0f} times the reading's noise."
    )


def warmth(work: Work) -> Warmth:
    """Effort at first contraction, and its direction."""
    o, stand = work.options, work.stand
    caution = o.caution(o.speed)
    noise = courses.noise(courses.quiet(stand, caution))
    least = _SEEN * max(noise, 0.3 * stand.pitch)
    law = Ramp(work, least, seen=True)
    record = stand.drive(law, 1.5 * RISE, caution)
    if not law.moved:
        raise CommissionError(
            f"nothing contracts at {o.effort:.3g} V. Check that the wire is connected and "
            "stretched, or allow a larger --effort"
        )
    sign = math.copysign(1.0, float(record.x[-1]) - law.start)
    stand.facing *= sign
    cool(stand, least, work, sign * law.start, abs(float(record.x[-1]) - law.start))
    return Warmth(sign, law.effort, noise)


def least_motion(work: Work) -> float:
    """Motion that is safely detected."""
    return float(_SEEN * max(work[WARMTH].noise, 0.3 * work.stand.pitch))


def ramp_intent(work: Work) -> str:
    return (
        f"The effort rises slowly, {work.options.effort / RISE:.2g} V/s, until the wire stops "
        f"contracting, to {work.options.effort:.3g} V at most, where it stays for up to "
        f"{HOLD:.0f} s while the wire still contracts, and falls as slowly to 0. The wire "
        "makes its full travel and back."
    )


def ramp(work: Work) -> list[Record]:
    stand, least = work.stand, least_motion(work)
    law = Ramp(work, least, seen=False)
    record = stand.drive(law, 3.0 * RISE, _wide(work))
    if not law.contracted:
        raise CommissionError(
            f"the wire still contracts at {record.u.max():.3g} V. Allow a larger "
            "--effort to show its full travel, or a wider window, --from and --to"
        )
    cool(stand, least, work, law.start, float(record.x.max()) - law.start)
    return [Record(record.t[:-1], record.u[:-1], record.x[:-1])]


def way_of(work: Work) -> float:
    """Full contraction, by the slow ramp."""
    record = work[RAMP][0]
    n = max(round(0.2 / work.stand.dt), 1)
    top = len(record.u) - 1 - int(np.argmax(record.u[::-1]))  # the last at the largest effort
    return float(record.x[max(top - n, 0) : top].mean() - record.x[:n].mean())


def _pulse_efforts(work: Work) -> tuple[list[float], float]:
    """Efforts of the pulses, and the one that holds."""
    record, most = work[RAMP][0], work.options.effort
    half = record.x[0] + 0.5 * way_of(work)
    hold = float(record.u[int(np.argmax(record.x >= half))])
    return [hold + part * (most - hold) for part in EFFORTS], min(1.1 * hold, most)


def pulses_intent(work: Work) -> str:
    efforts, hold = _pulse_efforts(work)
    return (
        f"{len(efforts)} pulses of {min(efforts):.3g} to {max(efforts):.3g} V, each until the "
        f"wire is contracted by {way_of(work) * 1e3:.3g} mm, where {hold:.3g} V hold it for a "
        "while; then it cools."
    )


def pulses(work: Work) -> list[Record]:
    efforts, hold = _pulse_efforts(work)
    slow = work[RAMP][0]
    longest = LONG * float(slow.t[int(np.argmax(slow.u))])
    law = Pulses(efforts, hold, way_of(work), longest)
    record = drive(work.stand, law, len(efforts) * (longest + 2.0 * PATIENCE), _wide(work))
    return [Record(record.t[:-1], record.u[:-1], record.x[:-1])]


def curves_intent(work: Work) -> str:
    o, way = work.options, way_of(work) * 1e3
    places = ", ".join(f"{share * way:.3g}" for share in TURNS)
    return (
        f"The effort rises and falls slowly, {o.effort / RISE:.2g} V/s and {o.effort:.3g} V "
        f"at most: the wire contracts, extends to {places} mm and contracts again each time, "
        "and cools."
    )


def curves(work: Work) -> list[Record]:
    stand, o = work.stand, work.options
    law = Turns(TURNS, way_of(work), o.effort, o.effort / RISE, stand.dt)
    record = drive(stand, law, 2.0 * (len(TURNS) + 1) * RISE, _wide(work))
    way = float(record.x.max()) - law.start
    cool(stand, least_motion(work), work, law.start, way)
    return [Record(record.t[:-1], record.u[:-1], record.x[:-1] - law.start)]
