"""The protocols between the parts: what a rig shows, what it takes, who paces it."""

from __future__ import annotations

import math
from types import TracebackType
from typing import Annotated, Any, NamedTuple, Protocol, Self

from macromicro.columns import Quantity


class Sample(NamedTuple):
    """What a rig shows at one instant. A channel that gave no new value is NaN.

    Fields that are annotated with a `Quantity` are recorded, here and in `Outputs` and `Command`.

    Attributes
    ----------
    t : float
        s.
    encoder : float
        counts.
    hall : float
        V.
    laser : float
        From its last reset, m.
    extend : float
        The actuator's end signal, 0 or 1.
    contract : float
        The actuator's end signal, 0 or 1.
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

    Attributes
    ----------
    motor : float
        V at the D/A.
    ctrl : float
        V at the D/A.
    fan : float
        0 or 1.
    laser_reset : float
        0 or 1.
    """

    motor: Annotated[float, Quantity("V", "motor output at the D/A")]
    ctrl: Annotated[float, Quantity("V", "CTRL output at the D/A")]
    fan: Annotated[float, Quantity("1", "fan output", "i1")]
    laser_reset: Annotated[float, Quantity("1", "laser reset output", "i1")]


class Command(NamedTuple):
    """What a controller is asking of the rig just now, for the guard and the recording.

    Attributes
    ----------
    macro_reference : float
        Set point, counts.
    macro_active : float
        Whether the macro-stage is under control, 0 or 1.
    micro_reference : float
        Set point, m.
    micro_active : float
        Whether the micro-stage is under control, 0 or 1.
    micro_position : float
        The calibrated Hall reading, m.
    """

    macro_reference: Annotated[float, Quantity("count", "set point of the macro-stage")]
    macro_active: float
    micro_reference: Annotated[float, Quantity("mm", "set point of the micro-stage", scale=1e3)]
    micro_active: float
    micro_position: Annotated[
        float,
        Quantity("mm", "contraction by the Hall calibration", column="hall_position", scale=1e3),
    ]


SAFE = Outputs(0.0, 0.0, 0.0, 0.0)


class Lines(NamedTuple):
    """Switches of a machine of one stage, and what its drive says; each a channel of its rig.

    Attributes
    ----------
    limit_low, limit_high : float
        Limit switches: 0 while free; anything else is tripped, a cut wire too.
    home : float
        Home switch, 0 or 1.
    index_count : float
        counts: what the counter read at the encoder's last index pulse, NaN if none has come since
        the reading before.
    drive_fault : float
        The drive's fault output: 0 while it is well.
    enabled : float
        Whether the drive says that it is on, 0 or 1.
    """

    limit_low: Annotated[float, Quantity("1", "lower limit switch (1: tripped)", "i1")]
    limit_high: Annotated[float, Quantity("1", "upper limit switch (1: tripped)", "i1")]
    home: Annotated[float, Quantity("1", "home switch", "i1")]
    index_count: Annotated[float, Quantity("count", "encoder at an index pulse of this period")]
    drive_fault: Annotated[float, Quantity("1", "fault output of the drive", "i1")]
    enabled: Annotated[float, Quantity("1", "the drive says that it is on", "i1")]


class Enable(NamedTuple):
    """The enable output to the drive, 0 or 1."""

    enable: Annotated[float, Quantity("1", "enable output to the drive", "i1")]


QUIET = Lines(0.0, 0.0, 0.0, math.nan, 0.0, 1.0)  # as if of a machine that has none of them
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
            What motor, CTRL, fan and laser reset are to be from now on.
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


class Controller(Protocol):
    """Anything that answers a sample with a command and outputs; ``loop.run`` drives it.

    A controller is pure: its state is handed in and out, it reads no clock and no file.
    """

    def step(
        self, state: Any, reference: Any, sample: Sample, dt: float
    ) -> tuple[Any, Command, Outputs]:
        """One control period: a new state and the outputs, from the old state and a sample.

        Parameters
        ----------
        state : Any
            What the controller remembers, as it last returned it.
        reference : Any
            What is to be reached, in the controller's own form.
        sample : Sample
            What the rig shows now.
        dt : float
            Control period, s.

        Returns
        -------
        state : Any
            The new state.
        command : Command
            What is being asked for, for the guard and the recording.
        outputs : Outputs
            What the rig is to be given.
        """

    def finished(self, state: Any) -> bool:
        """Whether the reference has been completed.

        Parameters
        ----------
        state : Any
            As `step` returned it.

        Returns
        -------
        bool
            True when nothing is left to do.
        """
