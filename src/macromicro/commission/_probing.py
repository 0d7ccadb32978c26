"""First motions: direction, breakaway effort, end stops, and breakaway along the travel."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.commission.courses import quiet
from macromicro.commission.stand import Caution, CommissionError, Record, Stand

PATIENCE = 120.0  # s, for a ramp with all its holds
_HOLD = 0.04  # s that an effort is held to see whether the axis slides
_STEADY = 0.8  # least part of the first half's way that it goes in the second half if it slides
_FAR = 20.0  # so many times the motion that is looked at is sliding for sure
_LEAST = 0.02  # of the largest effort: an axis without friction is moved by no less
_RAMP = 8.0  # s from no effort to the largest
MOVED = 4.0  # counts that show a motion
_TRIES = 3
_AT_ONCE = 1.05  # a ramp that began at an effort so near to the one found says little
_BELOW, _SLOWER = 0.7, 8.0  # a second ramp begins at that part of the first, and is slower
_RISE = 0.4  # s in which the effort of `Creep` rises from nothing to breakaway
PUSH = 1.6  # breakaways that a stop must hold against
_ROCKS = 1.5  # counts: within these an axis does not go
_HELD = 0.4  # s without motion under that push: an end


class Started(NamedTuple):
    effort: float  # V
    moved: float  # distance, m
    speed: float  # at which it slid under that effort, m/s; NaN where it went off at once


class Direction(NamedTuple):
    sign: float  # 1, or -1 where a positive effort made the encoder count down
    # forward, backward: least effort that started it in each direction, V, both above zero
    forward: float
    backward: float
    scatter: float  # standard deviation of single trials, V
    noise: float  # greatest change of the count at rest

    @property
    def breakaway(self) -> float:
        """The larger breakaway effort, V."""
        return max(self.forward, self.backward)

    @property
    def friction(self) -> float:
        """The mean breakaway effort, V, without a constant force."""
        return 0.5 * (self.forward + self.backward)

    @property
    def constant(self) -> float:
        """Effort that a constant force takes forwards, V."""
        return 0.5 * (self.forward - self.backward)

    def surely(self, effort: float) -> float:
        """Effort that surely moves the axis, even with hardly any friction."""
        return max(self.breakaway, _LEAST * effort)


class Ends(NamedTuple):
    # low, high: m from where commissioning began
    low: float
    high: float
    found: bool  # by touch; otherwise given by the user

    @property
    def travel(self) -> float:
        return self.high - self.low


class Ramp:
    """Effort that rises until the axis slides."""

    # A few counts may be compliance, which settles once the effort stops rising; so the effort is
    # held, and the axis slides if it does not slow down.

    def __init__(
        self,
        way: float,
        effort: float,
        rise: float,
        most: float,
        enough: float,
        climbs: bool = False,
    ) -> None:
        self.climbs, self.begun, self.first = climbs, math.nan, math.nan
        self.way, self.effort, self.rise, self.most = way, effort, rise, most
        self.enough = enough
        self.slid = False
        self.place = math.nan
        self.since: float | None = None
        self.half: float | None = None  # way in the first half of the hold, m
        self.speed = math.nan  # m/s, at which it slides under that effort; NaN: it went off

    def __call__(self, t: float, x: float, v: float) -> float | None:
        """Effort of this period; None when it slides, or stands at full effort."""
        if math.isnan(self.place):
            self.place = self.begun = x
        moved = abs(x - self.place)
        if self.since is None:
            if moved >= self.enough:
                self.place, self.since, self.half = x, t, None
                self.first = self.effort if math.isnan(self.first) else self.first
            else:
                self.effort += self.rise
        elif moved >= _FAR * self.enough:
            self.slid = True
        elif self.half is None:
            if t - self.since >= 0.5 * _HOLD:
                self.half = moved
        elif t - self.since >= _HOLD:
            self.slid = moved - self.half >= max(_STEADY * self.half, 0.5 * self.enough)
            self.speed = (moved - self.half) / (t - self.since - 0.5 * _HOLD)
            self.place, self.since = x, None
        if self.climbs and not self.slid and abs(x - self.begun) >= _FAR * self.enough:
            self.slid, self.effort, self.speed = True, self.first, math.nan
        return None if self.slid or self.effort > self.most else self.way * self.effort

    def again(self, x: float, effort: float) -> None:
        """Continue after a false detection."""
        self.place, self.since, self.half, self.slid, self.effort = x, None, None, False, effort


class Creep:
    """Slow motion of an unknown axis: effort rises while it is too slow."""

    def __init__(
        self,
        way: float,
        speed: float,
        breakaway: float,
        dt: float,
        target: float = math.nan,
        push: float = PUSH,
        pitch: float = 0.0,
    ) -> None:
        self.way, self.speed, self.target = way, speed, target
        self.rise = breakaway / _RISE * dt
        self.most = push * breakaway
        self.effort = 0.0
        self.still, self.at = 0.0, math.nan
        # Less motion in that time is none.
        self.slow = max(0.02 * speed * _HELD, _ROCKS * pitch)
        self.rocks, self.idle = pitch > 0.0, 0.0
        self.stuck = False
        self.dt = dt

    def __call__(self, t: float, x: float, v: float) -> float | None:
        if self.way * (x - self.target) >= 0.0:
            return None
        self.idle += self.dt
        if not abs(x - self.at) < self.slow:
            self.still, self.at, self.idle = 0.0, x, 0.0
        elif self.effort >= self.most:
            self.still += self.dt
            self.stuck = self.still >= _HELD
        if self.stuck:
            return None
        if self.way * v < self.speed or (self.rocks and self.idle > _HOLD):
            self.effort = min(self.effort + self.rise, self.most)
        else:
            self.effort = max(self.effort - 4.0 * self.rise, 0.0)
        return self.way * (self.effort if self.way * v < 2.0 * self.speed else 0.0)


def direction(stand: Stand, caution: Caution, climbs: bool = False) -> Direction:
    """Ramps of effort both ways in turn, until the axis moves by a few counts."""
    noise = np.ptp(quiet(stand, caution).x) / stand.pitch
    if noise > MOVED:
        raise CommissionError(
            f"the axis moves by {noise:.0f} counts without effort. Hold or balance it first"
        )
    moved: dict[float, list[float]] = {1.0: [], -1.0: []}
    shown: dict[float, float] = {}
    about = {way: find_breakaway(stand, way, caution, noise, 0.0, climbs).effort for way in moved}
    for _ in range(_TRIES):
        for way, efforts in moved.items():
            one = find_breakaway(stand, way, caution, noise, about[way], climbs)
            shown[way] = one.moved
            efforts.append(one.effort)
    if shown[1.0] * shown[-1.0] >= 0.0:
        raise CommissionError(
            "the axis moves the same way under both signs of effort. Check for gravity, or "
            "an amplifier that ignores the sign"
        )
    sign = 1.0 if shown[1.0] > 0.0 else -1.0
    stand.sign *= sign
    ahead, back = (moved[sign], moved[-sign])
    every = [*(e - _mean(ahead) for e in ahead), *(e - _mean(back) for e in back)]
    scatter = math.sqrt(sum(e * e for e in every) / (len(every) - 2))
    return Direction(sign, _mean(ahead), _mean(back), scatter, float(noise))


def find_breakaway(
    stand: Stand,
    way: float,
    caution: Caution,
    noise: float,
    about: float = 0.0,
    climbs: bool = False,
) -> Started:
    """A ramp of effort until the axis moves by a few counts; then it comes to rest."""
    start = stand.position()
    begin = _BELOW * about
    rate = caution.effort / _RAMP / (_SLOWER if about else 1.0)
    enough = (MOVED + noise) * stand.pitch
    law = Ramp(way, begin, rate * stand.dt, caution.effort, enough, climbs)
    record = stand.drive(law, PATIENCE, caution._replace(speed=math.inf))
    stand.rest(caution)
    if not law.slid:
        raise CommissionError(
            f"the axis does not move at {caution.effort:.3g} V, the limit of the effort. "
            "Check for an obstacle and that the amplifier is on, or allow a larger --effort"
        )
    if about and law.effort <= _AT_ONCE * begin:  # less would have started it, too
        return find_breakaway(stand, way, caution, noise, 0.0, climbs)
    return Started(law.effort, float(record.x[-1] - start), law.speed)


def ends(stand: Stand, found: Direction, caution: Caution, travel: float) -> Ends:
    """Creep to both ends, found by a resistance of `PUSH` times the breakaway effort."""
    places = []
    for way in (1.0, -1.0):
        law = Creep(way, caution.speed, found.surely(caution.effort), stand.dt)
        start = stand.position()
        window = caution._replace(low=start - travel, high=start + travel)
        record = crept(stand, law, travel, window)
        if not law.stuck:
            raise CommissionError(
                f"no end within {stand.place.told(travel, digits=3)}. Give the window that "
                "the axis may use, --from and --to, or a longer --travel"
            )
        places.append(float(record.x[-1]))
    low, high = min(places), max(places)
    spare = max(0.02 * (high - low), 10.0 * stand.pitch)
    if high - low < 100.0 * stand.pitch:
        raise CommissionError(
            f"the axis can move by {(high - low) / stand.pitch:.0f} counts only. Check for an "
            "obstacle, or use a finer encoder"
        )
    return Ends(low + spare, high - spare, True)


def go(stand: Stand, place: float, found: Direction, caution: Caution) -> bool:
    start = stand.position()
    way = 1.0 if place > start else -1.0
    law = Creep(way, caution.speed, found.surely(caution.effort), stand.dt, place)
    record = crept(stand, law, abs(place - start), caution)
    return not (law.stuck or record.ended)


def crept(stand: Stand, law: Creep, distance: float, caution: Caution) -> Record:
    """Creep so far at most, then come to rest."""
    longest = 4.0 * distance / caution.speed + 5.0
    record = stand.drive(law, longest, caution._replace(speed=math.inf))
    stand.rest(caution)
    return record


def _mean(values: list[float]) -> float:
    return sum(values) / len(values)


PLACES = 7
_LEAST_SPREAD = 0.01  # of the mean: seven places do not show every speck
_LOWER = 0.8  # friction elsewhere may be that much lower than where it was felt first


class FrictionMap(NamedTuple):
    places: tuple[float, ...]  # from the low end, m
    forward: tuple[float, ...]  # least effort that started it there, V
    backward: tuple[float, ...]  # NaN where it could not be tried
    slid: float = 0.0  # speed at which it slid under those efforts, m/s: part of them is viscous

    @property
    def sides(self) -> list[Array]:
        """Known breakaway efforts of each direction, V."""
        every = (np.array(side) for side in (self.forward, self.backward))
        return [known for side in every if len(known := side[~np.isnan(side)])]

    @property
    def mean(self) -> float:
        """Mean of both directions, V, which cancels a constant force."""
        return float(np.mean([side.mean() for side in self.sides]))

    def breakaway(self, viscous: float) -> float:
        """The mean less viscous friction at the detection speed."""
        return max(self.mean - viscous * self.slid, 0.5 * self.mean)

    @property
    def spread(self) -> float:
        """Standard deviation along the travel, V; at least a hundredth of the mean."""
        found = [float(side.std(ddof=1)) for side in self.sides if len(side) > 1]
        return max([*found, _LEAST_SPREAD * self.mean])

    @property
    def ripple(self) -> float:
        """Excess of the worst position over a direction's mean, V."""
        return max(float(side.max() - side.mean()) for side in self.sides)


def map_friction(stand: Stand, found: Direction, ends: Ends, caution: Caution) -> FrictionMap:
    places: list[float] = []
    forward: list[float] = []
    backward: list[float] = []
    speeds: list[float] = []
    for k in range(PLACES):
        place = ends.low + (k + 0.5) / PLACES * ends.travel
        if not go(stand, place, found, caution):
            continue
        places.append(stand.position() - ends.low)
        for kept, way, about in ((forward, 1.0, found.forward), (backward, -1.0, found.backward)):
            one = find_breakaway(stand, way, caution, found.noise, _LOWER * about)
            kept.append(one.effort)
            if not math.isnan(one.speed):
                speeds.append(one.speed)
    # What went off at once went faster, but its mass took what effort there was.
    slid = sum(speeds) / max(2 * len(places), 1)
    return FrictionMap(tuple(places), tuple(forward), tuple(backward), slid)
