"""The protocols between the parts: what a rig shows, what it takes, who paces it."""

from __future__ import annotations

import math
from types import TracebackType
from typing import Annotated, NamedTuple, Protocol, Self

from macromicro.columns import Meaning, Quantity


class Sample(NamedTuple):
    """What a rig shows at one instant. A channel that gave no new value is NaN.

    Fields that are annotated with a `Quantity` are recorded, here and in `Outputs` and `Command`.

    Examples
    --------
    >>> from macromicro.types import Sample
    >>> Sample(0.001, 120.0, 2.5, float("nan"), -1.0, -1.0).hall  # V; the laser gave no new value
    2.5
    """

    t: Annotated[float, Quantity("s", "time since the start")]
    encoder: Annotated[float, Quantity("count", "encoder reading", column="macro_position")]
    hall: Annotated[float, Quantity("V", "Hall sensor at the A/D", column="hall_voltage")]
    laser: Annotated[
        float, Quantity("um", "stage position by the laser since its last reset", scale=1e6)
    ]
    extend: Annotated[float, Quantity("1", "EXTEND signal (-1: not measured)", "i1")]
    contract: Annotated[float, Quantity("1", "CONTRACT signal (-1: not measured)", "i1")]


class Outputs(NamedTuple):
    """What a rig takes.

    Examples
    --------
    >>> from macromicro.types import SAFE, Outputs
    >>> Outputs(motor=1.5, ctrl=0.0, fan=0.0, laser_reset=0.0)
    Outputs(motor=1.5, ctrl=0.0, fan=0.0, laser_reset=0.0)
    >>> SAFE._replace(fan=1.0)
    Outputs(motor=0.0, ctrl=0.0, fan=1.0, laser_reset=0.0)
    """

    motor: Annotated[float, Quantity("V", "motor output at the D/A")]
    ctrl: Annotated[float, Quantity("V", "CTRL output at the D/A")]
    fan: Annotated[float, Quantity("1", "fan output", "i1")]
    laser_reset: Annotated[float, Quantity("1", "laser reset output", "i1")]


class Command(NamedTuple):
    """What a controller is asking of the rig just now, for the guard and the recording.

    Examples
    --------
    >>> from macromicro.types import Command
    >>> Command(1000.0, 1.0, 0.0, 0.0, 0.0).macro_reference  # counts
    1000.0
    """

    macro_reference: Annotated[float, Quantity("count", "set point of the macro-stage")]
    macro_active: Annotated[float, Meaning("whether the macro-stage is under control, 0 or 1")]
    micro_reference: Annotated[float, Quantity("mm", "set point of the micro-stage", scale=1e3)]
    micro_active: Annotated[float, Meaning("whether the micro-stage is under control, 0 or 1")]
    micro_position: Annotated[
        float,
        Quantity("mm", "contraction by the Hall calibration", column="hall_position", scale=1e3),
    ]


SAFE = Outputs(0.0, 0.0, 0.0, 0.0)


class Lines(NamedTuple):
    """Switches, drive lines and temperature of a stage; each a channel of its rig.

    Examples
    --------
    >>> from macromicro.types import Lines
    >>> Lines(0.0, 1.0, 0.0, float("nan"), 0.0, 1.0, 20.0).limit_high  # the upper switch is tripped
    1.0
    """

    limit_low: Annotated[float, Quantity("1", "lower limit switch (1: tripped)", "i1")]
    limit_high: Annotated[float, Quantity("1", "upper limit switch (1: tripped)", "i1")]
    home: Annotated[float, Quantity("1", "home switch", "i1")]
    index_count: Annotated[float, Quantity("count", "encoder at an index pulse of this period")]
    drive_fault: Annotated[float, Quantity("1", "fault output of the drive", "i1")]
    enabled: Annotated[float, Quantity("1", "the drive says that it is on", "i1")]
    temperature: Annotated[float, Quantity("degC", "temperature of the stage")]


class Enable(NamedTuple):
    """The enable output to the drive, 0 or 1.

    Examples
    --------
    >>> from macromicro.types import Enable
    >>> Enable(enable=1.0)
    Enable(enable=1.0)
    """

    enable: Annotated[float, Quantity("1", "enable output to the drive", "i1")]


# As if of a machine that has none of them.
QUIET = Lines(0.0, 0.0, 0.0, math.nan, 0.0, 1.0, math.nan)
ENABLE = "enable"  # the output that a rig may name in its attribute `outputs`


class Clock(Protocol):
    """Time of a rig: real, or virtual and as fast as the machine can compute."""

    def now(self) -> float:
        """Time since the rig was opened.

        Returns
        -------
        float
            Seconds.
        """

    def wait(self, dt: float) -> None:
        """Return when the next control period begins.

        Parameters
        ----------
        dt : float
            Length of a period, s.
        """


class Rig(Protocol):
    """A machine to control, virtual or real. As a context manager it ends safe."""

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the `Sample` fields that this rig really measures."""

    @property
    def clock(self) -> Clock:
        """The clock that paces the loop."""

    def read(self) -> Sample:
        """Measure all channels.

        Returns
        -------
        Sample
            The present values; NaN in a channel that gave no new one.
        """

    def write(self, outputs: Outputs) -> None:
        """Set all outputs.

        Parameters
        ----------
        outputs : Outputs
            New values of motor, CTRL, fan and laser reset.
        """

    def stop(self) -> None:
        """Set every output to its safe value, at once."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...
