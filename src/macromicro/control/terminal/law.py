"""Full effort on the way, a landing of least energy, and impulses for the last counts.

The start is shaped for the belt: the effort beyond friction comes in two steps half a swing apart,
which leave none (Singer and Seering, 1990), or in three, which bear another frequency. From the
first period on in which a landing (`landing`) keeps within the effort, it is planned anew every
period over a horizon that shrinks.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.columns import Quantity
from macromicro.control.stage_law import Sample, StageLaw, Target
from macromicro.control.terminal import estimate, landing, model
from macromicro.control.terminal.adapting import adapted
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
    """What the law is doing.

    Attributes
    ----------
    mode : float
        REST, WAY, LAND, INCH or TRACK.
    left : float
        Periods of a landing or an impulse.
    gone : float
        Time in it, s.
    level : float
        Effort of an impulse, V.
    short : float
        How far before the goal a way is to end, m.
    """

    mode: float
    left: float
    gone: float
    level: float
    short: float


class Memory(NamedTuple):
    """What the law remembers."""

    x: float  # m
    v: Annotated[float, Quantity("mm/s", "speed by the law's estimator", column="speed", scale=1e3)]
    q: float  # m
    s: float  # m/s
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
    left: float  # periods of a landing or an impulse
    gone: float  # s in this mode
    goal: float  # m
    level: float  # V, of an impulse
    short: float  # m, how far before the goal a way is to end
    one: float  # V, efforts of the last periods
    two: float
    three: float


@kernel
def start(p: Terminal, sample: Sample) -> Memory:
    """At rest where the sample is.

    Parameters
    ----------
    p : Terminal
        Model.
    sample : Sample
        The first.

    Returns
    -------
    Memory
        The goal is there.
    """
    return _at_rest(p, sample.position, 0.0, estimate.FIRST * estimate.FIRST)


@kernel
def again(p: Terminal, memory: Memory, sample: Sample) -> Memory:
    """At rest after a pause: the friction that was found is kept, and how well it is known.

    Parameters
    ----------
    p : Terminal
        Model.
    memory : Memory
        Of the last period before it.
    sample : Sample
        The first after it.

    Returns
    -------
    Memory
        The goal is where the sample is.
    """
    known = min(memory.ff + p.wander * p.wander, estimate.FIRST * estimate.FIRST)
    return _at_rest(p, sample.position, memory.excess, known)


@kernel
def _at_rest(p: Terminal, reading: float, excess: float, known: float) -> Memory:
    """Nothing has moved: friction, and its variance, are told."""
    b = estimate.standing(p, reading, excess)
    m, c = b.motion, b.spread
    return Memory(
        m.x, m.v, m.q, m.s, b.excess, c.xx, c.xv, c.xf, c.vv, c.vf, known,
        c.qx, c.qv, c.qf, c.sx, c.sv, c.sf,
        REST, 0.0, QUIET, m.x, 0.0, 0.0, 0.0, 0.0, 0.0,
    )  # fmt: skip


@kernel
def _whole(p: Terminal, dt: float) -> tuple[bool, float]:
    """Whether the delay holds a whole period, and the rest of it, s."""
    late = min(p.delay, 2.0 * dt)
    return late >= dt, late - dt if late >= dt else late


@kernel
def _now(p: Terminal, m: Memory, reading: float, dt: float) -> Belief:
    """The belief of this period: what was sent before has acted, and a count was read."""
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
    """Where the carriage will be when an effort of this period begins to act."""
    late, part = _whole(p, dt)
    at = b.motion
    if part > 0.0:
        at = model.moved(p, at, b.excess, m.two if late else m.one, part)
    return model.moved(p, at, b.excess, m.one, dt) if late else at


@kernel
def _impulse(p: Terminal, excess: float, way: float, dt: float) -> tuple[float, float]:
    """Periods and effort (V) of an impulse that moves the carriage by a way (m, 0 or more).

    It gains speed with A for m periods and loses it with B by friction alone:
    way = m^2 dt^2 (A + A^2 / B) / 2.
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
    """Length of a landing."""
    return int(min(max(math.floor(p.horizon / dt + 0.5), FEWEST), MOST))


@kernel
def shaped(p: Terminal, gone: float) -> float:
    """By what a start still divides the effort beyond friction.

    Steps half a swing apart, 1 and 1, each with the swing's decay up to it; with a specified
    insensitivity d 1, 2 cos(pi d) and 1. These leave nothing of a swing whose frequency is off by
    d, and of one in between at most tan(pi d / 2)^2 of what a single step leaves (Singhose,
    Seering, Singer, J. Mech. Design 116 (1994) 654).

    Parameters
    ----------
    p : Terminal
        Model.
    gone : float
        Time on the way, s.

    Returns
    -------
    float
        1 from the last step on.
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
    """Effort on the way: full, but for a shaped start."""
    parts = shaped(p, gone)
    if parts <= 1.0:
        return sign * p.full
    f = model.friction(p, b.excess, b.motion.v)
    return sign * (f + max(p.full - f, 0.0) / parts)


@kernel
def _landed(
    p: Terminal, modes: landing.Modes, at: Motion, goal: float, excess: float, periods: int
) -> tuple[bool, float]:
    """Whether a landing keeps within the effort, and its first effort, V."""
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
) -> tuple[Memory, float]:
    """One period of the law.

    Parameters
    ----------
    p : Terminal
        Model.
    memory : Memory
        Of the law.
    target : Target
        m; the lower edge of the wanted count.
    sample : Sample
        m; the lower edge of the count.
    dt : float
        Control period, s.

    Returns
    -------
    memory : Memory
        New memory.
    effort : float
        V.
    """
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
    """A way begins: from rest with a shaped start, and a short one with something left."""
    if b.motion.v != 0.0:
        return Stage(WAY, 0.0, _BEGUN, 0.0, 0.0)
    way = goal - b.motion.x
    share = min(max(2.0 - abs(way) / _UNSURE, 0.0), 1.0)
    return Stage(WAY, 0.0, 0.0, 0.0, _LEFT * share * way)


@kernel
def _corrected(p: Terminal, b: Belief, goal: float, dt: float) -> Stage:
    """The impulse that closes what is missing."""
    way = goal - b.motion.x
    if p.frequency > 0.0 and abs(way) > _TWICE * p.pitch:
        way *= 0.5  # the other half follows about half a swing later, and takes it back
    periods, level = _impulse(p, b.excess, abs(way), dt)
    return Stage(INCH, periods, 0.0, math.copysign(level, way), 0.0)


@kernel
def _driven(
    p: Terminal, s: Stage, b: Belief, at: Motion, goal: float, dt: float
) -> tuple[Stage, float]:
    """On the way, or landing: where that leads, and the effort."""
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
    """Whether even full braking would stop no more than at the goal."""
    f = model.friction(p, b.excess, at.v)
    way = 0.5 * at.v * at.v / (p.push * (f + p.full) + p.drag * abs(at.v))
    return bool(at.v * (goal - at.x) > 0.0 and way >= abs(goal - at.x))


@kernel
def _followed(p: Terminal, b: Belief, at: Motion, target: Target, dt: float) -> float:
    """Effort along a trajectory: friction, its acceleration, and feedback of place and speed."""
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
    "terminal", Terminal, Memory, start, step, compensated=False, again=again, kept=adapted
)
