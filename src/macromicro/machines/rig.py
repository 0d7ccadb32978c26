"""A single-stage machine as a rig (`types.Rig`); the other way round: `open_rig`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from types import TracebackType
from typing import Any, NamedTuple, Self, cast

import numpy as np

from macromicro import joining
from macromicro.arrays import Array
from macromicro.kernel import compiled
from macromicro.machines.parts import CLOSED
from macromicro.machines.stage import Kind
from macromicro.rig.twin import VirtualClock, noise_source
from macromicro.types import ENABLE, SAFE, Lines, Outputs
from macromicro.types import Sample as Shown


class Twin:
    """A simulated stage as a `Rig`."""

    def __init__(self, kind: Kind, settings: Any, seed: int = 0) -> None:
        self._kind = kind
        self.channels: tuple[str, ...] = ("encoder", *(n for n in kind.lines if n != ENABLE))
        self.outputs: tuple[str, ...] = ("motor", ENABLE) if ENABLE in kind.lines else ("motor",)
        self.injected: dict[str, float] = {}  # what lines are forced to, for tests
        self._closed = getattr(getattr(settings, "switches", None), "contacts", CLOSED) == CLOSED
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
        """Measure now (counts)."""
        t = self.tick * self.dt
        place = self._measured(t)
        counts = place if math.isnan(place) else float(round(place / self.pitch))
        if not self._kind.lines:
            return Shown(t, counts, *[math.nan] * 4)
        values: list[float] = [t, counts, *[math.nan] * 4, *self._said()._replace(**self.injected)]
        return cast("Shown", Seen(*values))

    def cut(self, name: str) -> None:
        """Cut the wire of a line; a normally closed limit switch then trips."""
        trips = name.startswith("limit") and self._closed
        self.injected[name] = 1.0 if trips else 0.0

    def write(self, outputs: Outputs) -> None:
        self._outputs = outputs
        if self._kind.lines:
            self._enabled(float(getattr(outputs, ENABLE, 1.0)))

    def advance(self) -> None:
        tripped = self.injected.get("drive_fault", 0.0) or not self.injected.get("enabled", 1.0)
        self._advanced(0.0 if tripped else self._outputs.motor)
        self.tick += 1
        self._draw()

    def _measured(self, t: float) -> float:
        return self._kind.measure(self.params, self.state, t, self._noise, 0).position

    def _said(self) -> Lines:
        return self._kind.sense(self.params, self.state)

    def true_position(self) -> float:
        """Where the stage is, which only a reference measures, m."""
        return float(self._kind.show(self.params, self.state).position)

    def _enabled(self, enable: float) -> None:
        self.state = self._kind.switch(self.params, self.state, enable)

    def _advanced(self, effort: float) -> None:
        noise = self._noise
        self.state = self._kind.advance(self.params, self.state, effort, noise, 0, self.dt)

    def stop(self) -> None:
        self._outputs = SAFE
        if self._kind.lines:
            self._enabled(0.0)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()


class Seen(NamedTuple):
    t: float
    encoder: float
    hall: float
    laser: float
    extend: float
    contract: float
    limit_low: float
    limit_high: float
    home: float
    index_count: float
    drive_fault: float
    enabled: float
    temperature: float


_ADVANCE, _MEASURE, _SENSE, _SWITCH, _SHOW = 0.0, 1.0, 2.0, 3.0, 4.0
_LINES = len(Lines._fields)


@lru_cache(maxsize=16)
def _inside(kind: Kind) -> Any:
    """The stage as a coroutine: each `next` executes `asked` and answers in it."""
    measure, advance = kind.measure, kind.advance
    sense, switch, show = kind.sense, kind.switch, kind.show
    # Else what is kept of it names types of another package, and is not read where that is not.
    joining.join(measure, advance, sense, switch, show)

    def stage(params: Any, state: Any, asked: Array, noise: Array, dt: float) -> Iterator[int]:
        while True:
            if asked[0] == _ADVANCE:
                state = advance(params, state, asked[1], noise, 0, dt)
            elif asked[0] == _SENSE:
                said = sense(params, state)
                for j in range(_LINES):
                    asked[1 + j] = said[j]
            elif asked[0] == _SWITCH:
                state = switch(params, state, asked[1])
            elif asked[0] == _SHOW:
                asked[1] = show(params, state).position
            else:
                asked[1] = measure(params, state, asked[1], noise, 0).position
            yield 0

    return stage


class CompiledTwin(Twin):
    """`Twin` with its state in compiled code, for real time; the bits are the same."""

    def __init__(self, kind: Kind, settings: Any, seed: int = 0) -> None:
        super().__init__(kind, settings, seed)
        self._asked = np.zeros(1 + _LINES)
        # The coroutine refers to the arrays inside, and does not own them.
        self._kept = (self.params, self.state)
        coroutine = compiled(_inside(kind))
        self._stage = coroutine(self.params, self.state, self._asked, self._noise, self.dt)
        del self.state

    def _measured(self, t: float) -> float:
        self._ask(_MEASURE, t)
        return float(self._asked[1])

    def _said(self) -> Lines:
        self._ask(_SENSE, 0.0)
        return Lines(*self._asked[1:].tolist())

    def true_position(self) -> float:
        self._ask(_SHOW, 0.0)
        return float(self._asked[1])

    def _enabled(self, enable: float) -> None:
        self._ask(_SWITCH, enable)

    def _advanced(self, effort: float) -> None:
        self._ask(_ADVANCE, effort)

    def _ask(self, what: float, value: float) -> None:
        self._asked[:2] = (what, value)
        next(self._stage)
