"""The virtual bench as a rig: time passes only while the loop waits, so runs repeat exactly."""

from __future__ import annotations

from collections.abc import Iterator
from types import TracebackType
from typing import Any, Protocol, Self

import numpy as np
import numpy.typing as npt

from macromicro.arrays import packed
from macromicro.kernel import compiled
from macromicro.nominal import PERIOD
from macromicro.plant import bench
from macromicro.plant.bench import NOISES, Noise, Plant, State, Truth
from macromicro.types import SAFE, Outputs, Sample

_BLOCK = 1000


def noise_source(seed: int) -> np.random.Generator:
    """The generator of a run's measurement noise: same seed, same numbers, however drawn.

    Parameters
    ----------
    seed : int
        Any whole number from 0.

    Returns
    -------
    np.random.Generator
        PCG64.
    """
    return np.random.Generator(np.random.PCG64(seed))


class Ticking(Protocol):
    """A twin as its clock sees it.

    Attributes
    ----------
    tick : int
        Periods so far.
    dt : float
        Their length, s.
    """

    tick: int
    dt: float

    def advance(self) -> None:
        """Let one period pass."""


class VirtualClock:
    """Time of a twin: `wait` lets its physics advance instead of sleeping.

    Parameters
    ----------
    twin : Ticking
        Whose time it is.
    """

    def __init__(self, twin: Ticking) -> None:
        self._twin = twin

    def now(self) -> float:
        """Simulated time since the start.

        Returns
        -------
        float
            s.
        """
        return self._twin.tick * self._twin.dt

    def wait(self, dt: float) -> None:
        """Advance the twin by one period.

        Parameters
        ----------
        dt : float
            The twin's own period, s.

        Raises
        ------
        ValueError
            Another period.
        """
        if dt != self._twin.dt:
            raise ValueError(f"this twin runs at a period of {self._twin.dt} s, not {dt} s")
        self._twin.advance()


class Twin:
    """The bench behind the `Rig` interface. `CompiledTwin` is faster, period by period.

    Parameters
    ----------
    plant : Plant
        Its parameters.
    seed : int
        Seed of the sensor noise.
    dt : float, optional
        Control period, s.
    state : State | None, optional
        State at the start; default: at rest at 0 m, cold.
    measure, advance : Any, optional
        The physics; by default interpreted. Pass the compiled ones for speed; both give the same
        bits.
    """

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
        self.state = bench.initial(plant) if state is None else state
        self.clock = VirtualClock(self)
        self._measure, self._advance = measure, advance
        self._random = noise_source(seed)
        self._noise: list[Noise] = []
        self._drawn = -1  # block of periods that the noise was drawn for
        self._outputs = SAFE

    def read(self) -> Sample:
        """Measure all channels now.

        Returns
        -------
        Sample
            SI, encoder in counts.
        """
        draw = self._draws()
        return self._measured(self.tick * self.dt, draw)

    def write(self, outputs: Outputs) -> None:
        """Set the outputs for the coming control period.

        Parameters
        ----------
        outputs : Outputs
            V; fan and laser reset 0 or 1.
        """
        self._outputs = outputs

    def advance(self) -> None:
        """Let one control period pass."""
        draw = self._draws()
        self._advanced(self._outputs, draw)
        self.tick += 1
        if self._outputs.laser_reset != 0.0:
            self._outputs = self._outputs._replace(laser_reset=0.0)

    def _draws(self) -> Noise:
        """This period's standard normal numbers, however often and by whom they are used."""
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
        """The bench's true quantities (a real rig has no such thing).

        Returns
        -------
        Truth
            SI, temperatures in deg C.
        """
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


_ADVANCE, _MEASURE, _TRUTH = 0.0, 1.0, 2.0
_ORDER, _TIME, _DRAW = range(3)  # where what is asked begins
_OUT = _DRAW + NOISES
_MEASURED = packed(_OUT - _TIME)
_ADVANCED = packed(NOISES + len(Outputs._fields))


def _bench(
    p: Plant, s: State, asked: npt.NDArray[np.float64], shown: npt.NDArray[np.float64], dt: float
) -> Iterator[int]:
    """The bench as a coroutine: each `next` does what `asked` orders, and fills `shown`."""
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
    """The twin with its state inside compiled code, for a loop that runs in real time.

    Handing some two hundred parameters and state variables to compiled code and back takes ten
    times as long as the physics of a period; here they stay there, and only outputs and readings
    cross over. The bits are those of `Twin`. Its `state` cannot be looked at.

    Parameters
    ----------
    plant : Plant
        Its parameters.
    seed : int
        Seed of the sensor noise.
    dt : float, optional
        Control period, s.
    state : State | None, optional
        State at the start; default: at rest at 0 m, cold.
    """

    def __init__(self, plant: Plant, seed: int, dt: float = 1e-3, state: State | None = None):
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
        """The bench's true quantities (a real rig has no such thing).

        Returns
        -------
        Truth
            SI, temperatures in deg C.
        """
        self._ask(_TRUTH)
        return Truth(*self._shown.tolist())
