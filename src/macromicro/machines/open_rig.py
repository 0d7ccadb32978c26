"""Any rig that has an encoder as a stage, whose parameters are the open rig: the same control
period runs on it, interpreted."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

from macromicro.arrays import Array
from macromicro.machines import lines
from macromicro.machines.signals import Sample
from macromicro.machines.stage import Kind
from macromicro.place import LENGTH, Place
from macromicro.types import ENABLE, QUIET, SAFE, Lines, Outputs, Rig
from macromicro.types import Sample as Shown


class Wired(NamedTuple):
    """`types.Outputs` with the enable line, for a rig whose `outputs` name it."""

    motor: float
    ctrl: float
    fan: float
    laser_reset: float
    enable: float


class Opened(NamedTuple):
    """An open rig as the parameters of a stage.

    Attributes
    ----------
    rig : Rig
        That measures `encoder`; one with lines as `wired` gives it.
    pitch : float
        Way per count, m.
    """

    rig: Rig
    pitch: float


class Unknown(NamedTuple):
    """What is known to be true of a rig: nothing."""


class Kept:
    """A rig with lines that keeps its last reading, and the enable line between two outputs.

    Parameters
    ----------
    rig : Rig
        That measures `encoder`.
    """

    def __init__(self, rig: Rig) -> None:
        self._rig, self.clock, self.lines = rig, rig.clock, QUIET
        self.channels, self.enable = rig.channels, 0.0
        self._switched = ENABLE in getattr(rig, "outputs", ())

    def read(self) -> Shown:
        """This period's reading.

        Returns
        -------
        Shown
            As of the rig; `lines` are of the same.
        """
        sample = self._rig.read()
        self.lines = lines.read(sample, self.channels)
        return sample

    def write(self, outputs: Outputs) -> None:
        """Set all outputs, the enable line where the rig has one.

        Parameters
        ----------
        outputs : Outputs
            For the coming period.
        """
        given: Any = Wired(*outputs, self.enable) if self._switched else outputs
        self._rig.write(given)


def opened(rig: Any, pitch: float) -> Opened:
    """An open rig as a stage's parameters.

    Parameters
    ----------
    rig : Rig
        That measures `encoder`.
    pitch : float
        Way per count, m.

    Returns
    -------
    Opened
        For `of(rig)`.
    """
    return Opened(Kept(rig) if of(rig).lines else rig, pitch)  # type: ignore[arg-type]


def _measure(p: Opened, origin: float, t: float, noise: Array, k: int) -> Sample:
    """What the rig shows, its time since the run's start."""
    shown = p.rig.read()
    return Sample(shown.t - origin, shown.encoder * p.pitch)


def _sense(p: Any, origin: float) -> Lines:
    """What its lines say, of the same reading."""
    said: Lines = p.rig.lines
    return said


def _switch(p: Any, origin: float, enable: float) -> float:
    """The enable line, for the outputs of this period."""
    p.rig.enable = enable
    return origin


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


def of(rig: Any, place: Place = LENGTH) -> Kind:
    """The kind of stage that an open rig is.

    Parameters
    ----------
    rig : Rig
        That measures `encoder`.
    place : Place, optional
        What the places of the machine on it are counted in.

    Returns
    -------
    Kind
        `STAGE`, with the lines that it measures and its enable line.
    """
    return _wired(lines.of((*rig.channels, *getattr(rig, "outputs", ()))), place)


@lru_cache(maxsize=16)
def _wired(there: tuple[str, ...], place: Place) -> Kind:
    kind = STAGE._replace(place=place)
    return kind._replace(lines=there, sense=_sense, switch=_switch) if there else kind


def switched_on(stages: Sequence[Opened], kinds: Sequence[Kind], rise: float, dt: float) -> None:
    """Switch the drives of open rigs on, and wait until they give an effort.

    Parameters
    ----------
    stages : Sequence[Opened]
        The rigs, on one clock; those without an enable line are given no outputs but safe ones, and
        if none has one nothing is done.
    kinds : Sequence[Kind]
        Of each, from `of`.
    rise : float
        How long that takes, s.
    dt : float
        Control period, s.
    """
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
