"""Full effort on the way, a minimum-energy landing, and impulses for the last counts.

The start is shaped for the belt by two or three steps (Singer and Seering, 1990); the landing is
replanned every period over a shrinking horizon.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.columns import Meaning, Quantity
from macromicro.control.stage_law import Sample, StageLaw, Target
from macromicro.control.terminal import estimate, landing, model
from macromicro.control.terminal.adapting import adapt
from macromicro.control.terminal.estimate import Belief, Spread
from macromicro.control.terminal.model import FEWEST, MOST, Motion, Terminal
from macromicro.kernel import kernel

REST, WAY, LAND, INCH, TRACK = 0.0, 1.0, 2.0, 3.0, 4.0
QUIET = 0.02  # s without effort or count until the carriage is taken to stand
_TRACKING = 450.0  # 1/s, bandwidth of tracking
_SHORT = 2.0  # periods of the shortest impulse
_LAST = 1  # periods before the end of a landing, in which friction alone ends it
# A short way is over before its friction is known: this share of it is left to impulses, up to a
# way, m, and less of it up to twice that way.
_LEFT, _UNSURE = 0.15, 1e-3
_TWICE = 1.7  # counts: more are made good by two impulses
_BEGUN = 1e3  # s: a way that begins in motion needs no shaped start


class Stage(NamedTuple):
    mode: Annotated[float, Meaning("REST, WAY, LAND, INCH or TRACK")]
    left: Annotated[float, Meaning("periods of a landing or an impulse")]
    gone: Annotated[float, Meaning("time in it", "s")]
    level: Annotated[float, Meaning("effort of an impulse", "V")]
    short: Annotated[float, Meaning("distance before the goal at which a way ends", "m")]


class Memory(NamedTuple):
    x: Annotated[float, Meaning("", "m")]
    v: Annotated[float, Quantity("mm/s", "speed by the law's estimator", column="speed", scale=1e3)]
    q: Annotated[float, Meaning("", "m")]
    s: Annotated[float, Meaning("", "m/s")]
    excess: Annotated[float, Quantity("V", "friction found beyond the model's", column="friction")]
    xx: float
    xv: float
    xf: float
    vv: float
    vf: float
    ff: float
    qx: float
    qv: float
    qf: float
    sx: float
    sv: float
    sf: float
    mode: Annotated[
        float, Quantity("1", "0 rest, 1 way, 2 landing, 3 impulse, 4 tracking", column="mode")
    ]
    left: Annotated[float, Meaning("periods of a landing or an impulse")]
    gone: Annotated[float, Meaning("s in this mode", "s")]
    goal: Annotated[float, Meaning("", "m")]
    level: Annotated[float, Meaning("of an impulse", "V")]
    short: Annotated[float, Meaning("distance before the goal at which a way ends", "m")]
    one: Annotated[float, Meaning("efforts of the last periods", "V")]
    two: float
    three: float


@kernel
def start(p: Terminal, sample: Sample) -> Memory:
    return _at_rest(p, sample.position, 0.0, estimate.FIRST * estimate.FIRST)


@kernel
def again(p: Terminal, memory: Memory, sample: Sample) -> Memory:
    """At rest after a pause; the friction estimate stays."""
    known = min(memory.ff + p.wander * p.wander, estimate.FIRST * estimate.FIRST)
    return _at_rest(p, sample.position, memory.excess, known)


@kernel
def _at_rest(p: Terminal, reading: float, excess: float, known: float) -> Memory:
    """At rest with a friction estimate and its variance."""
    b = estimate.standing(p, reading, excess)
    m, c = b.motion, b.spread
    return Memory(
        m.x, m.v, m.q, m.s, b.excess, c.xx, c.xv, c.xf, c.vv, c.vf, known,
        c.qx, c.qv, c.qf, c.sx, c.sv, c.sf,
        REST, 0.0, QUIET, m.x, 0.0, 0.0, 0.0, 0.0, 0.0,
    )  # fmt: skip


@kernel
def _whole(p: Terminal, dt: float) -> tuple[bool, float]:
    """Whether the delay exceeds a period, and the remainder."""
    late = min(p.delay, 2.0 * dt)
    return late >= dt, late - dt if late >= dt else late


@kernel
def _now(p: Terminal, m: Memory, reading: float, dt: float) -> Belief:
    """The belief after past efforts and this period's count."""
    late, part = _whole(p, dt)
    before, after = (m.three, m.two) if late else (m.two, m.one)
    known = Spread(
        m.xx, m.xv, m.xf, m.vv, m.vf, m.ff, m.qx, m.qv, m.qf, m.sx, m.sv, m.sf
    )  # fmt: skip
    b = Belief(Motion(m.x, m.v, m.q, m.s), m.excess, known)
    if part > 0.0:
        b = estimate.later(p, b, before, part)
    b = estimate.later(p, b, after, dt - part)
    return estimate.seen(p, b, reading)


@kernel
def _ahead(p: Terminal, m: Memory, b: Belief, dt: float) -> Motion:
    """The predicted state when an effort of this period begins to act."""
    late, part = _whole(p, dt)
    at = b.motion
    if part > 0.0:
        at = model.moved(p, at, b.excess, m.two if late else m.one, part)
    return model.moved(p, at, b.excess, m.one, dt) if late else at


@kernel
def _impulse(p: Terminal, excess: float, way: float, dt: float) -> tuple[float, float]:
    """Periods and effort (V) of an impulse that moves the carriage by a distance >= 0.

    It accelerates with A for m periods and decelerates with B by friction:
    distance = m^2 dt^2 (A + A^2 / B) / 2.
    """
    held = model.friction(p, excess, 0.0)
    brake = max(p.push * held, 1e-9)
    periods = _SHORT
    while True:
        span = periods * dt
        gain = 0.5 * brake * (math.sqrt(1.0 + 8.0 * way / (brake * span * span)) - 1.0)
        level = held + gain / p.push
        if level <= p.full - p.reserve or periods >= MOST:
            return periods, min(level, p.full)
        periods += 1.0


@kernel
def _periods(p: Terminal, dt: float) -> int:
    return int(min(max(math.floor(p.horizon / dt + 0.5), FEWEST), MOST))


@kernel
def shaped(p: Terminal, gone: float) -> float:
    """Divisor of the effort beyond friction during a shaped start.

    Steps half a swing apart, 1 and 1, each with the swing's decay up to it; with a specified
    insensitivity d 1, 2 cos(pi d) and 1, which leave at most tan(pi d / 2)^2 of the swing
    (Singhose, Seering, Singer, J. Mech. Design 116 (1994) 654).
    """
    if p.frequency <= 0.0:
        return 1.0
    half, fall = 0.5 / p.frequency, math.exp(-0.5 * p.decay / p.frequency)
    if p.insensitivity <= 0.0:
        return 1.0 if gone >= half else 1.0 + fall
    if gone >= 2.0 * half:
        return 1.0
    middle = 2.0 * math.cos(math.pi * p.insensitivity) * fall
    whole = 1.0 + middle + fall * fall
    return whole / (1.0 + middle) if gone >= half else whole


@kernel
def _pushed(p: Terminal, b: Belief, gone: float, sign: float) -> float:
    """Effort on the way: full, except for a shaped start."""
    parts = shaped(p, gone)
    if parts <= 1.0:
        return sign * p.full
    f = model.friction(p, b.excess, b.motion.v)
    return sign * (f + max(p.full - f, 0.0) / parts)


@kernel
def _landed(
    p: Terminal, modes: landing.Modes, at: Motion, goal: float, excess: float, periods: int
) -> tuple[bool, float]:
    """Whether a landing keeps within the effort, and its first effort."""
    sign = math.copysign(1.0, goal - at.x)
    if at.v != 0.0:
        sign = math.copysign(1.0, at.v)
    f = model.friction(p, excess, at.v)
    plan = landing.planned(p, modes, at, goal, periods)
    first, lowest, highest = landing.efforts(modes, plan, periods)
    most = p.full - p.reserve
    coulomb = max(p.coulomb + excess, 0.0) * sign
    fits = highest + coulomb <= most and lowest + coulomb >= -most
    if at.v == 0.0 and first * sign <= 0.0:
        return fits, 0.0  # it stands, and is not to be pushed away
    return fits, min(max(first + f * sign, -p.full), p.full)


@kernel
def step(
    p: Terminal, memory: Memory, target: Target, sample: Sample, dt: float
) -> tuple[
    Annotated[Memory, Meaning(name="memory")],
    Annotated[float, Meaning("effort", "V", name="effort")],
]:
    m = memory
    b = _now(p, m, sample.position, dt)
    at = _ahead(p, m, b, dt)
    goal = target.position + 0.5 * p.pitch
    tracked = target.velocity != 0.0 or target.acceleration != 0.0
    now = Stage(m.mode, m.left, m.gone + dt, m.level, m.short)
    if tracked:
        now = Stage(TRACK, 0.0, now.gone, 0.0, 0.0)
    elif now.mode == TRACK or abs(goal - m.goal) > 0.5 * p.pitch:
        now = _begun(b, goal)
    if now.mode == REST:
        off = sample.position - target.position
        if b.motion.v == 0.0 and now.gone >= QUIET and abs(off) > 0.5 * p.pitch:
            now = _corrected(p, b, goal, dt)
    effort = 0.0
    if now.mode == INCH:
        effort = now.level
        now = Stage(INCH if now.left > 1.5 else REST, now.left - 1.0, 0.0, now.level, 0.0)
    elif now.mode == TRACK:
        effort = _followed(p, b, at, target, dt)
    elif now.mode != REST:
        now, effort = _driven(p, now, b, at, goal - now.short, dt)
    n, c = b.motion, b.spread
    return Memory(
        n.x, n.v, n.q, n.s, b.excess, c.xx, c.xv, c.xf, c.vv, c.vf, c.ff,
        c.qx, c.qv, c.qf, c.sx, c.sv, c.sf,
        now.mode, now.left, now.gone, goal, now.level, now.short, effort, m.one, m.two,
    ), effort  # fmt: skip


@kernel
def _begun(b: Belief, goal: float) -> Stage:
    """A way begins, with a shaped start from rest."""
    if b.motion.v != 0.0:
        return Stage(WAY, 0.0, _BEGUN, 0.0, 0.0)
    way = goal - b.motion.x
    share = min(max(2.0 - abs(way) / _UNSURE, 0.0), 1.0)
    return Stage(WAY, 0.0, 0.0, 0.0, _LEFT * share * way)


@kernel
def _corrected(p: Terminal, b: Belief, goal: float, dt: float) -> Stage:
    """The impulse that closes the remaining error."""
    way = goal - b.motion.x
    if p.frequency > 0.0 and abs(way) > _TWICE * p.pitch:
        way *= 0.5  # the other half follows about half a swing later, and takes it back
    periods, level = _impulse(p, b.excess, abs(way), dt)
    return Stage(INCH, periods, 0.0, math.copysign(level, way), 0.0)


@kernel
def _driven(
    p: Terminal, s: Stage, b: Belief, at: Motion, goal: float, dt: float
) -> tuple[Stage, float]:
    """Prediction and effort on the way or while landing."""
    modes = landing.modes(p, dt)
    periods = _periods(p, dt) if s.mode == WAY else int(min(max(s.left, 1.0), float(MOST)))
    fits, effort = _landed(p, modes, at, goal, b.excess, periods)
    if s.mode == WAY and not fits and not _late(p, b, at, goal):
        return s, _pushed(p, b, s.gone, math.copysign(1.0, goal - at.x))
    if periods <= _LAST:
        return Stage(REST, 0.0, 0.0, 0.0, 0.0), 0.0
    return Stage(LAND, periods - 1.0, s.gone, 0.0, s.short), effort


@kernel
def _late(p: Terminal, b: Belief, at: Motion, goal: float) -> bool:
    """Whether even full braking would only just stop at the goal."""
    f = model.friction(p, b.excess, at.v)
    way = 0.5 * at.v * at.v / (p.push * (f + p.full) + p.drag * abs(at.v))
    return bool(at.v * (goal - at.x) > 0.0 and way >= abs(goal - at.x))


@kernel
def _followed(p: Terminal, b: Belief, at: Motion, target: Target, dt: float) -> float:
    """Effort along a trajectory: friction, acceleration, feedback."""
    ahead = min(p.delay, 2.0 * dt)
    v = target.velocity + ahead * target.acceleration
    x = target.position + 0.5 * p.pitch + ahead * target.velocity
    off, faster = x - at.x, v - at.v
    sign = 0.0
    if v != 0.0:
        sign = math.copysign(1.0, v)
    f = model.friction(p, b.excess, v) * sign
    wanted = target.acceleration + _TRACKING * _TRACKING * off + 2.0 * _TRACKING * faster
    return min(max(f + (wanted + p.drag * v) / p.push, -p.full), p.full)


TERMINAL = StageLaw(
    "terminal",
    Terminal,
    Memory,
    start,
    step,
    compensated=False,
    again=again,
    kept=adapt,
    model_of="macro",
)
