"""The interface between the loop and a live machine."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, Protocol

from macromicro.columns import Column, Quantity
from macromicro.control.live.leading import Course
from macromicro.control.live.messages import Notice, Refused, Reply
from macromicro.control.live.parameters import SoftLimits
from macromicro.serve.persist import Evident, Restored
from macromicro.types import Command, Outputs, Sample

if TYPE_CHECKING:
    from macromicro.rig import guarded
    from macromicro.rig.session import Session
    from macromicro.serve.stage import rig

    Guard = guarded.Guarded | rig.Guarded  # around one, or one that runs the laws as well


class View(NamedTuple):
    """What the telemetry shows of a machine."""

    mode: Annotated[
        float, Quantity("1", "mode of the live machine, as its attribute `modes` lists them", "i1")
    ]
    motion: Annotated[float, Quantity("1", "number of the motion under way, 0 for none", "i4")]
    macro_integral: Annotated[float, Quantity("V", "integral effort of the macro controller")]
    micro_integral: Annotated[float, Quantity("V", "integral effort of the micro controller")]
    position: Annotated[float, Quantity("mm", "absolute position of the whole system", scale=1e3)]
    uncertainty: Annotated[
        float, Quantity("um", "half width of the interval that holds this position", scale=1e6)
    ]
    trusted: Annotated[float, Quantity("1", "is the position known since homing? 0 or 1", "i1")]
    offset: float  # encoder counts at coordinate 0
    limits: SoftLimits = SoftLimits()
    target: float = math.nan  # NaN while it has none


Point = tuple[tuple[float, float], ...]  # position, m, and velocity, m/s, of each stage


class StageView(NamedTuple):
    """What telemetry and status show of one of several stages."""

    counts: float
    reference: float  # counts
    motor: float  # V
    position: float
    uncertainty: float
    offset: float  # encoder counts at coordinate 0
    target: float  # NaN while it has none

    def row(self) -> tuple[float, ...]:
        """Its values for `stage_columns`."""
        fine = self.uncertainty * 1e6
        return self.counts, self.reference, self.motor, self.position * 1e3, fine


def stage_columns(name: str) -> tuple[Column, ...]:
    """The telemetry of a stage after the first."""
    of = f"of the axis {name}"
    return (
        Column(f"{name}_count", "count", f"encoder {of}"),
        Column(f"{name}_reference", "count", f"set point {of}"),
        Column(f"{name}_motor", "V", f"effort {of}"),
        Column(f"{name}_position", "mm", f"position {of}"),
        Column(
            f"{name}_uncertainty", "um", f"half width of the interval that holds the position {of}"
        ),
    )


class Machine(Protocol):
    """A live machine with its state; it never waits and uses no clock or file."""

    @property
    def courses(self) -> Sequence[Course]:
        """What the laws of the stages are given for the coming period; nothing without such."""

    def begin(self, sample: Sample, restored: Restored) -> None:
        """Start with the first sample and the saved position."""

    def step(self, sample: Sample, dt: float) -> tuple[Command, Outputs, tuple[Notice, ...]]: ...

    def accept(self, request: Any) -> tuple[Reply, tuple[Notice, ...]]: ...

    def heard(self, point: Point, age: float) -> tuple[Notice, ...]:
        """Take a streamed set point that is `age` seconds old."""

    def renew(self) -> None:
        """Note that the client of a jog is alive."""

    def refusal(self, request: Any) -> Refused | None:
        """Why this request would be refused now."""

    def fail(self, words: str, evidence: dict[str, Any], position_lost: bool) -> tuple[Notice, ...]:
        """Latch a fault after the loop has made the outputs safe."""

    def lose(self, words: str) -> tuple[Notice, ...]:
        """Note that counts may have been missed: the position is unknown."""

    def doubt(self, words: str) -> tuple[Notice, ...]:
        """Note that the Hall sensor is implausible (`words`), or plausible again ("")."""

    def found(self) -> tuple[float, float] | None:
        """A fault that the machine latched itself, with the counts by laser and by encoder."""

    def view(self) -> View: ...


class Opened(NamedTuple):
    """An opened machine, on which nothing is switched on."""

    rig: Any
    machine: Machine
    guarded: Callable[[Session], Guard]
    warm: Callable[[], None]  # runs everything of a period once
    paced: bool = False  # its own clock waits
    counted: bool = False  # its counter keeps counting while nothing runs
    laser: Callable[[Sample], float] = lambda sample: math.nan  # carriage position by a laser, m

    def witness(self, sample: Sample) -> Evident:
        """Evidence for a saved position."""
        return Evident(self.counted, self.laser(sample))
