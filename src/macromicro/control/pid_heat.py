"""PID on heat, for those who have identified no more than where the heat begins and ends.

The PI of Section 5.3.2 acts on the present place, but heat that is on its way moves the stage for
some tens of milliseconds more. Here the place is led by its speed, from an observer of both, and
the effort is a share of the full heat: what the wires take up, not the voltage.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

from macromicro.columns import Quantity
from macromicro.control.converter import rounded
from macromicro.control.pi import HIGHEST, SWIFTEST
from macromicro.control.stage_law import Sample, StageLaw, Target
from macromicro.kernel import kernel
from macromicro.nominal import FULL_SCALE
from macromicro.schema.par import Par

_TUNED = "tuned on the shipped bench"
STEEPEST = 2e5  # 1/m: the full heat at 5 um, as of `control.pi`
QUICKEST = 2e8  # 1/(m*s): one period of 1 ms adds as much as the steepest gain gives
MOST_OWED = 0.05  # share of heat that rounding may owe


class Gains(NamedTuple):
    """Gains on the share of the full heat, and the converter's range that it lies in."""

    kp: Annotated[
        float, Par("1/m", "share of heat for an error", _TUNED, shown="1/mm", lo=0.0, hi=STEEPEST)
    ] = 7.7e3
    ki: Annotated[
        float,
        Par("1/(m*s)", "its rate for an error", _TUNED, shown="1/(mm*s)", lo=0.0, hi=QUICKEST),
    ] = 1.3e5
    kaw: Annotated[float, Par("1/s", "anti-windup gain", _TUNED, lo=0.0, hi=SWIFTEST)] = 20.0
    lead: Annotated[
        float, Par("s", "how far the place is led", _TUNED, shown="ms", lo=0.0, hi=1.0)
    ] = 0.044
    observer: Annotated[
        float,
        Par("s", "time of the observer of the speed", _TUNED, shown="ms", positive=True, hi=1.0),
    ] = 2e-3
    low: Annotated[float, Par("V", "CTRL at which the heat begins", _TUNED, lo=0.0, hi=HIGHEST)] = (
        1.27
    )
    high: Annotated[float, Par("V", "CTRL of full heat", _TUNED, positive=True, hi=HIGHEST)] = 1.95
    step: Annotated[
        float, Par("V", "step of the D/A", "MultiQ-3 board, Section 3.3", shown="mV", lo=0.0)
    ] = FULL_SCALE / 2048.0

    def problems(self) -> list[tuple[str, Any, str]]:
        """What cannot work.

        Returns
        -------
        list[tuple[str, Any, str]]
            Parameter, value, and what is accepted.
        """
        return [("low", self.low, "below {high}")] if self.low >= self.high else []


class Memory(NamedTuple):
    """What the law remembers."""

    place: Annotated[float, Quantity("mm", "observed place", scale=1e3)]
    speed: Annotated[float, Quantity("mm/s", "observed speed", scale=1e3)]
    share: Annotated[float, Quantity("1", "integral share of the full heat")]
    owed: float  # share of heat that the D/A's rounding owes


@kernel
def start(p: Gains, sample: Sample) -> Memory:
    """At rest where the stage is.

    Parameters
    ----------
    p : Gains
        Gains.
    sample : Sample
        The first.

    Returns
    -------
    Memory
        Without heat.
    """
    place = 0.0 if math.isnan(sample.position) else sample.position
    return Memory(place, 0.0, 0.0, 0.0)


@kernel
def observed(p: Gains, s: Memory, sample: Sample, dt: float) -> tuple[float, float]:
    """Place and speed a period later, by an observer with two equal poles.

    Parameters
    ----------
    p : Gains
        Its time; two periods at least.
    s : Memory
        State.
    sample : Sample
        What the stage shows, m; without a reading it goes on at its speed.
    dt : float
        Control period, s.

    Returns
    -------
    place : float
        m.
    speed : float
        m/s.
    """
    place, speed = s.place + dt * s.speed, s.speed
    if not math.isnan(sample.position):
        time = max(p.observer, 2.0 * dt)
        beyond = sample.position - place
        speed += dt * (beyond / (time * time))
        place += dt * (2.0 * beyond / time)
    return place, speed


@kernel
def rest(p: Gains, s: Memory, sample: Sample, dt: float) -> Memory:
    """A period without a turn: the observer goes on, the integral begins anew.

    Parameters
    ----------
    p : Gains
        Gains.
    s : Memory
        State.
    sample : Sample
        What the stage shows, m.
    dt : float
        Control period, s.

    Returns
    -------
    Memory
        A period later.
    """
    place, speed = observed(p, s, sample, dt)
    return Memory(place, speed, 0.0, 0.0)


@kernel
def step(p: Gains, s: Memory, target: Target, sample: Sample, dt: float) -> tuple[Memory, float]:
    """One control period.

    Parameters
    ----------
    p : Gains
        Gains.
    s : Memory
        State.
    target : Target
        Where the stage is to be, m.
    sample : Sample
        What it shows, m.
    dt : float
        Control period, s.

    Returns
    -------
    memory : Memory
        New state.
    effort : float
        CTRL, V; 0 without heat.
    """
    place, speed = observed(p, s, sample, dt)
    error = target.position - place + p.lead * (target.velocity - speed)
    wanted = p.kp * error + s.share
    given = min(max(wanted, 0.0), 1.0)
    share = s.share + dt * (p.ki * error + p.kaw * (given - wanted))
    if given <= 0.0:
        return Memory(place, speed, share, 0.0), 0.0
    span = p.high - p.low
    volts = rounded(p.low + span * min(max(given + s.owed, 0.0), 1.0), p.step)
    owed = s.owed + given - (volts - p.low) / span
    owed = min(max(owed, -MOST_OWED), MOST_OWED)
    return Memory(place, speed, share, owed), volts


LAW = StageLaw("pid-heat", Gains, Memory, start, step, rest=rest)
