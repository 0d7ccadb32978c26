"""An eccentric load of a rotary axis: gravity torque over the angle, found in small steps."""

# The breakaway efforts are symmetric about the gravity torque. They are measured both ways at
# places that move outwards, each as far as the torque can be predicted; the fitted sine and cosine
# are then compensated.

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from macromicro.arrays import Array
from macromicro.commission import _weight
from macromicro.commission._probing import Creep, Direction, direction, started
from macromicro.commission._weight import Weight
from macromicro.commission.stand import BALANCED, Caution, CommissionError, Pull, Stand

OFFSETS = tuple(math.radians(a) for a in (4.0, 12.0, 28.0, 55.0, 90.0, 125.0, 160.0))
_PUSH = 3.0  # breakaways that an end holds against: gravity there is foretold, no more
_ABOUT = 1.15  # times the breakaway: where ramps begin, over that (`probing`)
_CLEAR = 5.0  # standard errors, and
_LEAST = 0.03  # parts of the friction, that a torque of gravity is larger than
_HALF = 0.5  # of the squares that a constant torque leaves: sine and cosine leave less
_FEW = 4  # places that tell anything


def found(
    stand: Stand, caution: Caution, speed: float, lifted: float, window: tuple[float, float]
) -> Weight:
    """Effort that holds a rotary load at any angle; the stand applies it from now on."""
    first, way = _begun(stand, caution, speed, lifted)
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
    held = judged(np.array(at), np.array(torque), friction)
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


def fitted(at: Array, torque: Array) -> Pull:
    """Minimum-norm sine and cosine for torques at some angles."""
    table = np.stack([np.sin(at), np.cos(at)], axis=1)
    return Pull(*np.linalg.lstsq(table, torque, rcond=1e-3)[0].tolist())


def judged(at: Array, torque: Array, friction: float) -> Pull | None:
    """The gravity torque, if significant."""
    if len(at) < _FEW:
        return None
    pull = fitted(at, torque)
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


def _begun(stand: Stand, caution: Caution, speed: float, lifted: float) -> tuple[Weight, Direction]:
    """Effort that holds the load where it stands, off an end stop, and the breakaway there."""
    free = caution._replace(speed=math.inf, low=-math.inf, high=math.inf)
    sinks = _weight.sunk(stand, free)
    ways = (sinks,) if sinks else (-1.0, 1.0)
    try:
        way = direction(stand, caution, True)
    except CommissionError:
        leant = _lifted(stand, free, ways, speed, lifted)
        if leant is None:
            raise
        return leant, direction(stand, caution, True)
    end = _end(stand, way, caution._replace(speed=speed), lifted)
    if not end:
        return Weight(0.0, 0.0), way
    # An elastic end gives both ways, and is no place to learn anything.
    stand.sign, stand.hold, stand.pull = 1.0, 0.0, BALANCED
    stand.rest(free, _weight.SINKING)
    leant = _lifted(stand, free, (end,), speed, lifted)
    if leant is None:
        raise CommissionError(
            f"the axis stands at an end, and {caution.effort:.3g} V do not bring it off. Turn "
            "it away, or allow a larger --effort"
        )
    return leant, direction(stand, caution, True)


def _lifted(
    stand: Stand, free: Caution, ends: Sequence[float], speed: float, lifted: float
) -> Weight | None:
    """The weight after lifting off the first possible end; None where it leans on none."""
    raised = (_weight.off_its_end(stand, free, end, speed, lifted) for end in ends)
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
    stand.pull = fitted(np.array(at), np.array(torque))


def _crept(stand: Stand, target: float, friction: float, caution: Caution) -> bool:
    """Creep to an angle; False if an end stop prevents it."""
    start = stand.position()
    way = 1.0 if target > start else -1.0
    law = Creep(way, caution.speed, friction, stand.dt, target, _PUSH, stand.pitch)
    wide = caution._replace(speed=math.inf)
    record = stand.drive(law, 4.0 * abs(target - start) / caution.speed + 5.0, wide)
    stand.rest(caution)
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
            one = started(stand, sign, caution, way.noise, _ABOUT * friction, True)
            efforts.append(one.effort)
        except CommissionError:
            return None
    return start + stand.sign * 0.5 * (efforts[0] - efforts[1])
