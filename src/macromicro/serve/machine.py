"""What the loop process drives: a machine that answers samples and requests."""

from __future__ import annotations

import math
from types import TracebackType
from typing import Annotated, Any, NamedTuple, Protocol, Self

from macromicro.columns import Quantity
from macromicro.control.live.messages import Notice, Refused, Reply
from macromicro.control.live.parameters import SoftLimits
from macromicro.serve.persist import Restored
from macromicro.types import Clock, Command, Outputs, Sample


class View(NamedTuple):
    """What the telemetry shows of a machine. `mode`: index into `messages.MODES`; `motion`:
    number under way, or 0; integrals [V]; `position`, `uncertainty` [m]; `trusted` 0 or 1;
    `offset` [counts]: what the encoder reads at coordinate 0; `limits`: soft limits in force;
    `target` [m]: where it goes, or rests on target, NaN where it does neither."""

    mode: Annotated[
        float, Quantity("1", "mode of the live machine, as its attribute `modes` lists them", "i1")
    ]
    motion: Annotated[float, Quantity("1", "number of the motion under way, 0 for none", "i4")]
    macro_integral: Annotated[float, Quantity("V", "integral effort of the macro controller")]
    micro_integral: Annotated[float, Quantity("V", "integral effort of the micro controller")]
    position: Annotated[float, Quantity("mm", "absolute position of the whole system", scale=1e3)]
    uncertainty: Annotated[
        float,
        Quantity("um", "half width of the interval that holds this position", scale=1e6),
    ]
    trusted: Annotated[float, Quantity("1", "is the position known since homing? 0 or 1", "i1")]
    offset: float
    limits: SoftLimits = SoftLimits()
    target: float = math.nan


class Second(NamedTuple):
    """What the telemetry shows of the second axis of a machine of two. `offset` [counts]: what its
    encoder reads at coordinate 0; `target` [m]: as of `View`."""

    counts: Annotated[float, Quantity("count", "encoder of the axis y", column="y_count")]
    reference: Annotated[float, Quantity("count", "set point of the axis y", column="y_reference")]
    motor: Annotated[float, Quantity("V", "effort of the axis y", column="y_motor")]
    position: Annotated[
        float, Quantity("mm", "position of the axis y", column="y_position", scale=1e3)
    ]
    uncertainty: Annotated[
        float,
        Quantity(
            "um",
            "half width of the interval that holds the position of the axis y",
            column="y_uncertainty",
            scale=1e6,
        ),
    ]
    offset: float
    target: float = math.nan


SECONDLY = Second(*[math.nan] * 6)


class Machine(Protocol):
    """A live machine, its state inside. It never waits, and uses no clock and no file."""

    def begin(self, sample: Sample, restored: Restored) -> None:
        """The loop starts: the first sample, and what is known from before."""

    def step(self, sample: Sample, dt: float) -> tuple[Command, Outputs, tuple[Notice, ...]]:
        """One control period."""

    def accept(self, request: Any) -> tuple[Reply, tuple[Notice, ...]]:
        """A request, between two periods."""

    def refusal(self, request: Any) -> Refused | None:
        """Why this request would be refused now; changes nothing."""

    def fail(self, words: str, evidence: dict[str, Any], position_lost: bool) -> tuple[Notice, ...]:
        """The loop has made the outputs safe (the guard tripped, periods were missed): latch.

        `position_lost`: counts may have been missed.
        """

    def lose(self, words: str) -> tuple[Notice, ...]:
        """Counts may have been missed: the position is not known any more."""

    def doubt(self, words: str) -> tuple[Notice, ...]:
        """The Hall sensor's readings are no contraction (`words`: why), or are one again ("")."""

    def found(self) -> tuple[float, float] | None:
        """A fault that the machine has found and latched itself, its outputs safe: the
        carriage's place [counts] by the laser and by the encoder; None without one."""

    def view(self) -> View:
        """The present state, for the telemetry."""


class Guard(Protocol):
    """The opened rig under its guard, as the loop drives it: what is written has passed it."""

    @property
    def channels(self) -> tuple[str, ...]:
        """What the rig measures."""

    @property
    def clock(self) -> Clock:
        """What paces the loop."""

    @property
    def given(self) -> Outputs:
        """The outputs as they were last given."""

    @property
    def tripped(self) -> bool:
        """Has a fault latched?"""

    @property
    def temperature(self) -> float:
        """Of the wires [degC], estimated; NaN where it has none."""

    @property
    def doubt(self) -> str:
        """Why the Hall sensor's reading is no contraction just now, "" where it is one."""

    def read(self) -> Sample:
        """What the rig shows."""

    def expect(self, command: Command) -> None:
        """What the machine asks for in this period."""

    def write(self, outputs: Outputs) -> None:
        """Give outputs if they pass."""

    def stop(self) -> None:
        """Every output to its safe value."""

    def evidence(self) -> tuple[float, float, float, float]:
        """Code, value, limit and time [s] of the latched fault."""

    def fault(self) -> tuple[Explained, bool]:
        """The latched fault in words, and whether counts may have been missed."""

    def renew(self) -> None:
        """Unlatch."""

    def overlooked(self) -> str:
        """Why counts may have been missed while a fault is latched, or ""."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...


class Explained(Protocol):
    """A fault in words."""

    @property
    def name(self) -> str:
        """Short."""

    @property
    def evidence(self) -> str:
        """What was measured, and its limit."""
