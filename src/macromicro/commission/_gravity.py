"""A weight or an eccentric load: found, held and measured before anything else moves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.commission._probing import (
    MOVED,
    PATIENCE,
    Creep,
    Direction,
    Ramp,
    crept,
    direction,
    find_breakaway,
)
from macromicro.commission.courses import QUIET, quiet
from macromicro.commission.stand import BALANCED, Caution, CommissionError, Pull, Stand

# Without effort the axis sinks, to its lower end at the latest. The effort rises until the weight
# is lifted and falls until it stays; the breakaway efforts are symmetric about the weight.

SINKING = 20.0  # s in which it must come to its end
_RAMP = 8.0  # s from no effort to the largest
_LIFTED = 400.0  # counts, at least
_LOWERED = 0.5  # s in which the effort that lifted it would be lowered to nothing
_OVER = 1.2  # times the effort that lifted it, at most
_STAYS = 0.1  # s without a motion: it is held
_TRIES = 2


class Weight(NamedTuple):
    # effort midway between those that start it either way, V at the D/A; 0 where it stays without
    hold: float
    breakaway: float  # effort beyond `hold` that starts it, V; 0 where none holds it
    # sine, cosine: effort that holds an eccentric load that turns, V at the D/A: so many times the
    # angle's sine and cosine, counted as its encoder does in this session
    sine: float = 0.0
    cosine: float = 0.0
    error: float = 0.0  # standard error of these, V

    @property
    def pull(self) -> Pull:
        """Its part that depends on the angle."""
        return Pull(self.sine, self.cosine, self.error)


class Lift:
    """Effort that rises until a weight is lifted, and falls until it stays; `sinks` in counts."""

    def __init__(
        self, ramp: Ramp, sinks: float, pitch: float, lifted: float, speed: float, dt: float
    ) -> None:
        self.ramp, self.sinks, self.pitch = ramp, sinks, pitch
        self.lifted, self.speed, self.dt = max(lifted, _LIFTED * pitch), speed, dt
        self.effort, self.start, self.at, self.since = 0.0, math.nan, math.nan, 0.0
        self.pressed = self.held = self.slowing = False

    def __call__(self, t: float, x: float, v: float) -> float | None:
        """Effort of this period; None when it is held, or pressed on its end."""
        if math.isnan(self.start):
            self.start = x
        up = -self.sinks * (x - self.start)
        if not self.ramp.slid:
            self.pressed = -up > self.ramp.enough
            given = None if self.pressed else self.ramp(t, x, v)
            self.effort = self.ramp.effort
            return self.ramp.way * self.effort if self.ramp.slid else given
        rising = -self.sinks * v
        self.slowing = self.slowing or up >= self.lifted
        if not abs(x - self.at) < 1.5 * self.pitch:
            self.at, self.since = x, t
        stood = t - self.since
        if not self.slowing:
            change = self.ramp.effort / _LOWERED * self.dt
            if rising > self.speed:
                self.effort -= change
            elif rising < self.speed / 3.0:
                self.effort = min(self.effort + 0.1 * change, _OVER * self.ramp.effort)
            if stood >= _STAYS and self.effort >= _OVER * self.ramp.effort:
                self.ramp.again(x, self.effort)  # what slid was an end that is elastic
            return self.ramp.way * self.effort
        if stood < 0.2 * _STAYS and rising:  # between two counts it may go on, or stand
            self.effort -= math.copysign(self.ramp.effort / _LOWERED * self.dt, rising)
        self.held = stood >= _STAYS
        return None if self.held else self.ramp.way * self.effort


def find_weight(stand: Stand, caution: Caution, speed: float, lifted: float) -> Weight:
    """Whether the axis sinks, and the effort that holds it, which the stand applies from now on."""
    free = caution.anywhere._replace(speed=math.inf)
    sinks = sunk(stand, free)
    if not sinks:
        return Weight(0.0, 0.0)
    held = off_its_end(stand, free, sinks, speed, lifted)
    if held is None:
        raise CommissionError(
            f"the axis sinks without effort, and {caution.effort:.3g} V of either sign do not "
            "lift and hold it. Check the amplifier and any brake, or allow a larger --effort"
        )
    return held


def sunk(stand: Stand, caution: Caution) -> float:
    """Sinking without effort, in counts."""
    still = quiet(stand, caution)
    start, waited = float(still.x[0]), 0.0
    if np.ptp(still.x) <= MOVED * stand.pitch:
        return 0.0
    while np.ptp(still.x) > MOVED * stand.pitch:  # what swings stands for a while as it turns
        if waited > SINKING or not stand.rest(caution, SINKING):
            raise CommissionError(
                f"the axis moves without effort, and still does after {SINKING:.0f} s. Hold "
                "or balance it first"
            )
        still = quiet(stand, caution)
        waited += QUIET
    return math.copysign(1.0, stand.position() - start)


def off_its_end(
    stand: Stand, caution: Caution, sinks: float, speed: float, lifted: float
) -> Weight | None:
    """Lift a load off its end, and hold it from now on; `sinks` in counts."""
    for sign in (1.0, -1.0):
        ramp = Ramp(
            sign, 0.0, caution.effort / _RAMP * stand.dt, caution.effort, MOVED * stand.pitch
        )
        law = Lift(ramp, sinks, stand.pitch, lifted, speed, stand.dt)
        stand.drive(law, PATIENCE + 2.0 * _RAMP, caution)
        if law.held:
            return _measure_weight(stand, sign, sign * law.effort, caution)
        stand.rest(caution, SINKING)
    return None


def _measure_weight(stand: Stand, sign: float, hold: float, caution: Caution) -> Weight:
    stand.hold, up, down = hold, 0.0, 0.0
    for _ in range(_TRIES):
        up = find_breakaway(stand, sign, caution, 0.0).effort
        down = find_breakaway(stand, -sign, caution, 0.0).effort
        stand.hold += 0.5 * sign * (up - down)
    return Weight(stand.hold, 0.5 * (up + down))


# The breakaway efforts are symmetric about the gravity torque. They are measured both ways at
# places that move outwards, each as far as the torque can be predicted; the fitted sine and cosine
# are then compensated.

OFFSETS = tuple(math.radians(a) for a in (4.0, 12.0, 28.0, 55.0, 90.0, 125.0, 160.0))
_PUSH = 3.0  # breakaways that an end holds against: gravity there is foretold, no more
_ABOUT = 1.15  # times the breakaway: where ramps begin, over that (`probing`)
_CLEAR = 5.0  # standard errors, and
_LEAST = 0.03  # parts of the friction, that a torque of gravity is larger than
_HALF = 0.5  # of the squares that a constant torque leaves: sine and cosine leave less
_FEW = 4  # places that tell anything


def balance(
    stand: Stand, caution: Caution, speed: float, lifted: float, window: tuple[float, float]
) -> Weight:
    """Effort that holds a rotary load at any angle; the stand applies it from now on."""
    first, way = _first_hold(stand, caution, speed, lifted)
    friction = way.friction
    slow = caution._replace(speed=speed)
    at = [stand.position()]
    torque = [stand.hold + stand.sign * way.constant]
    stand.hold = 0.0
    try:
        _hold(stand, at, torque)
        for side in (1.0, -1.0):
            for offset in OFFSETS:
                target = at[0] + side * offset
                if not window[0] <= target <= window[1]:
                    break
                if not _crept(stand, target, friction, slow):
                    break
                one = _torque(stand, way, friction, caution)
                if one is None:
                    break
                at.append(stand.position())
                torque.append(one)
                _hold(stand, at, torque)
            # Between sides: where it began may be next to an end.
            _crept(stand, at[0], friction, slow)
        _crept(stand, 0.5 * (min(at) + max(at)), friction, slow)
    finally:
        stand.sign = 1.0
    held = significant(np.array(at), np.array(torque), friction)
    if held is None:
        stand.hold, stand.pull = first.hold, BALANCED
        return first
    if held.most + friction > caution.effort:
        raise CommissionError(
            f"gravity takes up to {held.most:.3g} V on its eccentric load and friction "
            f"{friction:.3g} V, but the limit is {caution.effort:.3g} V. Balance it, or allow "
            "a larger --effort"
        )
    stand.pull = held
    return Weight(0.0, friction, held.sine, held.cosine, held.error)


def gravity(at: Array, torque: Array) -> Pull:
    """Minimum-norm sine and cosine for torques at some angles."""
    table = np.stack([np.sin(at), np.cos(at)], axis=1)
    return Pull(*np.linalg.lstsq(table, torque, rcond=1e-3)[0].tolist())


def significant(at: Array, torque: Array, friction: float) -> Pull | None:
    """The gravity torque, if significant."""
    if len(at) < _FEW:
        return None
    pull = gravity(at, torque)
    left = float(np.sum((torque - pull.along(at)) ** 2))
    table = np.stack([np.sin(at), np.cos(at)], axis=1)
    spread = left / (len(at) - 2) * np.linalg.pinv(table.T @ table)
    error = math.sqrt(float(np.trace(spread)))
    if pull.most < max(_CLEAR * error, _LEAST * friction):
        return None
    if left >= _HALF * float(np.sum((torque - torque.mean()) ** 2)):
        return None
    # Friction that differs from way to way is a torque, too.
    return pull._replace(error=math.hypot(error, _LEAST * friction))


def _first_hold(
    stand: Stand, caution: Caution, speed: float, lifted: float
) -> tuple[Weight, Direction]:
    """Effort that holds the load where it stands, off an end stop, and the breakaway there."""
    free = caution.anywhere._replace(speed=math.inf)
    sinks = sunk(stand, free)
    ways = (sinks,) if sinks else (-1.0, 1.0)
    try:
        way = direction(stand, caution, True)
    except CommissionError:
        leant = _lift_off(stand, free, ways, speed, lifted)
        if leant is None:
            raise
        return leant, direction(stand, caution, True)
    end = _end(stand, way, caution._replace(speed=speed), lifted)
    if not end:
        return Weight(0.0, 0.0), way
    # An elastic end gives both ways, and is no place to learn anything.
    stand.sign, stand.hold, stand.pull = 1.0, 0.0, BALANCED
    stand.rest(free, SINKING)
    leant = _lift_off(stand, free, (end,), speed, lifted)
    if leant is None:
        raise CommissionError(
            f"the axis stands at an end, and {caution.effort:.3g} V do not move it away. Turn "
            "it away, or allow a larger --effort"
        )
    return leant, direction(stand, caution, True)


def _lift_off(
    stand: Stand, free: Caution, ends: Sequence[float], speed: float, lifted: float
) -> Weight | None:
    """The weight after lifting off the first possible end; None where it leans on none."""
    raised = (off_its_end(stand, free, end, speed, lifted) for end in ends)
    return next((one for one in raised if one is not None), None)


def _end(stand: Stand, way: Direction, caution: Caution, lifted: float) -> float:
    """Side of an end stop at the present position, 1 or -1 in counts; 0 for none."""
    start, friction = stand.position(), way.friction
    _hold(stand, [start], [stand.sign * way.constant])
    for side in (1.0, -1.0):
        if not _crept(stand, start + side * lifted, friction, caution):
            return side
    _crept(stand, start, friction, caution)
    return 0.0


def _hold(stand: Stand, at: Sequence[float], torque: Sequence[float]) -> None:
    """Apply the torque known so far."""
    stand.pull = gravity(np.array(at), np.array(torque))


def _crept(stand: Stand, target: float, friction: float, caution: Caution) -> bool:
    """Creep to an angle; False if an end stop prevents it."""
    start = stand.position()
    way = 1.0 if target > start else -1.0
    law = Creep(way, caution.speed, friction, stand.dt, target, _PUSH, stand.pitch)
    record = crept(stand, law, abs(target - start), caution)
    if law.stuck or record.ended:
        return False
    if way * (float(record.x[-1]) - target) < 0.0:
        p = stand.place
        raise CommissionError(
            f"the axis does not creep to {p.per * (target - start):.3g} {p.unit} from its "
            "position, where an eccentric load would show. Allow a faster --creep, or use a "
            "finer encoder"
        )
    return True


def _torque(stand: Stand, way: Direction, friction: float, caution: Caution) -> float | None:
    """Gravity torque at the present angle, V at the D/A; None at an end stop."""
    start, efforts = stand.pull.at(stand.position()), []
    for sign in (1.0, -1.0):
        try:
            one = find_breakaway(stand, sign, caution, way.noise, _ABOUT * friction, True)
            efforts.append(one.effort)
        except CommissionError:
            return None
    return start + stand.sign * 0.5 * (efforts[0] - efforts[1])
