"""Opens a single-stage machine for the loop process and warms it up."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from macromicro.control.live.messages import (
    ClearFault,
    Disable,
    EmergencyStop,
    Enable,
    Home,
    Jog,
    MoveTo,
    Stop,
)
from macromicro.errors import ProblemError
from macromicro.machines import guarding, lines, on_rig
from macromicro.machines import rig as machine_rig
from macromicro.machines.machine import Machine
from macromicro.rig.session import Fixture, Session
from macromicro.rig.twin import VirtualClock
from macromicro.serve._machine import Driving
from macromicro.serve.choosing import AnySettings
from macromicro.serve.link import Outbox, pair
from macromicro.serve.loop_spec import Spec
from macromicro.serve.persist import Evident, Restored
from macromicro.serve.shared import Shared
from macromicro.serve.stage import _machine as live
from macromicro.serve.stage import guide
from macromicro.serve.stage import rig as stage_rig
from macromicro.serve.stage.settings import StageSettings
from macromicro.serve.ticking import Loop
from macromicro.types import ENABLE, QUIET, Sample

REST = 100  # periods within which a set point is braked and the stage stands


class Opened(NamedTuple):
    """As `loop_process.Opened`."""

    rig: stage_rig.Simulated | stage_rig.Real
    made: live.Led
    paced: bool
    counted: bool
    settings: StageSettings

    def witness(self, sample: Sample) -> Evident:
        return Evident(self.counted, math.nan)

    def machine(self) -> live.Led:
        return self.made

    def guarded(self, session: Session) -> stage_rig.Led:
        return stage_rig.Led(session, self.rig)

    def warm(self) -> None:
        settings = self.settings
        twin = _simulated(settings, 0)
        rig: stage_rig.Simulated | stage_rig.Real = twin
        if isinstance(self.rig, stage_rig.Real):
            machine, tree = settings.machine, settings.tree
            (own,) = self.rig.rigs
            outputs = tuple(getattr(own, "outputs", ()))
            like = Like(machine, tree, self.rig.channels, outputs)
            rig = stage_rig.Real(machine, tree, (like,))
        middle = 0.5 * (settings.tree.travel.low + settings.tree.travel.high)
        requests = (
            (Stop(), 2),  # nothing is enabled before the first sample, which is seen behind it
            (Enable(), 10),
            (MoveTo(middle), 40),  # first: homing takes the trust, and then moves are refused
            (Stop(), REST),
            (Jog("macro", settings.live.jogging.slow), 40),
            (Jog("macro", 0.0), REST),
            (Home(), 40),
            (EmergencyStop(), 10),
            (ClearFault(), 10),
            (Disable(), 10),
        )
        led = stage_rig.Led(Session(rig, settings.period), rig)
        rehearsed(led, _live(settings, rig), settings, requests)


def rehearsed(led: Driving, machine: Any, settings: AnySettings, requests: Any) -> None:
    """Requests, each with the periods after it."""
    shared = Shared.create(256, settings.telemetry)
    ours, theirs = pair()
    try:
        loop = Loop(led, machine, shared, Outbox(theirs), settings.serve, settings.period, False)
        zeros = (0.0,) * len(settings.axes)
        with led:
            machine.begin(led.read(), Restored(True, 0.0, "warming", zeros))
            loop.rehearse(requests)
            if machine.searches:  # else it is trusted whatever is known from before
                machine.begin(led.read(), Restored(False, math.nan, "warming"))
                loop.rehearse(requests)
    finally:
        ours.close()
        theirs.close()
        shared.close()


class Like(machine_rig.Twin):
    """A twin with the channels and outputs of another rig; missing lines stay quiet."""

    def __init__(
        self, machine: Machine, tree: Any, channels: tuple[str, ...], outputs: tuple[str, ...]
    ) -> None:
        super().__init__(machine.kind, tree)
        self.channels, self.outputs = channels, outputs

    def read(self) -> Any:
        shown = super().read()
        if isinstance(shown, machine_rig.Seen) or not lines.of(self.channels):
            return shown
        return machine_rig.Seen(*shown, *QUIET)


def opened(spec: Spec) -> Opened:
    """The single-stage machine of `spec`; nothing is switched on."""
    settings = spec.settings
    assert isinstance(settings, StageSettings)
    found = on_rig.found(spec.rig, settings.machine, settings.tree, spec.seed, "serving")
    if found is None:
        twin = _simulated(settings, spec.seed)
        return Opened(twin, _live(settings, twin), False, False, settings)
    (fixture,) = found
    needed(settings.machine, settings.tree, fixture)
    made = fixture.make(spec.seed)
    paced = not isinstance(made.clock, VirtualClock)
    real = stage_rig.Real(settings.machine, settings.tree, (made,))
    return Opened(real, _live(settings, real), paced, fixture.counted, settings)


def needed(machine: Machine, tree: Any, fixture: Fixture, where: str = "") -> None:
    """Refuse a rig without a line that homing needs."""
    touch = guide.guide(machine, tree).touch
    seek = None if touch is None else touch.seek
    if seek is None:
        return
    needs = (seek.line, "index_count" if seek.pulse else "")
    missing = [name for name in needs if name and not fixture.has(name)]
    if missing:
        problem = f'{where}homing.on = "{tree.homing.on}" needs {" and ".join(missing)}'
        remedy = f"The rig has {', '.join(fixture.channels)}."
        raise ProblemError(f"--rig {fixture.name}, channels", problem, remedy)


def _simulated(settings: StageSettings, seed: int) -> stage_rig.Simulated:
    machine, tree = settings.machine, settings.tree
    return stage_rig.Simulated(machine, tree, (settings.live.pitch,), seed)


def _live(settings: StageSettings, rig: stage_rig.Simulated | stage_rig.Real) -> live.Led:
    machine, tree = settings.machine, settings.tree
    q = guide.guide(machine, tree, switched=ENABLE in rig.kinds[0].lines)
    made = live.Led(guide.parameters(machine, tree), q, settings.period, tree, rig.control.take)
    made.lines = lambda: rig.lines[0]
    made.degrees = lambda: rig.lines[0].temperature
    made.leaning = lambda: guarding.leaning(rig.control.watch)
    return made
