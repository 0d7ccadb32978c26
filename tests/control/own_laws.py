"""Laws as a user writes them, for tests; named "tests.control.own_laws:NAME"."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from macromicro.columns import Quantity
from macromicro.control.stage_law import Sample, StageLaw, Target
from macromicro.kernel import kernel
from macromicro.schema.par import Par

HERE = "tests.control.own_laws"


def gain(unit: str) -> Par:
    return Par(unit, "a gain", "a test", positive=True, hi=1e3)


class Gains(NamedTuple):
    slope: Annotated[float, gain("1/s")] = 50.0
    reach: Annotated[float, gain("V")] = 2.0


class Memory(NamedTuple):
    place: float
    speed: Annotated[float, Quantity("mm/s", "filtered speed", scale=1e3)]


def begin(gains: Gains, sample: Sample) -> Memory:
    return Memory(sample.position, 0.0)


def slide(
    gains: Gains, memory: Memory, target: Target, sample: Sample, dt: float
) -> tuple[Memory, float]:
    """Towards the line e' + slope e = 0, the speed filtered: two states."""
    rate = (sample.position - memory.place) / dt
    speed = memory.speed + (rate - memory.speed) * dt / (0.003 + dt)
    off = gains.slope * (target.position - sample.position) + target.velocity - speed
    return Memory(sample.position, speed), gains.reach * min(max(off / 0.1, -1.0), 1.0)


class PlainGains(NamedTuple):
    slope: Annotated[float, gain("1/s")] = 50.0
    reach: Annotated[float, gain("V")] = 2.0


plain = StageLaw("plain", PlainGains, Memory, begin, slide)


@kernel
def start(gains: Gains, sample: Sample) -> Memory:
    return Memory(sample.position, 0.0)


@kernel
def step(
    gains: Gains, memory: Memory, target: Target, sample: Sample, dt: float
) -> tuple[Memory, float]:
    """As `slide`."""
    rate = (sample.position - memory.place) / dt
    speed = memory.speed + (rate - memory.speed) * dt / (0.003 + dt)
    off = gains.slope * (target.position - sample.position) + target.velocity - speed
    return Memory(sample.position, speed), gains.reach * min(max(off / 0.1, -1.0), 1.0)


sliding = StageLaw("sliding mode", Gains, Memory, start, step)


class TurnGains(NamedTuple):
    most: Annotated[float, gain("s")] = 1.0


@kernel
def begin_turn(gains: TurnGains, sample: Sample) -> Memory:
    return Memory(sample.position, 0.0)


@kernel
def foresee(
    gains: TurnGains, memory: Memory, target: Target, sample: Sample, dt: float
) -> tuple[Memory, float]:
    """Its effort (V) is the time until the set point turns (s)."""
    return memory, min(target.turn, gains.most)


foreseeing = StageLaw("foreseeing", TurnGains, Memory, begin_turn, foresee)


class LimitedGains(NamedTuple):
    slope: Annotated[float, gain("1/s")] = 50.0
    reach: Annotated[float, gain("V")] = 2.0
    limit: Annotated[float, gain("V")] = 10.0


def bounded(
    gains: LimitedGains, memory: Memory, target: Target, sample: Sample, dt: float
) -> tuple[Memory, float]:
    """As `slide`, for an axis that homes."""
    after, effort = slide(Gains(gains.slope, gains.reach), memory, target, sample, dt)
    return after, min(max(effort, -gains.limit), gains.limit)


def begin_limited(gains: LimitedGains, sample: Sample) -> Memory:
    return Memory(sample.position, 0.0)


limited = StageLaw("limited", LimitedGains, Memory, begin_limited, bounded)


class CountGains(NamedTuple):
    now: Annotated[float, gain("V/count")] = 0.02


class CountMemory(NamedTuple):
    integral: float


class InCounts:
    """A class; it sees counts, and has an integral."""

    gains, memory, unit, compensated = CountGains, CountMemory, "count", False

    @staticmethod
    def start(gains: CountGains, sample: Sample) -> CountMemory:
        return CountMemory(sample.position)

    @staticmethod
    def step(
        gains: CountGains, memory: CountMemory, target: Target, sample: Sample, dt: float
    ) -> tuple[CountMemory, float]:
        effort = gains.now * (target.position - sample.position)
        return CountMemory(memory.integral + dt), effort


class ToldGains(NamedTuple):
    share: Annotated[float, gain("V")] = 1.0


class Told:
    """Its effort [V] tells what it is shown beside the positions."""

    gains, memory, unit, compensated = ToldGains, CountMemory, "count", False

    @staticmethod
    def start(gains: ToldGains, sample: Sample) -> CountMemory:
        return CountMemory(0.0)

    @staticmethod
    def step(
        gains: ToldGains, memory: CountMemory, target: Target, sample: Sample, dt: float
    ) -> tuple[CountMemory, float]:
        return memory, gains.share * (
            sample.t + 10.0 * target.velocity + 100.0 * target.acceleration
        )


twin = StageLaw("the same gains", Gains, Memory, begin, slide)
bare = StageLaw("no gains", CountMemory, Memory, begin, slide)
number = 5
