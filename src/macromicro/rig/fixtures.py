"""The two test fixtures as rigs: the kiln of Section 5.2.1 and the cycle bench of Appendix D.

Each has the shape of a `Rig` (channels, clock, read, write, stop, context manager) with
the sample and the outputs of its own fixture.
"""

from __future__ import annotations

from types import TracebackType
from typing import Any, Generic, NamedTuple, Self, TypeVar

from macromicro.nominal import PERIOD
from macromicro.plant import cycle, kiln
from macromicro.plant.cycle import CyclePlant, CycleSample, CycleState
from macromicro.plant.kiln import KILN_NOISES, KilnNoise, KilnPlant, KilnSample, KilnState
from macromicro.rig.twin import VirtualClock, noise_source

_BLOCK = 1000
KILN_PERIOD = 0.2
CYCLE_PERIOD = PERIOD


class KilnOutputs(NamedTuple):
    """What the kiln takes: its heater's relay, 0 or 1."""

    heater: float


class CycleOutputs(NamedTuple):
    """What the cycle bench takes: ctrl [V at the D/A], fan 0 or 1."""

    ctrl: float
    fan: float


Shown = TypeVar("Shown")
Taken = TypeVar("Taken")


class FixtureTwin(Generic[Shown, Taken]):
    """What both fixtures share: a clock that computes, outputs that end safe.

    Parameters
    ----------
    dt : float
        Control period, s.
    safe : Taken
        Outputs at the start and after `stop`.
    """

    channels: tuple[str, ...] = ()

    def __init__(self, dt: float, safe: Taken) -> None:
        self.dt = dt
        self.tick = 0
        self.clock = VirtualClock(self)
        self._safe = self._outputs = safe

    def read(self) -> Shown:
        """Measure all channels now.

        Returns
        -------
        Shown
            In the units of the fixture's sample.

        Raises
        ------
        NotImplementedError
            A fixture must have its own.
        """
        raise NotImplementedError

    def advance(self) -> None:
        """Let one period pass.

        Raises
        ------
        NotImplementedError
            A fixture must have its own.
        """
        raise NotImplementedError

    def write(self, outputs: Taken) -> None:
        """Set the outputs for the coming period.

        Parameters
        ----------
        outputs : Taken
            In the fixture's own type.
        """
        self._outputs = outputs

    def stop(self) -> None:
        """Set every output to its safe value."""
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
    """The virtual kiln.

    Parameters
    ----------
    plant : KilnPlant
        Its parameters.
    seed : int
        Seed of noise and interference.
    dt : float, optional
        Control period, s.
    state : KilnState | None, optional
        State at the start; default: cold.
    measure, advance : Any, optional
        The physics; by default interpreted. The compiled ones may be passed for speed and give the
        same bits.
    """

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
        self.state = kiln.initial(plant) if state is None else state
        self._measure, self._advance = measure, advance
        self._random = noise_source(seed)
        self._noise: list[KilnNoise] = []

    def read(self) -> KilnSample:
        """Measure now; once a period.

        Returns
        -------
        KilnSample
            Thermocouple (deg C) and contraction (counts).
        """
        if self.tick % _BLOCK == 0 or not self._noise:
            rows = self._random.standard_normal((_BLOCK, KILN_NOISES)).tolist()
            self._noise = [KilnNoise(*row) for row in rows]
        draw = self._noise[self.tick % _BLOCK]
        sample: KilnSample = self._measure(self.plant, self.state, self.tick * self.dt, draw)
        return sample

    def advance(self) -> None:
        """Let one period pass."""
        draw = self._noise[self.tick % _BLOCK]
        heater = self._outputs.heater
        self.state = self._advance(self.plant, self.state, heater, draw, self.dt)
        self.tick += 1


class CycleTwin(FixtureTwin[CycleSample, CycleOutputs]):
    """The virtual cycle bench; it has no noise, so it needs no seed.

    Parameters
    ----------
    plant : CyclePlant
        Its parameters.
    dt : float, optional
        Control period, s.
    state : CycleState | None, optional
        State at the start; default: cold.
    measure, advance : Any, optional
        The physics; by default interpreted.
    """

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
        self.state = cycle.initial(plant) if state is None else state
        self._measure, self._advance = measure, advance

    def read(self) -> CycleSample:
        """Measure now.

        Returns
        -------
        CycleSample
            Contraction (counts) and the end signals.
        """
        sample: CycleSample = self._measure(self.plant, self.state, self.tick * self.dt)
        return sample

    def advance(self) -> None:
        """Let one period pass."""
        ctrl, fan = self._outputs
        self.state = self._advance(self.plant, self.state, ctrl, fan, self.dt)
        self.tick += 1
