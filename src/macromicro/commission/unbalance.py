"""An eccentric load that turns: gravity's torque over the angle, found before anything goes far.

What starts it from rest either way lies as far above gravity's torque as below, whatever friction
is. So it is started both ways at places that go out from where it stands, each a little farther
than those from which the torque there could be foretold; sine and cosine that explain all of them
are held from then on, and it goes as a balanced one does.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from macromicro.arrays import Array
from macromicro.commission import weight
from macromicro.commission.probing import Creep, Direction, direction, started
from macromicro.commission.stand import BALANCED, Caution, CommissionError, Pull, Stand
from macromicro.commission.weight import Weight

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
    """What holds a load that turns, wherever it is; the stand holds it from now on.

    Parameters
    ----------
    stand : Stand
        The axis, whose sign nobody knows yet, nor afterwards.
    caution : Caution
        What it may not pass but for the speed: nobody knows how it starts.
    speed : float
        Of the creep, rad/s.
    lifted : float
        How far a load that leans on its end is lifted off it, rad.
    window : tuple[float, float]
        Lowest and highest place that it may be started at, rad.

    Returns
    -------
    Weight
        Sine and cosine; or a constant effort, where that explains as much, and none where it stays
        anywhere.

    Raises
    ------
    CommissionError
        It moves without an end, does not start, or no effort turns its load.
    """
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
            f"gravity takes up to {held.most:.3g} V on its eccentric load and {friction:.3g} V "
            f"start it, and {caution.effort:.3g} V are all that it may be given: balance it, or "
            "allow a larger --effort"
        )
    stand.pull = held
    return Weight(0.0, friction, held.sine, held.cosine, held.error)


def fitted(at: Array, torque: Array) -> Pull:
    """The least sine and cosine that explain torques at some places.

    Parameters
    ----------
    at : ndarray, shape (n,)
        Places, rad.
    torque : ndarray, shape (n,)
        V.

    Returns
    -------
    Pull
        Of one place, the weakest that it may be.
    """
    table = np.stack([np.sin(at), np.cos(at)], axis=1)
    return Pull(*np.linalg.lstsq(table, torque, rcond=1e-3)[0].tolist())


def judged(at: Array, torque: Array, friction: float) -> Pull | None:
    """Gravity's torque, where it is one.

    Parameters
    ----------
    at : ndarray, shape (n,)
        Places, rad.
    torque : ndarray, shape (n,)
        V.
    friction : float
        Effort that starts it, V.

    Returns
    -------
    Pull | None
        None where it is small beside the friction or its own error, or a constant torque explains
        as much.
    """
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
    """What holds it where it stands, off an end on which it leans, and what starts it there."""
    free = caution._replace(speed=math.inf, low=-math.inf, high=math.inf)
    sinks = weight.sunk(stand, free)
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
    stand.rest(free, weight.SINKING)
    leant = _lifted(stand, free, (end,), speed, lifted)
    if leant is None:
        raise CommissionError(
            f"it stands at an end, and {caution.effort:.3g} V do not bring it off: turn it away "
            "from there, or allow a larger --effort"
        )
    return leant, direction(stand, caution, True)


def _lifted(
    stand: Stand, free: Caution, ends: Sequence[float], speed: float, lifted: float
) -> Weight | None:
    """Off the first of these ends that it can be lifted from; None where it leans on none."""
    raised = (weight.off_its_end(stand, free, end, speed, lifted) for end in ends)
    return next((one for one in raised if one is not None), None)


def _end(stand: Stand, way: Direction, caution: Caution, lifted: float) -> float:
    """On which side an end holds it where it stands, 1 or -1 in counts; 0 where none does."""
    start, friction = stand.position(), way.friction
    _hold(stand, [start], [stand.sign * way.constant])
    for side in (1.0, -1.0):
        if not _crept(stand, start + side * lifted, friction, caution):
            return side
    _crept(stand, start, friction, caution)
    return 0.0


def _hold(stand: Stand, at: Sequence[float], torque: Sequence[float]) -> None:
    """Hold it by all that is known."""
    stand.pull = fitted(np.array(at), np.array(torque))


def _crept(stand: Stand, target: float, friction: float, caution: Caution) -> bool:
    """Creep to a place; whether it came there, and was not held by an end."""
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
            f"it does not creep to {p.per * (target - start):.3g} {p.unit} from where it stands, "
            "where an eccentric load would show: let it creep faster (--creep), or give it an "
            "encoder of more counts"
        )
    return True


def _torque(stand: Stand, way: Direction, friction: float, caution: Caution) -> float | None:
    """What gravity takes where it stands, V at the D/A; None where an end holds it."""
    start, efforts = stand.pull.at(stand.position()), []
    for sign in (1.0, -1.0):
        try:
            one = started(stand, sign, caution, way.noise, _ABOUT * friction, True)
            efforts.append(one.effort)
        except CommissionError:
            return None
    return start + stand.sign * 0.5 * (efforts[0] - efforts[1])
