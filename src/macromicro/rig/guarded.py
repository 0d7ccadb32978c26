"""The guard around any rig: what is written has passed it, what it stops stays stopped."""

from __future__ import annotations

from types import TracebackType
from typing import Self

from macromicro.rig import guard
from macromicro.rig.codes import OK
from macromicro.rig.guard import Guard, Watch
from macromicro.types import SAFE, Clock, Command, Outputs, Rig, Sample

IDLE = Command(0.0, 0.0, 0.0, 0.0, 0.0)


class Guarded:
    """A `Rig` that refuses illegal outputs and switches off on a fault.

    Of a sensor that the rig does not have (its `channels`) no values are expected.

    Before each `write`, tell it with `expect` what the controller is asking for, so that
    following errors can be judged; without it only outputs and sensors are watched.
    """

    def __init__(self, rig: Rig, limits: Guard, dt: float) -> None:
        self.rig = rig
        self.watch: Watch = guard.fresh()
        self.given: Outputs = SAFE
        self._limits = limits
        self._dt = dt
        self._sample: Sample | None = None
        self._command = IDLE
        self._absent = {f"{c}_age": 0.0 for c in ("encoder", "hall") if c not in rig.channels}

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels of the rig inside."""
        return self.rig.channels

    @property
    def clock(self) -> Clock:
        """Clock of the rig inside."""
        return self.rig.clock

    @property
    def tripped(self) -> bool:
        """Has a fault latched?"""
        return self.watch.fault != OK

    def read(self) -> Sample:
        """Measure, and remember the sample for the judgement of the next `write`."""
        self._sample = self.rig.read()
        return self._sample

    def expect(self, command: Command) -> None:
        """What the controller is asking for in this period."""
        self._command = command

    def write(self, outputs: Outputs) -> None:
        """Write `outputs` if they pass; otherwise, and after any fault, safe values."""
        sample = self._sample if self._sample is not None else self.read()
        watch = self.watch
        if self._absent:
            watch = watch._replace(seen=watch.seen._replace(**self._absent))
        self.watch, self.given = guard.step(
            self._limits, watch, sample, self._command, outputs, self._dt
        )
        self.rig.write(self.given)
        self._command = IDLE
        self._sample = None

    def stop(self) -> None:
        """Set every output to its safe value."""
        self.given = SAFE
        self.rig.stop()

    def __enter__(self) -> Self:
        self.rig.__enter__()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            self.stop()
        finally:  # the rig inside goes safe by itself too, should its `stop` fail
            self.rig.__exit__(kind, error, trace)
