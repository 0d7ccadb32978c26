"""An unsupported weight: found, held and measured before anything else moves."""

# Without effort the axis sinks, to its lower end at the latest. The effort rises until the weight
# is lifted and falls until it stays; the breakaway efforts are symmetric about the weight.

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from macromicro.commission._probing import MOVED, PATIENCE, Ramp, started
from macromicro.commission.stand import SENSOR, Caution, CommissionError, Pull, Stand

QUIET = 0.5  # s without effort, which show whether it sinks
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


def found(stand: Stand, caution: Caution, speed: float, lifted: float) -> Weight:
    """Whether the axis sinks, and the effort that holds it, which the stand applies from now on."""
    free = caution._replace(speed=math.inf, low=-math.inf, high=math.inf)
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
    quiet = stand.drive(lambda t, x, v: 0.0, QUIET, caution)
    if quiet.ended == SENSOR:
        raise CommissionError("the encoder gives no value. Check its cable and supply")
    start, waited = float(quiet.x[0]), 0.0
    if np.ptp(quiet.x) <= MOVED * stand.pitch:
        return 0.0
    while np.ptp(quiet.x) > MOVED * stand.pitch:  # what swings stands for a while as it turns
        if waited > SINKING or not stand.rest(caution, SINKING):
            raise CommissionError(
                f"the axis moves without effort, and still does after {SINKING:.0f} s. Hold "
                "or balance it first"
            )
        quiet = stand.drive(lambda t, x, v: 0.0, QUIET, caution)
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
            return _measured(stand, sign, sign * law.effort, caution)
        stand.rest(caution, SINKING)
    return None


def _measured(stand: Stand, sign: float, hold: float, caution: Caution) -> Weight:
    stand.hold, up, down = hold, 0.0, 0.0
    for _ in range(_TRIES):
        up = started(stand, sign, caution, 0.0).effort
        down = started(stand, -sign, caution, 0.0).effort
        stand.hold += 0.5 * sign * (up - down)
    return Weight(stand.hold, 0.5 * (up + down))
