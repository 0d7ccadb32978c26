"""The quickest moves of the micro-stage of a bench, for judging laws.

Full heat contracts, and no heat extends, at the largest rate: the place rises with the heat
content, so no other course of CTRL is ahead of these two at any time.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from macromicro.arrays import own
from macromicro.errors import InputError
from macromicro.kernel import compiled, kernel
from macromicro.nominal import PERIOD
from macromicro.plant import bench
from macromicro.plant.bench import Bench, Noise, Plant, Sensors, State
from macromicro.types import Outputs

_LONGEST = 60_000  # periods
NEAR = 10e-6  # m


class QuickestFine(NamedTuple):
    # start, place: from where to where, m
    start: float
    place: float
    time: float  # s, from the command until it is near


@kernel
def _until(p: Plant, s: State, ctrl: float, low: float, high: float, dt: float) -> int:
    """Periods of `ctrl` until the contraction is between `low` and `high`; changes the state."""
    for k in range(_LONGEST):
        if low <= s.micro.wire.x <= high:
            return k
        s = bench.advance(p, s, Outputs(0.0, ctrl, 0.0, 0.0), Noise(0.0, 0.0, 0.0), dt)
    return -1


@kernel
def _held(p: Plant, s: State, goal: float, periods: int, dt: float) -> State:
    """The bench after a hold: full heat below the place, none above. Changes the state."""
    for _ in range(periods):
        ctrl = p.amplifier.full_scale if s.micro.wire.x < goal else 0.0
        s = bench.advance(p, s, Outputs(0.0, ctrl, 0.0, 0.0), Noise(0.0, 0.0, 0.0), dt)
    return s


def quickest(plant: Plant, state: State, goal: float, near: float = NEAR) -> float:
    x = state.micro.wire.x
    ctrl = plant.amplifier.full_scale if goal > x else 0.0
    low, high = (goal - near, 1.0) if goal > x else (-1.0, goal + near)
    taken = compiled(_until)(plant, own(state), ctrl, low, high, PERIOD)
    if taken < 0:
        raise InputError(
            "place", f"{1e3 * goal:.3g} mm", "a place that the stage reaches within a minute"
        )
    return taken * PERIOD


def turns(
    machine: Bench, sensors: Sensors, places: Sequence[float], hold: float = 3.0
) -> list[QuickestFine]:
    """The quickest moves of the micro-stage from place to place, beginning cold and extended."""
    p = bench.prepare(machine, sensors)
    state, found = bench.initial(p), []
    for place in places:
        if place < 0.0:
            raise InputError("place", f"{1e3 * place:.3g} mm", "a contraction of 0 mm or more")
        start = state.micro.wire.x
        found.append(QuickestFine(start, place, quickest(p, state, place)))
        state = compiled(_held)(p, state, place, round(hold / PERIOD), PERIOD)
    return found
