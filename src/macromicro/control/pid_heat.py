"""PID on heat, for an actuator of which only the heating range is identified."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

from macromicro.columns import Meaning, Quantity
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
    """Gains on the share of the full heat, and the converter's range."""

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
        return [("low", self.low, "below {high}")] if self.low >= self.high else []


class Memory(NamedTuple):
    place: Annotated[float, Quantity("mm", "observed place", scale=1e3)]
    speed: Annotated[float, Quantity("mm/s", "observed speed", scale=1e3)]
    share: Annotated[float, Quantity("1", "integral share of the full heat")]
    owed: Annotated[float, Meaning("share of heat that the D/A's rounding owes")]


@kernel
def start(p: Gains, sample: Sample) -> Memory:
    place = 0.0 if math.isnan(sample.position) else sample.position
    return Memory(place, 0.0, 0.0, 0.0)


@kernel
def observed(p: Gains, s: Memory, sample: Sample, dt: float) -> tuple[float, float]:
    """Position and speed a period later, by an observer with a double pole."""
    place, speed = s.place + dt * s.speed, s.speed
    if not math.isnan(sample.position):
        time = max(p.observer, 2.0 * dt)
        beyond = sample.position - place
        speed += dt * (beyond / (time * time))
        place += dt * (2.0 * beyond / time)
    return place, speed


@kernel
def rest(p: Gains, s: Memory, sample: Sample, dt: float) -> Memory:
    """A period without a turn: the observer continues, the integral is reset."""
    place, speed = observed(p, s, sample, dt)
    return Memory(place, speed, 0.0, 0.0)


@kernel
def step(
    p: Gains, s: Memory, target: Target, sample: Sample, dt: float
) -> tuple[
    Annotated[Memory, Meaning(name="memory")],
    Annotated[float, Meaning("CTRL; 0 without heat", "V", name="effort")],
]:
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


# Its gains are those of one driver: the voltages between which it heats.
LAW = StageLaw("pid-heat", Gains, Memory, start, step, rest=rest, model_of="micro")
