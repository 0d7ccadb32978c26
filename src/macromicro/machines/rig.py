"""A machine of one stage as a rig, and any rig that has an encoder as a stage.

The twin of a machine measures `encoder` and is driven by `motor`; whatever takes a `types.Rig` can
take it. The other way round `STAGE` is the kind of stage whose parameters are an open rig: the same
control period runs on it, interpreted.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from types import TracebackType
from typing import Any, NamedTuple, Self

import numpy as np

from macromicro.arrays import Array
from macromicro.kernel import compiled
from macromicro.machines.signals import Sample
from macromicro.machines.stage import Kind
from macromicro.rig.twin import VirtualClock, noise_source
from macromicro.types import SAFE, Outputs, Rig
from macromicro.types import Sample as Shown


class Twin:
    """A simulated stage behind the `Rig` interface.

    Parameters
    ----------
    kind : Kind
        Kind of stage.
    settings : Any
        Of its machine.
    seed : int, optional
        Seed of the sensor's noise.
    """

    channels = ("encoder",)

    def __init__(self, kind: Kind, settings: Any, seed: int = 0) -> None:
        self._kind = kind
        self.params = kind.prepare(settings)
        self.state = kind.initial(self.params)
        self.dt = float(settings.timing.period)
        self.pitch = float(settings.encoder.pitch)
        self.tick = 0
        self.clock = VirtualClock(self)
        self._random = noise_source(seed)
        self._noise = np.empty((1, kind.noises))
        self._draw()
        self._outputs = SAFE

    def _draw(self) -> None:
        self._noise[:] = self._random.standard_normal(self._noise.shape)

    def read(self) -> Shown:
        """Measure now.

        Returns
        -------
        Shown
            Encoder in counts; what there is not, NaN.
        """
        t = self.tick * self.dt
        place = self._measured(t)
        counts = place if math.isnan(place) else float(round(place / self.pitch))
        return Shown(t, counts, *[math.nan] * 4)

    def write(self, outputs: Outputs) -> None:
        """Set the outputs for the coming control period.

        Parameters
        ----------
        outputs : Outputs
            Of these the motor's, V.
        """
        self._outputs = outputs

    def advance(self) -> None:
        """Let one control period pass."""
        self._advanced(self._outputs.motor)
        self.tick += 1
        self._draw()

    def _measured(self, t: float) -> float:
        """Position, m."""
        return self._kind.measure(self.params, self.state, t, self._noise, 0).position

    def _advanced(self, effort: float) -> None:
        noise = self._noise
        self.state = self._kind.advance(self.params, self.state, effort, noise, 0, self.dt)

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


_ADVANCE, _MEASURE = 0.0, 1.0


@lru_cache(maxsize=16)
def _inside(kind: Kind) -> Any:
    """The stage as a coroutine: each `next` does what `asked` orders, and answers in it."""
    measure, advance = kind.measure, kind.advance

    def stage(params: Any, state: Any, asked: Array, noise: Array, dt: float) -> Iterator[int]:
        while True:
            if asked[0] == _ADVANCE:
                state = advance(params, state, asked[1], noise, 0, dt)
            else:
                asked[1] = measure(params, state, asked[1], noise, 0).position
            yield 0

    return stage


class CompiledTwin(Twin):
    """The twin with its state inside compiled code, as `rig.twin.CompiledTwin`: the same bits.

    Parameters
    ----------
    kind : Kind
        Kind of stage.
    settings : Any
        Of its machine.
    seed : int, optional
        Seed of the sensor's noise.
    """

    def __init__(self, kind: Kind, settings: Any, seed: int = 0) -> None:
        super().__init__(kind, settings, seed)
        self._asked = np.zeros(2)
        # The coroutine refers to the arrays inside, and does not own them.
        self._kept = (self.params, self.state)
        coroutine = compiled(_inside(kind))
        self._stage = coroutine(self.params, self.state, self._asked, self._noise, self.dt)
        del self.state

    def _measured(self, t: float) -> float:
        self._asked[:] = (_MEASURE, t)
        next(self._stage)
        return float(self._asked[1])

    def _advanced(self, effort: float) -> None:
        self._asked[:] = (_ADVANCE, effort)
        next(self._stage)


class Opened(NamedTuple):
    """An open rig as the parameters of a stage.

    Attributes
    ----------
    rig : Rig
        That measures `encoder`.
    pitch : float
        Way per count, m.
    """

    rig: Rig
    pitch: float


class Unknown(NamedTuple):
    """What is known to be true of a rig: nothing."""


def _measure(p: Opened, origin: float, t: float, noise: Array, k: int) -> Sample:
    """What the rig shows, its time since the run's start."""
    shown = p.rig.read()
    return Sample(shown.t - origin, shown.encoder * p.pitch)


def _advance(p: Opened, origin: float, effort: float, noise: Array, k: int, dt: float) -> float:
    """Write the effort and wait for the next period."""
    p.rig.write(SAFE._replace(motor=float(effort)))
    p.rig.clock.wait(dt)
    return origin


def _show(p: Opened, origin: float) -> Unknown:
    return Unknown()


def _prepare(settings: Any) -> Any:
    raise NotImplementedError("the parameters are an open rig: Opened(rig, pitch)")


def _now(p: Opened) -> float:
    """The state of such a stage: the rig's time at the start, s."""
    return p.rig.clock.now()


STAGE = Kind("rig", 0, Unknown, _prepare, _now, _measure, _advance, _show)


def of_rig(kind: Kind) -> Kind:
    """The kind of stage that an open rig is.

    Parameters
    ----------
    kind : Kind
        That of the machine whose stage is on the rig.

    Returns
    -------
    Kind
        `STAGE`, its places counted as the machine's.
    """
    return STAGE._replace(place=kind.place)
