"""The loop in the test's own process, on a bench without a clock."""

from __future__ import annotations

from collections.abc import Callable

from serve_parts import Driver

from macromicro.control import calibration
from macromicro.control.live import messages as m
from macromicro.rig import guard
from macromicro.rig.guarded import Guarded
from macromicro.rig.limits import Limits
from macromicro.serve.link import Outbox, pair
from macromicro.serve.persist import Evident
from macromicro.serve.settings import ServeSettings
from macromicro.serve.shared import LEAVE, Shared
from macromicro.serve.ticking import Loop
from macromicro.types import SAFE, Outputs, Sample


class Bench:
    """A rig in this process, as fast as it goes; `at[k]` is done within reading number k."""

    channels = ("encoder", "hall")

    def __init__(self, machine: Driver) -> None:
        self.clock, self.steps, self.count = self, 0, 0.0
        self.at: dict[int, Callable[[], None]] = {}
        self.order = machine.log

    def now(self) -> float:
        return self.steps * 1e-3

    def wait(self, dt: float) -> None:
        pass

    def read(self) -> Sample:
        self.steps += 1
        self.at.get(self.steps, int)()
        volts = 2.5 + 1e-3 * (self.steps % 2)
        return Sample(self.now(), self.count, volts, 0.0, 0.0, 0.0)

    def write(self, outputs: Outputs) -> None:
        self.order.append("safe" if outputs == SAFE else "on")

    def stop(self) -> None:
        self.write(SAFE)

    def __enter__(self) -> Bench:
        return self

    def __exit__(self, *what: object) -> None:
        pass


class Scene:
    def __init__(self) -> None:
        self.machine = Driver()
        self.bench = Bench(self.machine)
        self.shared = Shared.create(5000)
        self.ours, theirs = pair()
        limits = guard.prepare(Limits(), calibration.default_calibration())
        self.rig = Guarded(self.bench, limits, 1e-3)
        self.settings = ServeSettings(parent_timeout=10.0, miss_share=1.0)
        self.loop = Loop(
            self.rig, self.machine, self.shared, Outbox(theirs), self.settings, 1e-3, True
        )

    def leave(self) -> None:
        self.shared.cells[LEAVE] = 1

    def run(self) -> list[str]:
        """What happened from reading 50 on, a motion under way since reading 2."""
        self.bench.at[2] = lambda: self.machine.accept(m.MoveTo(600.0)) and None
        seen = self.bench.at.get(50, int)

        def begin() -> None:
            self.machine.log.clear()
            seen()

        self.bench.at[50] = begin
        self.bench.at[60] = self.leave
        self.loop.run("no position was saved", "test", lambda sample: Evident())
        return self.machine.log
