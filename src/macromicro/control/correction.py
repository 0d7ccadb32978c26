"""Corrections of a stage's positions and efforts along its travel, from a calibration.

The true position is the reading r plus a deviation e(r) that depends on the flank on which the
drive lies: x = r + e_up(r) after a motion up, x = r + e_down(r) after a motion down. A set point
takes the inverse way, so that law and guard go on in readings.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.columns import Meaning, Quantity
from macromicro.control.stage_law import Target
from macromicro.kernel import kernel
from macromicro.schema.par import Par

_MEASURED = "measured by `macromicro calibrate`"
STEEPEST = 0.2  # greatest slope of a deviation: with it, the inverse converges
_ROUNDS = 2  # of Newton's method for the inverse, behind a first guess
# A quintic from rest to rest over a distance d in a time T has a greatest acceleration of
# 10 / sqrt(3) d / T^2.
_QUINTIC = 10.0 / math.sqrt(3.0)
_SETTLED = 2.0  # periods of the drive's mode that a push lasts at least
_SPARE = 3.0  # counts
# A load that bounces off the drive leaves it at up to twice its speed v and slides on by
# (2 v)^2 / (2 coast). With a quarter of that deceleration it stops before the drive does.
_BOUNCE = 0.25
_SLOW = 1e-6  # of the greatest speed: a slower set point has no direction


class Correction(NamedTuple):
    """A calibration: deviations (true position less reading), evenly spaced from low to high."""

    on: Annotated[
        int, Par("", "1: correct; 0: leave readings as they are", "choice", lo=0, hi=1)
    ] = 1
    low: Annotated[float, Par("m", "place of the tables' first value", _MEASURED, shown="mm")] = 0.0
    high: Annotated[float, Par("m", "place of their last value", _MEASURED, shown="mm")] = 0.1
    up: Annotated[
        tuple[float, ...], Par("m", "deviations after a motion up", _MEASURED, shown="um")
    ] = (0.0, 0.0)
    down: Annotated[
        tuple[float, ...], Par("m", "deviations after a motion down", _MEASURED, shown="um")
    ] = (0.0, 0.0)
    period: Annotated[
        float, Par("m", "period of a deviation that repeats", _MEASURED, shown="mm", positive=True)
    ] = 5e-3
    waves: Annotated[
        tuple[float, ...],
        Par("m", "its sine and cosine, then those of its harmonics", _MEASURED, shown="um"),
    ] = (0.0, 0.0)
    other: Annotated[str, Par("", "the axis that `across` is a table over; empty: none")] = ""
    across_low: Annotated[
        float, Par("m", "place of that axis at the first value", _MEASURED, shown="mm")
    ] = 0.0
    across_high: Annotated[
        float, Par("m", "place of that axis at the last value", _MEASURED, shown="mm")
    ] = 0.1
    across: Annotated[
        tuple[float, ...],
        Par("m", "deviation by squareness and straightness", _MEASURED, shown="um"),
    ] = (0.0, 0.0)
    expansion: Annotated[float, Par("1/K", "growth with temperature", _MEASURED)] = 0.0
    fixed: Annotated[
        float, Par("m", "place that stays where it is in the heat", _MEASURED, shown="mm")
    ] = 0.0
    temperature: Annotated[float, Par("degC", "of the calibration", _MEASURED)] = 20.0
    cold: Annotated[float, Par("degC", "lowest temperature of the calibration", _MEASURED)] = -273.0
    hot: Annotated[float, Par("degC", "highest temperature of the calibration", _MEASURED)] = 1000.0
    warm_up: Annotated[float, Par("1", "growth after a cold start until it is warm", _MEASURED)] = (
        0.0
    )
    warm_time: Annotated[float, Par("s", "time constant of that", _MEASURED, positive=True)] = 600.0
    warm_until: Annotated[
        float, Par("s", "time after the start until which it was measured", _MEASURED, lo=0.0)
    ] = 0.0
    effort_up: Annotated[
        tuple[float, ...], Par("V", "effort along the travel, moving up", _MEASURED)
    ] = (0.0, 0.0)
    effort_down: Annotated[
        tuple[float, ...], Par("V", "effort along the travel, moving down", _MEASURED)
    ] = (0.0, 0.0)
    effort_period: Annotated[
        float, Par("m", "period of an effort that repeats", _MEASURED, shown="mm", positive=True)
    ] = 5e-3
    effort_waves: Annotated[
        tuple[float, ...], Par("V", "its sine and cosine, then those of its harmonics", _MEASURED)
    ] = (0.0, 0.0)
    turn_effort: Annotated[
        float, Par("V", "effort taken off where a motion turns back", _MEASURED)
    ] = 0.0
    turn_damping: Annotated[float, Par("V*s/m", "effort added there, per speed", _MEASURED)] = 0.0
    turn_way: Annotated[
        float, Par("m", "way over which both fade", _MEASURED, shown="um", positive=True)
    ] = 5e-6
    stop: Annotated[
        float,
        Par("m", "how far short of its set point the law stops", _MEASURED, shown="um"),
    ] = 0.0
    half_width: Annotated[
        float,
        Par("m", "half width of the 95 % interval of a position", _MEASURED, shown="um", lo=0.0),
    ] = 0.0
    made: Annotated[str, Par("", "when it was measured")] = ""

    def problems(self) -> list[tuple[str, object, str]]:
        found: list[tuple[str, object, str]] = []
        for low, high in (("low", "high"), ("across_low", "across_high")):
            if getattr(self, high) <= getattr(self, low):
                found.append((high, getattr(self, high), f"above {{{low}}}"))
        for first, second in (("up", "down"), ("effort_up", "effort_down")):
            one, two = getattr(self, first), getattr(self, second)
            if len(one) < 2 or len(one) != len(two):
                words = f"two values or more, as many as {first}"
                found.append((second, f"{len(one)} and {len(two)} values", words))
        if len(self.across) < 2:
            found.append(("across", f"{len(self.across)} values", "two values or more"))
        for name in ("waves", "effort_waves"):
            if len(getattr(self, name)) % 2:
                words = "pairs of a sine and a cosine"
                found.append((name, f"{len(getattr(self, name))} values", words))
        return found or self._steep()

    def _steep(self) -> list[tuple[str, object, str]]:
        """A deviation so steep that a set point has no unique reading."""
        step = (self.high - self.low) / (len(self.up) - 1)
        waves = zip(self.waves[::2], self.waves[1::2], strict=True)
        wave = sum(
            math.hypot(*pair) * 2.0 * math.pi * k / self.period for k, pair in enumerate(waves, 1)
        )
        for name in ("up", "down"):
            slopes = np.abs(np.diff(getattr(self, name))) / step
            worst = int(np.argmax(slopes))
            if slopes[worst] + wave >= STEEPEST:
                place = 1e3 * (self.low + (worst + 0.5) * step)
                found = f"a slope of {slopes[worst] + wave:.3g} at {place:.6g} mm"
                return [(name, found, f"deviations with slopes below {STEEPEST}")]
        return []


class NoCorrection(NamedTuple):
    """Of a stage without a calibration."""


class Tables(NamedTuple):
    """A correction as its kernels take it."""

    low: Annotated[float, Meaning("place of the tables' first value", "m")]
    step: Annotated[float, Meaning("distance of their values", "m")]
    up: Annotated[Array, Meaning("deviations after a motion up", "m")]
    down: Annotated[Array, Meaning("deviations after a motion down", "m")]
    period: Annotated[float, Meaning("of the deviation that repeats", "m")]
    waves: Annotated[Array, Meaning("its sines and cosines", "m")]
    origin: Annotated[float, Meaning("reading at the place 0; NaN: not known, no correction", "m")]
    other: Annotated[int, Meaning("index of the axis that `across` is a table over; -1: none")]
    across_low: Annotated[float, Meaning("place of that axis at the first value", "m")]
    across_step: Annotated[float, Meaning("distance of the values", "m")]
    across: Annotated[Array, Meaning("deviations by squareness and straightness", "m")]
    expansion: Annotated[float, Meaning("growth with temperature", "1/K")]
    fixed: Annotated[float, Meaning("place that stays where it is", "m")]
    temperature: Annotated[float, Meaning("of the calibration", "degC")]
    warm_up: Annotated[float, Meaning("growth after a cold start until it is warm", "1")]
    warm_time: Annotated[float, Meaning("time constant of that", "s")]
    effort_step: Annotated[float, Meaning("distance of the efforts' values", "m")]
    effort_up: Annotated[Array, Meaning("moving up", "V")]
    effort_down: Annotated[Array, Meaning("moving down", "V")]
    effort_period: Annotated[float, Meaning("of the effort that repeats", "m")]
    effort_waves: Annotated[Array, Meaning("its sines and cosines", "V")]
    turn_effort: Annotated[float, Meaning("taken off where a motion turns back", "V")]
    turn_damping: Annotated[float, Meaning("added there, per speed", "V*s/m")]
    turn_way: Annotated[float, Meaning("over which both fade", "m")]
    slow: Annotated[float, Meaning("a slower set point has no direction", "m/s")]
    coast: Annotated[
        float,
        Meaning(
            "deceleration of the load by its friction; infinite: it stays on its flank", "m/s^2"
        ),
    ]
    weight: Annotated[float, Meaning("acceleration by gravity, towards lower places", "m/s^2")]
    acceleration: Annotated[float, Meaning("of the drive across its backlash", "m/s^2")]
    least: Annotated[
        float, Meaning("shortest time of a push, two periods of the drive's mode", "s")
    ]
    stop: Annotated[float, Meaning("how far short of its set point the law stops", "m")]
    spare: Annotated[
        float, Meaning("by which a load that is braked stays short of its target", "m")
    ]
    friction: Annotated[float, Meaning("effort that the law adds against friction", "V")]


class Turn(NamedTuple):
    """The last reversal of a set point: state."""

    rested: Annotated[float, Meaning("1: the set point is or was at rest since")] = 1.0
    place: Annotated[float, Meaning("where it turned back; NaN: it came from rest", "m")] = math.nan


class Flank(NamedTuple):
    """On which flank of its drive the load lies, or is about to: state."""

    direction: Annotated[float, Meaning("of the last motion: 1 up, -1 down, 0 none")] = 0.0
    begun: Annotated[float, Meaning("share of the upper flank as the crossing began", "1")] = 0.5
    aimed: Annotated[float, Meaning("and as it ends: 1 the upper flank, 0 the lower", "1")] = 0.5
    off: Annotated[float, Meaning("what the set point had beside that as it began", "m")] = 0.0
    wanted: Annotated[float, Meaning("and has as it ends", "m")] = 0.0
    since: Annotated[float, Meaning("when it began", "s")] = 0.0
    length: Annotated[float, Meaning("its duration; 0: there is none", "s")] = 0.0
    pushed: Annotated[
        float, Meaning("share of the time in which a push speeds up; 0: it is a crossing", "1")
    ] = 0.0
    turn: Turn = Turn()


class Reading(NamedTuple):
    """What the sensor of a corrected stage shows."""

    reading: Annotated[float, Quantity("mm", "reading of the sensor, not corrected", scale=1e3)]
    flank: Annotated[float, Quantity("1", "flank of the drive: 1 the upper one, 0 the lower")]


class Load(NamedTuple):
    """What decides on which flank of its drive a load lies."""

    velocity: float  # greatest, m/s
    acceleration: float  # greatest, m/s^2
    coast: float = math.inf  # deceleration by friction alone, m/s^2
    weight: float = 0.0  # acceleration by gravity, towards lower places, m/s^2
    frequency: float = math.inf  # of its mode on the drive, Hz
    pitch: float = 0.0  # of the sensor, m
    friction: float = 0.0  # effort that the law adds against friction, V

    @property
    def runs_ahead(self) -> bool:
        """Whether a load can leave its flank: it rubs, and no weight keeps it there."""
        return math.isfinite(self.coast) and abs(self.weight) < self.coast


def tables(correction: Any, load: Load, stages: Sequence[str] = ()) -> Tables:
    """A correction for the kernels; `stages` are the names of all stages of the machine."""
    p, count = correction, len(correction.up)
    return Tables(
        p.low,
        (p.high - p.low) / (count - 1),
        np.array(p.up),
        np.array(p.down),
        p.period,
        np.array(p.waves),
        0.0 if p.on else math.nan,
        list(stages).index(p.other) if p.other in stages else -1,
        p.across_low,
        (p.across_high - p.across_low) / (len(p.across) - 1),
        np.array(p.across),
        p.expansion,
        p.fixed,
        p.temperature,
        p.warm_up,
        p.warm_time,
        (p.high - p.low) / (len(p.effort_up) - 1),
        np.array(p.effort_up),
        np.array(p.effort_down),
        p.effort_period,
        np.array(p.effort_waves),
        p.turn_effort,
        p.turn_damping,
        p.turn_way,
        _SLOW * load.velocity,
        load.coast if load.runs_ahead else math.inf,
        load.weight,
        load.acceleration,
        _SETTLED / load.frequency if load.frequency > 0.0 else 0.0,
        p.stop,
        _SPARE * load.pitch,
        load.friction,
    )


@kernel
def curve(low: float, step: float, values: Array, x: float) -> tuple[float, float, float]:
    """Value, slope and curvature at a place: cubic between the values, straight beyond them."""
    last = len(values) - 1
    at = (x - low) / step
    k = min(max(math.floor(at), 0), last - 1)
    u, a, b = at - k, values[k], values[k + 1]
    # Slopes by central differences (Catmull-Rom), by the nearest difference at the ends.
    first = 0.5 * (b - values[k - 1]) if k > 0 else b - a
    second = 0.5 * (values[k + 2] - a) if k + 1 < last else b - a
    if at < 0.0:
        return a + u * first, first / step, 0.0
    if at > last:
        return b + (u - 1.0) * second, second / step, 0.0
    c2 = 3.0 * (b - a) - 2.0 * first - second
    c3 = first + second - 2.0 * (b - a)
    value = a + u * (first + u * (c2 + u * c3))
    slope = (first + u * (2.0 * c2 + 3.0 * u * c3)) / step
    return value, slope, (2.0 * c2 + 6.0 * u * c3) / (step * step)


@kernel
def wave(period: float, waves: Array, x: float) -> tuple[float, float, float]:
    """Value, slope and curvature of a sum of harmonics."""
    value, slope, bend = 0.0, 0.0, 0.0
    for k in range(len(waves) // 2):
        w = 2.0 * math.pi * (k + 1) / period
        s, c = math.sin(w * x), math.cos(w * x)
        a, b = waves[2 * k], waves[2 * k + 1]
        value += a * s + b * c
        slope += w * (a * c - b * s)
        bend -= w * w * (a * s + b * c)
    return value, slope, bend


@kernel
def growth(p: Tables, degrees: float, t: float) -> float:
    """Growth since the calibration's temperature, or since a cold start."""
    grown = 0.0
    if p.expansion != 0.0 and not math.isnan(degrees):
        grown = p.expansion * (degrees - p.temperature)
    if p.warm_up != 0.0:
        grown += p.warm_up * (1.0 - math.exp(-t / p.warm_time))
    return grown


@kernel
def deviation(
    p: Tables,
    r: float,
    share: Annotated[float, Meaning("of the upper flank", "1")],
    grown: Annotated[float, Meaning("by which it has grown", "1")],
) -> tuple[float, float, float, float]:
    """Deviation at a reading, its slope and curvature, and its change from flank to flank.

    What repeats does so along the drive, on which the load lies further up on its upper flank.
    """
    up, up_slope, up_bend = curve(p.low, p.step, p.up, r)
    down, down_slope, down_bend = curve(p.low, p.step, p.down, r)
    value = share * up + (1.0 - share) * down
    slope = share * up_slope + (1.0 - share) * down_slope
    bend = share * up_bend + (1.0 - share) * down_bend
    more, steep, curved = wave(p.period, p.waves, r + value)
    along = 1.0 + slope  # of the place on the drive, per reading
    value += grown * (r - p.fixed) + more
    slope += grown + steep * along
    bend += steep * bend + curved * along * along
    return value, slope, bend, (up - down) * (1.0 + steep)


@kernel
def across(p: Tables, places: Any) -> tuple[float, float, float]:
    """Deviation, slope and curvature by the place of another axis."""
    if p.other < 0 or math.isnan(places[p.other]):
        return 0.0, 0.0, 0.0
    return curve(p.across_low, p.across_step, p.across, places[p.other])


@kernel
def progress(s: Flank, t: float) -> tuple[float, float, float]:
    """How far a crossing or a push is done, from 0 to 1, its speed and its acceleration.

    A crossing is a quintic; a push speeds up evenly, then slows down evenly.
    """
    if s.length <= 0.0 or t - s.since >= s.length:
        return 1.0, 0.0, 0.0
    u, length = max((t - s.since) / s.length, 0.0), s.length
    if s.pushed > 0.0:
        fastest = 2.0 / length
        if u < s.pushed:
            return u * u / s.pushed, fastest * u / s.pushed, fastest / (s.pushed * length)
        left, rest = 1.0 - u, 1.0 - s.pushed
        return 1.0 - left * left / rest, fastest * left / rest, -fastest / (rest * length)
    done = u * u * u * (10.0 + u * (6.0 * u - 15.0))
    speed = 30.0 * u * u * (1.0 - u) * (1.0 - u) / length
    return done, speed, 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / (length * length)


@kernel
def share_at(s: Flank, t: float) -> float:
    """Share of the upper flank; during a push that of its end, which the load has yet to reach."""
    if s.pushed > 0.0:
        return s.aimed
    done, _, _ = progress(s, t)
    return s.begun + done * (s.aimed - s.begun)


@kernel
def position(
    p: Tables,
    s: Flank,
    reading: float,
    places: Annotated[Any, Meaning("readings of all stages", "m")],
    degrees: Annotated[float, Meaning("temperature; NaN: not measured", "degC")],
    t: float,
) -> float:
    """The position at a reading, with the load on the flank where the set point has it."""
    if math.isnan(p.origin) or math.isnan(reading):
        return reading
    value, _, _, _ = deviation(p, reading - p.origin, share_at(s, t), growth(p, degrees, t))
    off, _, _ = across(p, places)
    return reading + value + off


@kernel
def _braked(p: Tables, target: Target, moves: float) -> bool:
    """Whether a set point brakes a load harder than its friction: it then runs ahead."""
    if math.isinf(p.coast):
        return False
    return (target.acceleration + p.weight) * moves + p.coast < 0.0


@kernel
def _direction(p: Tables, target: Target) -> float:
    """Of a set point that moves: 1 up, -1 down; 0: it is too slow to have one."""
    if target.velocity > p.slow:
        return 1.0
    return -1.0 if target.velocity < -p.slow else 0.0


@kernel
def _rests(target: Target) -> bool:
    return target.velocity == 0.0 and target.acceleration == 0.0


@kernel
def _turn(p: Tables, s: Flank, target: Target) -> Turn:
    moves = _direction(p, target)
    if _rests(target):
        return Turn(1.0, math.nan)
    if moves == 0.0:
        return s.turn
    if moves == s.direction:
        return Turn(0.0, s.turn.place)
    return Turn(0.0, math.nan if s.turn.rested > 0.5 else target.position)


@kernel
def _turned(p: Tables, s: Flank, target: Target, grown: float, t: float) -> Flank:
    """The flank of a set point: where it changes, the drive begins to cross its backlash.

    The drive pushes the load with its rear flank. Where the set point brakes harder than friction,
    the load runs ahead to the front flank, and comes to rest somewhere between. Once the set point
    is at rest, the drive pushes it the rest of the way.
    """
    moves = _direction(p, target)
    rests = _rests(target)
    direction = s.direction if moves == 0.0 else moves
    rear = 0.5 + 0.5 * direction
    if direction == 0.0 or (not rests and moves == 0.0):
        return s
    front = moves != 0.0 and _braked(p, target, moves)
    if not front and moves != 0.0 and direction == s.direction and s.aimed != rear:
        front = target.acceleration * moves < 0.0  # braked so softly, it will not come back
    aimed, wanted = rear, direction * p.stop
    if front:
        aimed, wanted = 1.0 - rear, -direction * p.spare
    if aimed == s.aimed and direction == s.direction:
        return s
    done, _, _ = progress(s, t)
    share, off = s.begun + done * (s.aimed - s.begun), s.off + done * (s.wanted - s.off)
    _, _, _, gap = deviation(p, target.position - p.origin, share, grown)
    way = abs((share - aimed) * gap) + abs(wanted - off)
    if not rests:
        length = math.sqrt(_QUINTIC * way / p.acceleration)
        return Flank(direction, share, aimed, off, wanted, t, length, 0.0, s.turn)
    length = 2.0 * math.sqrt(way / min(_BOUNCE * p.coast, p.acceleration))
    return Flank(direction, share, aimed, off, wanted, t, max(length, p.least), 0.5, s.turn)


@kernel
def aimed(
    p: Tables,
    s: Flank,
    target: Target,
    places: Annotated[Any, Meaning("set points of all stages", "m")],
    speeds: Annotated[Any, Meaning("their speeds", "m/s")],
    degrees: Annotated[float, Meaning("temperature; NaN: not measured", "degC")],
    t: float,
) -> tuple[Annotated[Flank, Meaning(name="flank")], Annotated[Target, Meaning(name="target")]]:
    """The set point of the reading at which the stage is at its set point."""
    if math.isnan(p.origin):
        return s, target
    turn, grown = _turn(p, s, target), growth(p, degrees, t)
    s = _turned(p, s, target, grown, t)
    s = Flank(s.direction, s.begun, s.aimed, s.off, s.wanted, s.since, s.length, s.pushed, turn)
    done, speed, push = progress(s, t)
    share = s.begun + done * (s.aimed - s.begun)
    off = s.off + done * (s.wanted - s.off)
    beside, beside_slope, beside_bend = across(p, places)
    wanted, velocity, acceleration = (
        target.position - p.origin,
        target.velocity,
        target.acceleration,
    )
    if p.other >= 0:
        others = speeds[p.other]
        wanted -= beside
        velocity -= beside_slope * others
        acceleration -= beside_bend * others * others
    r = wanted - deviation(p, wanted, share, grown)[0]
    for _ in range(_ROUNDS):
        value, slope, _, _ = deviation(p, r, share, grown)
        r -= (r + value - wanted) / (1.0 + slope)
    _, slope, bend, gap = deviation(p, r, share, grown)
    way, more = (s.aimed - s.begun) * gap, s.wanted - s.off
    v = (velocity - way * speed) / (1.0 + slope)
    a = (acceleration - way * push - bend * v * v) / (1.0 + slope)
    return s, Target(r + p.origin + off, v + more * speed, a + more * push, target.turn)


@kernel
def effort(
    p: Tables,
    s: Flank,
    target: Annotated[Target, Meaning("set point of the position")],
    aim: Annotated[Target, Meaning("set point of the reading")],
    reading: float,
    t: float,
) -> float:
    """Effort against what repeats along the travel, by the direction of the set point.

    While it pushes, the drive is free until it meets the load: the law's effort against friction
    is taken off, so that the load is met from behind in any case.
    """
    if math.isnan(p.origin) or math.isnan(reading):
        return 0.0
    r = reading - p.origin
    up, _, _ = curve(p.low, p.effort_step, p.effort_up, r)
    down, _, _ = curve(p.low, p.effort_step, p.effort_down, r)
    value, _, _ = wave(p.effort_period, p.effort_waves, r)
    if not math.isnan(s.turn.place):
        left = math.exp(-abs(target.position - s.turn.place) / p.turn_way)
        back = math.copysign(p.turn_effort, target.velocity)
        value += left * (p.turn_damping * target.velocity - back)
    if s.pushed > 0.0 and t - s.since < s.length:
        value -= math.copysign(p.friction, aim.velocity)
    if aim.velocity > p.slow:
        return value + up
    if aim.velocity < -p.slow:
        return value + down
    return value + 0.5 * (up + down)
