"""The virtual bench as a rig in simulated time; runs repeat exactly."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Protocol, Self

import numpy as np
import numpy.typing as npt

from macromicro.arrays import own, packed
from macromicro.errors import InputError
from macromicro.kernel import compiled
from macromicro.nominal import PERIOD
from macromicro.plant import bench
from macromicro.plant.bench import NOISES, Noise, Plant, State, Truth
from macromicro.types import SAFE, Outputs, Sample

_BLOCK = 1000


def noise_source(seed: int) -> np.random.Generator:
    """The generator of a run's measurement noise, independent of how it is drawn."""
    return np.random.Generator(np.random.PCG64(seed))


class Ticking(Protocol):
    tick: int  # periods so far
    dt: float  # their length, s

    def advance(self) -> None: ...


class VirtualClock:
    """Simulated time: `wait` advances the physics."""

    def __init__(self, twin: Ticking) -> None:
        self._twin = twin

    def now(self) -> float:
        return self._twin.tick * self._twin.dt

    def wait(self, dt: float) -> None:
        if dt != self._twin.dt:
            raise InputError("dt", f"{dt} s", f"{self._twin.dt} s, the period of this twin")
        self._twin.advance()


class Twin:
    """The bench as a `Rig`; `CompiledTwin` is faster."""

    channels = Sample._fields

    def __init__(
        self,
        plant: Plant,
        seed: int,
        dt: float = PERIOD,
        state: State | None = None,
        measure: Any = bench.measure,
        advance: Any = bench.advance,
    ) -> None:
        self.plant = plant
        self.dt = dt
        self.tick = 0
        self.state = bench.initial(plant) if state is None else own(state)
        self.clock = VirtualClock(self)
        self._measure, self._advance = measure, advance
        self._random = noise_source(seed)
        self._noise: list[Noise] = []
        self._drawn = -1  # block of periods that the noise was drawn for
        self._outputs = SAFE

    def read(self) -> Sample:
        """Measure all channels now."""
        draw = self._draws()
        return self._measured(self.tick * self.dt, draw)

    def write(self, outputs: Outputs) -> None:
        self._outputs = outputs

    def advance(self) -> None:
        draw = self._draws()
        self._advanced(self._outputs, draw)
        self.tick += 1
        if self._outputs.laser_reset != 0.0:
            self._outputs = self._outputs._replace(laser_reset=0.0)

    def _draws(self) -> Noise:
        """This period's random numbers, the same for all who use them."""
        block, row = divmod(self.tick, _BLOCK)
        if block != self._drawn:
            rows = self._random.standard_normal((_BLOCK, NOISES)).tolist()
            self._noise = [Noise(*row) for row in rows]
            self._drawn = block
        return self._noise[row]

    def _measured(self, t: float, draw: Noise) -> Sample:
        sample: Sample = self._measure(self.plant, self.state, t, draw)
        return sample

    def _advanced(self, outputs: Outputs, draw: Noise) -> None:
        self.state = self._advance(self.plant, self.state, outputs, draw, self.dt)

    def truth(self) -> Truth:
        """The bench's true quantities (deg C)."""
        return bench.truth(self.plant, self.state)

    def stop(self) -> None:
        self._outputs = SAFE

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()


_ADVANCE, _MEASURE, _TRUTH = 0.0, 1.0, 2.0
_ORDER, _TIME, _DRAW = range(3)  # where what is asked begins
_OUT = _DRAW + NOISES
_MEASURED = packed(_OUT - _TIME)
_ADVANCED = packed(NOISES + len(Outputs._fields))


def _bench(
    p: Plant, s: State, asked: npt.NDArray[np.float64], shown: npt.NDArray[np.float64], dt: float
) -> Iterator[int]:
    """The bench as a coroutine: each `next` executes `asked` and fills `shown`."""
    while True:
        draw = Noise(asked[_DRAW], asked[_DRAW + 1], asked[_DRAW + 2])
        if asked[_ORDER] == _ADVANCE:
            outputs = Outputs(asked[_OUT], asked[_OUT + 1], asked[_OUT + 2], asked[_OUT + 3])
            s = bench.advance(p, s, outputs, draw, dt)
        elif asked[_ORDER] == _MEASURE:
            sample = bench.measure(p, s, asked[_TIME], draw)
            for j in range(len(sample)):
                shown[j] = sample[j]
        else:
            true = bench.truth(p, s)
            for j in range(len(true)):
                shown[j] = true[j]
        yield 0


class CompiledTwin(Twin):
    """`Twin` with its state in compiled code, for real time; the bits are the same."""

    def __init__(self, plant: Plant, seed: int, dt: float = PERIOD, state: State | None = None):
        super().__init__(plant, seed, dt, state)
        self._asked = np.zeros(_OUT + len(Outputs._fields))
        self._shown = np.zeros(len(Truth._fields))
        self._sampled = self._shown[: len(Sample._fields)]
        # The coroutine refers to the arrays inside, and does not own them.
        self._kept = (self.plant, self.state)
        self._bench = compiled(_bench)(self.plant, self.state, self._asked, self._shown, dt)
        del self.state

    def _ask(self, order: float) -> None:
        self._asked[_ORDER] = order
        next(self._bench)

    def _measured(self, t: float, draw: Noise) -> Sample:
        _MEASURED.pack_into(self._asked.data, self._asked.itemsize * _TIME, t, *draw)
        self._ask(_MEASURE)
        return Sample(*self._sampled.tolist())

    def _advanced(self, outputs: Outputs, draw: Noise) -> None:
        _ADVANCED.pack_into(self._asked.data, self._asked.itemsize * _DRAW, *draw, *outputs)
        self._ask(_ADVANCE)

    def truth(self) -> Truth:
        """The bench's true quantities (deg C)."""
        self._ask(_TRUTH)
        return Truth(*self._shown.tolist())
