"""The two test fixtures as rigs: the kiln of Section 5.2.1 and the cycle bench of Appendix D."""

from __future__ import annotations

from types import TracebackType
from typing import Any, Generic, NamedTuple, Self, TypeVar

from macromicro.arrays import own
from macromicro.nominal import PERIOD
from macromicro.plant import cycle, kiln
from macromicro.plant.cycle import CyclePlant, CycleSample, CycleState
from macromicro.plant.kiln import KILN_NOISES, KilnNoise, KilnPlant, KilnSample, KilnState
from macromicro.rig.twin import VirtualClock, noise_source

_BLOCK = 1000
KILN_PERIOD = 0.2
CYCLE_PERIOD = PERIOD


class KilnOutputs(NamedTuple):
    """Relay of the kiln's heater, 0 or 1."""

    heater: float


class CycleOutputs(NamedTuple):
    """ctrl [V at the D/A] and fan, 0 or 1."""

    ctrl: float
    fan: float


Shown = TypeVar("Shown")
Taken = TypeVar("Taken")


class FixtureTwin(Generic[Shown, Taken]):
    """Simulated clock and safe outputs of both fixtures."""

    channels: tuple[str, ...] = ()

    def __init__(self, dt: float, safe: Taken) -> None:
        self.dt = dt
        self.tick = 0
        self.clock = VirtualClock(self)
        self._safe = self._outputs = safe

    def read(self) -> Shown:
        raise NotImplementedError

    def advance(self) -> None:
        raise NotImplementedError

    def write(self, outputs: Taken) -> None:
        self._outputs = outputs

    def stop(self) -> None:
        self._outputs = self._safe

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()


class KilnTwin(FixtureTwin[KilnSample, KilnOutputs]):
    channels = KilnSample._fields

    def __init__(
        self,
        plant: KilnPlant,
        seed: int,
        dt: float = KILN_PERIOD,
        state: KilnState | None = None,
        measure: Any = kiln.measure,
        advance: Any = kiln.advance,
    ) -> None:
        super().__init__(dt, KilnOutputs(0.0))
        self.plant = plant
        self.state = kiln.initial(plant) if state is None else own(state)
        self._measure, self._advance = measure, advance
        self._random = noise_source(seed)
        self._noise: list[KilnNoise] = []

    def read(self) -> KilnSample:
        """Measure now; once a period."""
        if self.tick % _BLOCK == 0 or not self._noise:
            rows = self._random.standard_normal((_BLOCK, KILN_NOISES)).tolist()
            self._noise = [KilnNoise(*row) for row in rows]
        draw = self._noise[self.tick % _BLOCK]
        sample: KilnSample = self._measure(self.plant, self.state, self.tick * self.dt, draw)
        return sample

    def advance(self) -> None:
        draw = self._noise[self.tick % _BLOCK]
        heater = self._outputs.heater
        self.state = self._advance(self.plant, self.state, heater, draw, self.dt)
        self.tick += 1


class CycleTwin(FixtureTwin[CycleSample, CycleOutputs]):
    """The virtual cycle bench, without noise."""

    channels = CycleSample._fields

    def __init__(
        self,
        plant: CyclePlant,
        dt: float = CYCLE_PERIOD,
        state: CycleState | None = None,
        measure: Any = cycle.measure,
        advance: Any = cycle.advance,
    ) -> None:
        super().__init__(dt, CycleOutputs(0.0, 0.0))
        self.plant = plant
        self.state = cycle.initial(plant) if state is None else own(state)
        self._measure, self._advance = measure, advance

    def read(self) -> CycleSample:
        sample: CycleSample = self._measure(self.plant, self.state, self.tick * self.dt)
        return sample

    def advance(self) -> None:
        ctrl, fan = self._outputs
        self.state = self._advance(self.plant, self.state, ctrl, fan, self.dt)
        self.tick += 1
