"""The guard around any rig: what is written has passed it, what it stops stays stopped."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import islice
from typing import Any, Self

import numpy as np

from macromicro.arrays import Array, packed
from macromicro.kernel import compiled, kernel
from macromicro.models.electrothermal import Heating
from macromicro.rig import codes, guard, sensing
from macromicro.rig.codes import OK
from macromicro.rig.envelope import Envelope
from macromicro.rig.faults import Fault, describe
from macromicro.rig.guard import Guard, Heat, Watch
from macromicro.rig.sensing import Seen
from macromicro.types import SAFE, Clock, Command, Outputs, Rig, Sample

IDLE = Command(0.0, 0.0, 0.0, 0.0, 0.0)
_BLIND = (codes.ENCODER_SILENT, codes.ENCODER_JUMP, codes.ENCODER_AGAINST, codes.STUCK)


class Guarded:
    """A `Rig` that refuses illegal outputs and switches off on a fault.

    Call `expect` before each `write`, or following errors are not judged. A rig that closes the
    loop itself has an `aim` and reports what it `put_out`.
    """

    def __init__(self, rig: Rig, limits: Guard, dt: float) -> None:
        self.rig = rig
        self._limits, self._dt = limits, dt
        self.watch = guard.fresh()
        self.given: Outputs = SAFE
        self._sample: Sample | None = None
        self._command = IDLE
        self._there = ("encoder" in rig.channels, "hall" in rig.channels)

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels of the rig inside."""
        return self.rig.channels

    @property
    def clock(self) -> Clock:
        """Clock of the rig inside."""
        return self.rig.clock

    @property
    def doubt(self) -> str:
        """Why the Hall sensor's reading is no contraction just now, "" where it is one."""
        return sensing.DOUBTS[self._doubted()]

    def _doubted(self) -> int:
        return sensing.doubt(self._limits.limits, self.watch.seen, self._dt)

    @property
    def tripped(self) -> bool:
        """Has a fault latched?"""
        return self.watch.fault != OK

    @property
    def temperature(self) -> float:
        """Wire temperature [degC] by the guard's own estimate."""
        return guard.temperature(self._limits.limits, self.watch)

    def evidence(self) -> tuple[float, float, float, float]:
        """What a latched fault was found by."""
        watch = self.watch
        return float(watch.fault), watch.value, watch.limit, watch.time

    def fault(self) -> tuple[Fault, bool]:
        """The latched fault."""
        found = describe(self.watch)
        assert found is not None
        return found, found.code in _BLIND

    def renew(self) -> None:
        """Clear the fault; the estimated heat and the last count stay."""
        fresh, before = guard.fresh(), self.watch
        last = before.seen
        seen = fresh.seen._replace(
            encoder=last.encoder, encoder_age=last.encoder_age, time=last.time
        )
        self.watch = fresh._replace(seen=seen, heat=before.heat._replace(idle=0.0))

    def overlooked(self) -> str:
        """Why counts may have been missed while a fault is latched."""
        seen = self.watch.seen
        if seen.encoder_age > 0.0:
            return "no reading of the encoder while a fault was latched"
        if seen.jump > seen.possible:
            return "the encoder jumped while a fault was latched"
        return ""

    def read(self) -> Sample:
        """Measure, and remember the sample for the judgement of the next `write`."""
        shown: Any = self.rig.read()
        if not isinstance(shown, Sample):
            shown = Sample(*(getattr(shown, name, math.nan) for name in Sample._fields))
        sample: Sample = shown
        self._sample = sample
        return sample

    def expect(self, command: Command) -> None:
        """Say what the controller is asking for in this period."""
        self._command = command

    def write(self, outputs: Outputs) -> None:
        """Write outputs if they pass; otherwise, and after any fault, safe values."""
        sample = self._sample if self._sample is not None else self.read()
        self.given = self._judged(sample, self._command, outputs)
        aim = getattr(self.rig, "aim", None)
        if aim is not None and not self.tripped:
            aim(self._command)
        self.rig.write(self.given)
        own: Outputs | None = getattr(self.rig, "put_out", None)
        if own is not None and not self.tripped:
            self.given = own
        self._command = IDLE
        self._sample = None

    def _judged(self, sample: Sample, command: Command, outputs: Outputs) -> Outputs:
        watch = self.watch
        if not all(self._there):
            watch = watch._replace(seen=sensing.expecting(watch.seen, *self._there))
        self.watch, given = guard.step(self._limits, watch, sample, command, outputs, self._dt)
        return given

    def stop(self) -> None:
        """Set every output to its safe value."""
        self.given = SAFE
        self.rig.stop()

    def __enter__(self) -> Self:
        self.rig.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        try:
            self.stop()
        finally:  # the rig inside goes safe by itself too, should its `stop` fail
            self.rig.__exit__(*error)


_SEEN = 4  # where the parts of the guard's state begin in a row of numbers
_MACRO = _SEEN + len(Seen._fields)
_MICRO = _MACRO + len(Envelope._fields)
_HEATING = _MICRO + len(Envelope._fields)
_HEAT = _HEATING + len(Heating._fields)
FIELDS = _HEAT + 2


@kernel
def store(s: Watch, row: Any) -> None:
    """Write the guard's state into a row of numbers."""
    row[0], row[1], row[2], row[3] = float(s.fault), s.value, s.limit, s.time
    for k in range(len(s.seen)):
        row[_SEEN + k] = s.seen[k]
    for k in range(len(s.macro)):
        row[_MACRO + k], row[_MICRO + k] = s.macro[k], s.micro[k]
    for k in range(len(s.heat.heating)):
        row[_HEATING + k] = s.heat.heating[k]
    row[_HEAT], row[_HEAT + 1] = s.heat.anchor, s.heat.idle


def restored(row: Sequence[float]) -> Watch:
    """The guard's state from what `store` has written."""
    numbers = iter(row)

    def part(kind: Any) -> Any:
        return kind(*islice(numbers, len(kind._fields)))

    fault, value, limit, time = islice(numbers, _SEEN)
    seen, macro, micro, heating = part(Seen), part(Envelope), part(Envelope), part(Heating)
    return Watch(int(fault), value, limit, time, seen, macro, micro, Heat(heating, *numbers))


_JUDGE, _SHOW = 0.0, 1.0
_ENCODER, _HALL, _SAMPLE = 1, 2, 3  # places in what is asked; 0 is the order
_COMMAND = _SAMPLE + len(Sample._fields)
_OUTPUTS = _COMMAND + len(Command._fields)
_ASKED = _OUTPUTS + len(Outputs._fields)
_JUDGED = packed(_ASKED - _SAMPLE)


def _guard(
    p: Guard, s: Watch, asked: Array, answer: Array, state: Array, dt: float
) -> Iterator[int]:
    """The guard as a coroutine: each `next` executes `asked` and yields the latched fault."""
    while True:
        if asked[0] == _JUDGE:
            a, c, o = _SAMPLE, _COMMAND, _OUTPUTS
            sample = Sample(
                asked[a], asked[a + 1], asked[a + 2], asked[a + 3], asked[a + 4], asked[a + 5]
            )
            command = Command(asked[c], asked[c + 1], asked[c + 2], asked[c + 3], asked[c + 4])
            outputs = Outputs(asked[o], asked[o + 1], asked[o + 2], asked[o + 3])
            seen = sensing.expecting(s.seen, asked[_ENCODER] == 1.0, asked[_HALL] == 1.0)
            s = Watch(s.fault, s.value, s.limit, s.time, seen, s.macro, s.micro, s.heat)
            s, given = guard.step(p, s, sample, command, outputs, dt)
            answer[0] = given.motor
            answer[1] = given.ctrl
            answer[2] = given.fan
            answer[3] = given.laser_reset
            answer[4] = guard.temperature(p.limits, s)
            answer[5] = float(sensing.doubt(p.limits, s.seen, dt))
        else:
            store(s, state)
        yield s.fault


class CompiledGuarded(Guarded):
    """`Guarded` with its state in compiled code, for real time; the bits are the same."""

    _fault: int
    _temperature: float

    def __init__(self, rig: Rig, limits: Guard, dt: float) -> None:
        self._asked = np.zeros(_ASKED)
        self._answer = np.zeros(6)
        self._state = np.zeros(FIELDS)
        super().__init__(rig, limits, dt)
        self._asked[_ENCODER : _HALL + 1] = self._there

    @property
    def watch(self) -> Watch:
        """The guard's state."""
        self._asked[0] = _SHOW
        next(self._guard)
        return restored(self._state.tolist())

    @watch.setter
    def watch(self, watch: Watch) -> None:
        self._fault = watch.fault
        # The coroutine refers to the arrays of this object, and does not own them.
        self._guard = compiled(_guard)(
            self._limits, watch, self._asked, self._answer, self._state, self._dt
        )
        self._temperature = guard.temperature(self._limits.limits, watch)

    @property
    def tripped(self) -> bool:
        """Has a fault latched?"""
        return self._fault != OK

    @property
    def temperature(self) -> float:
        """Wire temperature [degC] by the guard's own estimate."""
        return self._temperature

    def _doubted(self) -> int:
        return int(self._answer[5])

    def _judged(self, sample: Sample, command: Command, outputs: Outputs) -> Outputs:
        asked = self._asked
        asked[0] = _JUDGE
        _JUDGED.pack_into(asked.data, asked.itemsize * _SAMPLE, *sample, *command, *outputs)
        self._fault = next(self._guard)
        motor, ctrl, fan, reset, self._temperature, _ = self._answer.tolist()
        return Outputs(motor, ctrl, fan, reset)
