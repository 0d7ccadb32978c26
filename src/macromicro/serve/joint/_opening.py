"""Opens a machine of several stages for the loop process and warms it up."""

from __future__ import annotations

import math
from typing import NamedTuple

from macromicro.control.live.messages import (
    ClearFault,
    Disable,
    EmergencyStop,
    Enable,
    Home,
    Jog,
    MovePoint,
    Programme,
    Stop,
)
from macromicro.machines import guarding, on_rig
from macromicro.machines.composite import IN_TURN
from macromicro.machines.stage_trees import all_of
from macromicro.rig.session import Session
from macromicro.rig.twin import VirtualClock
from macromicro.serve.joint._machine import StageGroup
from macromicro.serve.joint._rig import Led
from macromicro.serve.joint._together import Together
from macromicro.serve.joint.settings import JointSettings
from macromicro.serve.loop_spec import Spec
from macromicro.serve.persist import Evident
from macromicro.serve.stage import _machine as live
from macromicro.serve.stage import guide
from macromicro.serve.stage._programmes import USUAL
from macromicro.serve.stage.opening import REST, Like, needed, rehearsed
from macromicro.serve.stage.rig import Real, Simulated
from macromicro.types import ENABLE, Sample


class Opened(NamedTuple):
    """As `loop_process.Opened`."""

    rig: Simulated | Real
    made: StageGroup
    settings: JointSettings
    paced: bool = False
    counted: bool = False

    def witness(self, sample: Sample) -> Evident:
        return Evident(self.counted, math.nan)

    def machine(self) -> StageGroup:
        return self.made

    def guarded(self, session: Session) -> Led:
        return Led(session, self.rig, self.settings.axes)

    def warm(self) -> None:
        settings = self.settings
        rig: Simulated | Real = simulated(settings, 0)
        if isinstance(self.rig, Real):
            rig = _like(settings, self.rig)
        machine = grouped(settings, rig)
        led = Led(Session(rig, settings.period), rig, settings.axes)
        ends = {name: live.limits for name, live in settings.axes}
        middle = {name: 0.5 * (end.whole_low + end.whole_high) for name, end in ends.items()}
        plans = settings.programmes.named(USUAL, settings.live.limits).plan
        first, slow = settings.stages[0], settings.live.jogging.slow
        requests = (
            (Stop(), 2),  # nothing is enabled before the first sample, which is seen behind it
            (Enable(), 10),
            (MovePoint(middle), 40),  # first: homing takes the trust, and then moves are refused
            (Stop(), REST),
            (Programme(plans), 40),
            (Stop(), REST),
            (Jog(first, slow), 40),
            (Jog(first, 0.0), REST),
            (Home(), 40),
            (EmergencyStop(), 10),
            (ClearFault(), 10),
            (Disable(), 10),
        )
        rehearsed(led, machine, settings, requests)


def opened(spec: Spec) -> Opened:
    """The machine of several stages of `spec`; nothing is switched on."""
    settings = spec.settings
    assert isinstance(settings, JointSettings)
    trees, stages = settings.machine.trees(settings.tree), settings.machine.stages
    what = f"serving {all_of(len(stages))}"
    found = on_rig.found(spec.rig, settings.machine, settings.tree, spec.seed, what)
    if found is None:
        twin = simulated(settings, spec.seed)
        return Opened(twin, grouped(settings, twin), settings)
    for (name, axis), own, fixture in zip(stages, trees, found, strict=True):
        needed(axis, own, fixture, f"{name}.")
    made = [fixture.make(spec.seed + k) for k, fixture in enumerate(found)]
    paced = any(not isinstance(each.clock, VirtualClock) for each in made)
    counted = all(fixture.counted for fixture in found)
    rig = Real(settings.machine, settings.tree, made)
    return Opened(rig, grouped(settings, rig), settings, paced, counted)


def _like(settings: JointSettings, rig: Real) -> Real:
    trees = settings.machine.trees(settings.tree)
    each = zip(settings.machine.stages, trees, rig.rigs, strict=True)
    likes = [Like(a, own, h.channels, h.outputs) for (_, a), own, h in each]
    return Real(settings.machine, settings.tree, likes)


def simulated(settings: JointSettings, seed: int) -> Simulated:
    pitches = [live.pitch for live in settings.lives]
    return Simulated(settings.machine, settings.tree, pitches, seed)


def grouped(settings: JointSettings, rig: Simulated | Real) -> StageGroup:
    """The live machine on such a rig, which asks it for the set points."""
    machine, tree = settings.machine, settings.tree
    trees, leds = machine.trees(tree), {}
    for k, ((name, axis), own) in enumerate(zip(machine.stages, trees, strict=True)):
        lead = guide.guide(axis, own, switched=ENABLE in rig.kinds[k].lines)

        def take(tree: object, k: int = k) -> None:
            rig.control.take(tree, k)

        led = live.Led(guide.parameters(axis, own), lead, settings.period, own, take)
        led.lines = lambda k=k: rig.lines[k]  # type: ignore[misc]
        led.degrees = lambda k=k: rig.lines[k].temperature  # type: ignore[misc]
        led.leaning = lambda k=k: guarding.leaning(rig.control.watches[k])  # type: ignore[misc]
        leds[name] = led
    path = (tree.path.speed, tree.path.acceleration) if machine.has_plane else ()
    in_turn = machine.order == IN_TURN
    return StageGroup(
        leds,
        Together(trees, *path),
        lambda: rig.shown,
        lambda: rig.control.efforts,
        in_turn=in_turn,
    )
