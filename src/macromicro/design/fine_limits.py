"""What the micro-stage of a bench can do at best from where it is: for judging laws alone.

Full heat contracts as quickly as can be, no heat extends as quickly: the place rises with the heat
content, and that with the heat, so no other course of CTRL is ahead of these two at any time.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from macromicro.errors import InputError
from macromicro.kernel import compiled, kernel
from macromicro.nominal import PERIOD
from macromicro.plant import bench
from macromicro.plant.bench import Bench, Noise, Plant, Sensors, State
from macromicro.types import Outputs

_LONGEST = 60_000  # periods
NEAR = 10e-6  # m


class QuickestFine(NamedTuple):
    """The quickest way of the micro-stage to a place.

    Attributes
    ----------
    start, place : float
        From where to where, m.
    time : float
        s, from the command until it is near.
    """

    start: float
    place: float
    time: float


@kernel
def _until(p: Plant, s: State, ctrl: float, low: float, high: float, dt: float) -> int:
    """Periods of `ctrl` until the contraction is within `low` and `high` (m); changes the state."""
    for k in range(_LONGEST):
        if low <= s.micro.wire.x <= high:
            return k
        s = bench.advance(p, s, Outputs(0.0, ctrl, 0.0, 0.0), Noise(0.0, 0.0, 0.0), dt)
    return -1


@kernel
def _held(p: Plant, s: State, goal: float, periods: int, dt: float) -> State:
    """The bench after so long at a place: full heat below it, none above. Changes the state."""
    for _ in range(periods):
        ctrl = p.amplifier.full_scale if s.micro.wire.x < goal else 0.0
        s = bench.advance(p, s, Outputs(0.0, ctrl, 0.0, 0.0), Noise(0.0, 0.0, 0.0), dt)
    return s


def copied(state: Any) -> Any:
    """A state of its own, with its relays' memory.

    Parameters
    ----------
    state : Any
        Of a bench, or any part of one.

    Returns
    -------
    Any
        The same, no array shared.
    """
    if isinstance(state, np.ndarray):
        return state.copy()
    if hasattr(state, "_fields"):
        return type(state)(*[copied(each) for each in state])
    return state


def quickest(plant: Plant, state: State, goal: float, near: float = NEAR) -> float:
    """Least time until the micro-stage is near a place.

    Parameters
    ----------
    plant : Plant
        The bench.
    state : State
        Where it is, how warm, and what it remembers; not changed.
    goal : float
        Place, m.
    near : float, optional
        What counts as near, m.

    Returns
    -------
    float
        s.

    Raises
    ------
    InputError
        The stage does not come there in a minute.
    """
    x = state.micro.wire.x
    ctrl = plant.amplifier.full_scale if goal > x else 0.0
    low, high = (goal - near, 1.0) if goal > x else (-1.0, goal + near)
    taken = compiled(_until)(plant, copied(state), ctrl, low, high, PERIOD)
    if taken < 0:
        raise InputError("place", f"{1e3 * goal:.3g} mm", "one that the stage reaches in a minute")
    return taken * PERIOD


def turns(
    machine: Bench, sensors: Sensors, places: Sequence[float], hold: float = 3.0
) -> list[QuickestFine]:
    """The quickest ways of the micro-stage from place to place, beginning cold and extended.

    Parameters
    ----------
    machine : Bench
        The bench.
    sensors : Sensors
        Its sensors, which are not asked.
    places : sequence of float
        One after the other, m.
    hold : float, optional
        How long it stays at each, by its true place, s.

    Returns
    -------
    list[QuickestFine]
        One for each place.

    Raises
    ------
    InputError
        A place is negative, or the stage does not come there in a minute.
    """
    p = bench.prepare(machine, sensors)
    state, found = bench.initial(p), []
    for place in places:
        if place < 0.0:
            raise InputError("place", f"{1e3 * place:.3g} mm", "a contraction from 0 mm on")
        start = state.micro.wire.x
        found.append(QuickestFine(start, place, quickest(p, state, place)))
        state = compiled(_held)(p, state, place, round(hold / PERIOD), PERIOD)
    return found
