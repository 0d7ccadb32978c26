"""The live machine with its guard on the twin, physics compiled; and without a rig."""

from __future__ import annotations

from typing import Any

from macromicro.control.live import machine
from macromicro.control.live import messages as m
from macromicro.control.live.accept import accept
from macromicro.control.live.messages import Accepted, Event, Finished, Reply
from macromicro.control.live.parameters import Live, LiveParameters, prepare
from macromicro.control.live.state import LiveState, begin
from macromicro.control.settings import Control
from macromicro.kernel import compiled
from macromicro.plant import bench
from macromicro.rig import guard
from macromicro.rig.codes import OK
from macromicro.rig.twin import Twin
from macromicro.settings import Settings
from macromicro.types import Command, Outputs, Sample

DT = 1e-3
PITCH = Live().pitch
# A Hall voltage of the shipped calibration at a contraction of nearly nothing.
HALL_OUT = 0.05


class Machine:
    """The machine alone: it is shown samples, and everything that it tells is kept."""

    def __init__(
        self, live: Live | None = None, control: Control | None = None, **begun: Any
    ) -> None:
        self.p: LiveParameters = prepare(live, control)
        self.s: LiveState = begin(self.p, **begun)
        self.events: list[Event] = []
        self.ends: list[Finished] = []
        self.begun: list[int] = []
        self.command = Command(0.0, 0.0, 0.0, 0.0, 0.0)
        self.out = Outputs(0.0, 0.0, 0.0, 0.0)

    @property
    def mode(self) -> str:
        return m.MODES[self.s.mode]

    def note(self, notices: tuple[Any, ...]) -> None:
        for notice in notices:
            (self.ends if isinstance(notice, Finished) else self.events).append(notice)

    def ask(self, request: Any) -> Reply:
        self.s, reply, notices = accept(self.p, self.s, request)
        self.note(notices)
        if isinstance(reply, Accepted) and reply.id and reply.id not in self.begun:
            self.begun.append(reply.id)
        return reply

    def show(self, sample: Sample) -> Outputs:
        self.s, self.command, self.out, notices = machine.step(self.p, self.s, sample, DT)
        self.note(notices)
        return self.out

    def fault(self, words: str = "stuck", **evidence: Any) -> None:
        self.s, notices = machine.fault(self.p, self.s, words, evidence)
        self.note(notices)

    def see(self, encoder: float = 0.0, hall: float = HALL_OUT, seconds: float = DT) -> Outputs:
        """The same readings for some time, but for the noise that any Hall sensor has."""
        for k in range(max(round(seconds / DT), 1)):
            self.show(Sample(self.s.time + DT, encoder, hall + 1e-9 * (k % 2), 0.0, 1.0, 0.0))
        return self.out


class Bench(Machine):
    """The machine on the twin, which is its own rig and clock."""

    def __init__(
        self,
        position: float = 0.0,
        seed: int = 0,
        settings: Settings = Settings(),  # noqa: B008
        **rest: Any,
    ) -> None:
        super().__init__(**rest)
        plant = bench.prepare(settings.bench, settings.sensors)
        self.twin = Twin(
            plant,
            seed,
            DT,
            bench.initial(plant, position),
            compiled(bench.measure),
            compiled(bench.advance),
        )
        self._guard = guard.prepare(settings.guard, self.p.calibration)
        self._judge = compiled(guard.step)
        self.watch = guard.fresh()
        self.given = self.out
        self.leant = 0.0  # the longest that the guard has seen so far [s]

    def tick(self) -> None:
        sample = self.twin.read()
        wanted = self.show(sample)
        self.watch, self.given = self._judge(
            self._guard, self.watch, sample, self.command, wanted, DT
        )
        self.leant = max(self.leant, self.watch.seen.leant)
        if self.watch.fault != OK and self.s.mode != m.FAULT:
            self.fault(f"guard: {self.watch.fault}", value=self.watch.value)
        self.twin.write(self.given)
        self.twin.advance()

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / DT)):
            self.tick()

    def wait(self, most: float) -> Finished:
        """Until the motion under way has ended."""
        ends = len(self.ends)
        for _ in range(round(most / DT)):
            self.tick()
            if len(self.ends) > ends:
                return self.ends[-1]
        raise AssertionError(f"no end within {most} s, mode {self.mode}")

    def true_position(self) -> float:
        """Of the stage [m], in the homed frame: coordinate n names the middle of count n."""
        real = self.twin.truth()
        return real.carriage - (0.5 + self.s.frame.offset) * PITCH + real.micro


def homed(**rest: Any) -> Machine:
    """A machine that stands at count 0, trusted, ready."""
    machine = Machine(coordinate=0.0, trusted=True, **rest)
    machine.see()
    machine.ask(m.Enable())
    return machine
