"""The virtual bench as a rig: time passes only while the loop waits, so runs repeat exactly."""

from __future__ import annotations

from types import TracebackType
from typing import Any, Protocol, Self

import numpy as np
import numpy.typing as npt

from macromicro.plant import bench
from macromicro.plant.bench import NOISES, Plant, State, Truth
from macromicro.types import SAFE, Outputs, Sample

_BLOCK = 1000


def noise_source(seed: int) -> np.random.Generator:
    """The generator of a run's measurement noise: same seed, same numbers, however drawn."""
    return np.random.Generator(np.random.PCG64(seed))


class Ticking(Protocol):
    """A twin as its clock sees it: periods so far, their length [s], and one more."""

    tick: int
    dt: float

    def advance(self) -> None:
        """Let one period pass."""


class VirtualClock:
    """Time of a twin: `wait` lets its physics advance instead of sleeping."""

    def __init__(self, twin: Ticking) -> None:
        self._twin = twin

    def now(self) -> float:
        """Simulated seconds since the start."""
        return self._twin.tick * self._twin.dt

    def wait(self, dt: float) -> None:
        """Advance the twin by `dt`, which must be its own period."""
        if dt != self._twin.dt:
            raise ValueError(f"this twin runs at a period of {self._twin.dt} s, not {dt} s")
        self._twin.advance()


class Twin:
    """The bench behind the `Rig` interface, noise drawn from `seed`.

    `measure` and `advance` default to the interpreted physics; pass the compiled ones
    for speed. Both give the same bits.
    """

    channels = Sample._fields

    def __init__(
        self,
        plant: Plant,
        seed: int,
        dt: float = 1e-3,
        state: State | None = None,
        measure: Any = bench.measure,
        advance: Any = bench.advance,
    ) -> None:
        self.plant = plant
        self.dt = dt
        self.tick = 0
        self.state = bench.initial(plant) if state is None else state
        self.clock = VirtualClock(self)
        self._measure, self._advance = measure, advance
        self._random = noise_source(seed)
        self._noise: npt.NDArray[np.float64] = np.empty((0, NOISES))
        self._outputs = SAFE

    def read(self) -> Sample:
        """Measure all channels now."""
        if self.tick % _BLOCK == 0 or not len(self._noise):
            self._noise = self._random.standard_normal((_BLOCK, NOISES))
        draw = self._noise[self.tick % _BLOCK]
        sample: Sample = self._measure(
            self.plant, self.state, self.tick * self.dt, float(draw[0]), float(draw[1])
        )
        return sample

    def write(self, outputs: Outputs) -> None:
        """Set the outputs for the coming control period."""
        self._outputs = outputs

    def advance(self) -> None:
        """Let one control period pass."""
        draw = self._noise[self.tick % _BLOCK]
        self.state = self._advance(self.plant, self.state, self._outputs, float(draw[2]), self.dt)
        self.tick += 1
        self._outputs = self._outputs._replace(laser_reset=0.0)

    def truth(self) -> Truth:
        """The bench's true quantities (a real rig has no such thing)."""
        return bench.truth(self.plant, self.state)

    def stop(self) -> None:
        """Set every output to its safe value."""
        self._outputs = SAFE

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()
