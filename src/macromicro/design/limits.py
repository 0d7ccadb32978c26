"""The quickest moves that a bench allows, by its own parameters, for judging laws.

The quickest move of the carriage is full effort, one period without, full effort the other way
until it stands. Friction and drag only shorten the braking, so one change of sign is optimal
for place and speed (Bryson and Ho, Applied Optimal Control, 1975, Section 3.9); the swing of
the belt is not damped.
"""

from __future__ import annotations

from typing import NamedTuple

from macromicro.errors import InputError
from macromicro.kernel import compiled, kernel
from macromicro.nominal import PERIOD
from macromicro.plant import amplifier, bench, carriage
from macromicro.plant.bench import Bench, Plant, Sensors
from macromicro.plant.carriage import MacroState

_LONGEST = 20_000  # periods
_HALVINGS = 40


class Quickest(NamedTuple):
    distance: float  # m
    time: float  # from the command until the carriage stays within a count of its target, s
    full: int  # periods of full effort
    off: float  # where it comes to rest, less the target, m


@kernel
def _gone(
    p: Plant, s: MacroState, volts: float, full: int, between: float, near: float, dt: float
) -> tuple[float, float]:
    """Where the carriage comes to rest, and when it comes within a distance of `near`.

    From rest at 0: `full` periods of `volts`, one of `between`, then of -`volts` until it stands.
    An effort acts one period after it is sent, as on the bench.
    """
    latched, arrived = 0.0, 0
    for k in range(_LONGEST):
        sent = volts if k < full else (between if k == full else -volts)
        drive = amplifier.motor_volts(p.amplifier, latched, s.i)
        s = carriage.advance(p.macro, s, drive, dt, p.macro_steps)
        if k > full + 1 and s.v <= 0.0:
            break
        latched = amplifier.convert(p.amplifier, sent)
        if s.x < near:
            arrived = k + 1
    return s.x, arrived * dt


def quickest(machine: Bench, sensors: Sensors, distance: float) -> Quickest:
    if not distance > 0.0:
        raise InputError("distance", distance, "a length above zero")
    p = bench.prepare(machine, sensors)
    volts, pitch, start = machine.amplifier.full_scale, sensors.encoder.pitch, carriage.at_rest(0.0)

    def run(full: int, between: float, near: float) -> tuple[float, float]:
        return compiled(_gone)(p, start, volts, full, between, near, PERIOD)

    low, high = 0, 1
    while run(high, volts, distance)[0] < distance:
        low, high = high, 2 * high
        if high > _LONGEST // 2:
            raise InputError(
                "distance", f"{1e3 * distance:.3g} mm", "a distance that takes less than 20 s"
            )
    while high - low > 1:  # so many whole periods fall short, one more does not
        middle = (low + high) // 2
        short = run(middle, volts, distance)[0] < distance
        low, high = (middle, high) if short else (low, middle)
    least, most = -volts, volts
    for _ in range(_HALVINGS):
        between = 0.5 * (least + most)
        short = run(high, between, distance)[0] < distance
        least, most = (between, most) if short else (least, between)
    rest, arrived = run(high, least, distance - pitch)
    return Quickest(distance, arrived, high, rest - distance)
