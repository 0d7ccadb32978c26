"""Any rig with an encoder as a stage, whose parameters are the open rig; runs interpreted."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

from macromicro.arrays import Array
from macromicro.machines import lines
from macromicro.machines.period import Bench, Stages
from macromicro.machines.signals import Sample
from macromicro.machines.stage import Kind
from macromicro.place import LENGTH, Place
from macromicro.types import ENABLE, QUIET, SAFE, Lines, Outputs, Rig
from macromicro.types import Sample as Shown

_OTHERS = SAFE[1:]  # outputs beside the motor's, which this stage leaves safe


class Wired(NamedTuple):
    """`types.Outputs` with the enable line, for rigs that have it."""

    motor: float
    ctrl: float
    fan: float
    laser_reset: float
    enable: float


class Opened(NamedTuple):
    rig: Rig  # that measures `encoder`; one with lines as `wired` gives it
    pitch: float  # m per count


class Unknown(NamedTuple):
    """The unknown truth of a rig."""


class Kept:
    """A rig with lines that keeps its last reading and enable line."""

    def __init__(self, rig: Rig) -> None:
        self._rig, self.clock, self.lines = rig, rig.clock, QUIET
        self.channels, self.enable = rig.channels, 0.0
        self._switched = ENABLE in getattr(rig, "outputs", ())

    def read(self) -> Shown:
        sample = self._rig.read()
        self.lines = lines.read_lines(sample, self.channels)
        return sample

    def write(self, outputs: Outputs) -> None:
        given: Any = Wired(*outputs, self.enable) if self._switched else outputs
        self._rig.write(given)


def open_stage(rig: Any, pitch: float) -> Opened:
    return Opened(Kept(rig) if of(rig).lines else rig, pitch)  # type: ignore[arg-type]


def _measure(p: Opened, origin: float, t: float, noise: Array, k: int) -> Sample:
    """The reading, with time since the run's start."""
    shown = p.rig.read()
    return Sample(shown.t - origin, shown.encoder * p.pitch)


def _sense(p: Any, origin: float) -> Lines:
    """Lines of the same reading."""
    said: Lines = p.rig.lines
    return said


def _switch(p: Any, origin: float, enable: float) -> float:
    """Set the enable line of this period's outputs."""
    p.rig.enable = enable
    return origin


def _advance(p: Opened, origin: float, effort: float, noise: Array, k: int, dt: float) -> float:
    """Write the effort and wait for the next period."""
    p.rig.write(Outputs(float(effort), *_OTHERS))
    p.rig.clock.wait(dt)
    return origin


def _show(p: Opened, origin: float) -> Unknown:
    return Unknown()


def _prepare(settings: Any) -> Any:
    raise NotImplementedError("the parameters are an open rig: Opened(rig, pitch)")


def _now(p: Opened) -> float:
    """The initial state: the rig's time at the start."""
    return p.rig.clock.now()


STAGE = Kind("rig", 0, Unknown, _prepare, _now, _measure, _advance, _show)


def of(rig: Any, place: Place = LENGTH) -> Kind:
    return _wired_kind(lines.of((*rig.channels, *getattr(rig, "outputs", ()))), place)


@lru_cache(maxsize=16)
def _wired_kind(there: tuple[str, ...], place: Place) -> Kind:
    kind = STAGE._replace(place=place)
    return kind._replace(lines=there, sense=_sense, switch=_switch) if there else kind


def stages(simulated: Stages, on: Sequence[Any]) -> Stages:
    """The stages of a machine on open rigs, under the same laws; their truth is unknown."""
    kinds = tuple(
        of(rig, kind.place)._replace(corrected=kind.corrected)
        for rig, kind in zip(on, simulated.kinds, strict=True)
    )
    return simulated._replace(kinds=kinds, extra=None)


def bench(trees: Sequence[Any], on: Sequence[Any]) -> Bench:
    """Open rigs as runtime parameters, with their settings' pitches."""
    each = zip(on, trees, strict=True)
    return Bench(tuple(open_stage(rig, own.encoder.pitch) for rig, own in each))


def switched_on(stages: Sequence[Opened], kinds: Sequence[Kind], rise: float, dt: float) -> None:
    """Enable the drives of open rigs and wait until they give an effort."""
    switched = [p for p, kind in zip(stages, kinds, strict=True) if ENABLE in kind.lines]
    if not switched:
        return
    for params in switched:
        params.rig.enable = 1.0  # type: ignore[attr-defined]  # a `Kept`: it has lines
    for _ in range(math.ceil(rise / dt) + 1):
        for params in stages:
            params.rig.read()
            params.rig.write(SAFE)
        for params in stages:
            params.rig.clock.wait(dt)
