"""Opens a two-axis machine for the loop process and warms it up."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

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
from macromicro.machines.joint import course, planning
from macromicro.machines.joint.settings import of
from macromicro.rig.session import Session
from macromicro.rig.twin import VirtualClock
from macromicro.serve.joint._machine import Pair
from macromicro.serve.joint._rig import Led
from macromicro.serve.joint._together import Together
from macromicro.serve.joint.settings import JointSettings
from macromicro.serve.loop_spec import Spec
from macromicro.serve.persist import Evident
from macromicro.serve.stage import _machine as live
from macromicro.serve.stage import guide
from macromicro.serve.stage.opening import REST, Like, needed, rehearsed
from macromicro.serve.stage.rig import Real, Simulated
from macromicro.types import ENABLE, Sample


class Opened(NamedTuple):
    """As `loop_process.Opened`."""

    rig: Simulated | Real
    made: Pair
    settings: JointSettings
    paced: bool = False
    counted: bool = False

    def witness(self, sample: Sample) -> Evident:
        return Evident(self.counted, math.nan)

    def machine(self) -> Pair:
        return self.made

    def guarded(self, session: Session) -> Led:
        return Led(session, self.rig)

    def warm(self) -> None:
        settings = self.settings
        rig: Simulated | Real = simulated(settings, 0)
        if isinstance(self.rig, Real):
            rig = _like(settings, self.rig)
        machine, led = paired(settings, rig), Led(Session(rig, settings.period), rig)
        x, y = (0.5 * (own.travel.low + own.travel.high) for own in of(settings.tree))
        plans = planning.plan(course.usual(settings.tree), settings.tree).plans
        slow = settings.live.jogging.slow
        requests = (
            (Stop(), 2),  # nothing is enabled before the first sample, which is seen behind it
            (Enable(), 10),
            (MovePoint(x, y), 40),  # first: homing takes the trust, and then moves are refused
            (Stop(), REST),
            (Programme(plans), 40),
            (Stop(), REST),
            (Jog("x", slow), 40),
            (Jog("x", 0.0), REST),
            (Home(), 40),
            (EmergencyStop(), 10),
            (ClearFault(), 10),
            (Disable(), 10),
        )
        rehearsed(led, machine, settings, requests)


def opened(spec: Spec) -> Opened:
    """The two-axis machine of `spec`; nothing is switched on."""
    settings = spec.settings
    assert isinstance(settings, JointSettings)
    tree, stages = settings.tree, settings.machine.stages
    found = on_rig.found(spec.rig, settings.machine, tree, spec.seed, "serving both axes")
    if found is None:
        twin = simulated(settings, spec.seed)
        return Opened(twin, paired(settings, twin), settings)
    for (name, axis), own, fixture in zip(stages, of(tree), found, strict=True):
        needed(axis, own, fixture, f"{name}.")
    made = [fixture.make(spec.seed + k) for k, fixture in enumerate(found)]
    paced = any(not isinstance(each.clock, VirtualClock) for each in made)
    counted = all(fixture.counted for fixture in found)
    rig = real(settings, made)
    return Opened(rig, paired(settings, rig), settings, paced, counted)


def real(settings: JointSettings, rigs: Sequence[Any]) -> Real:
    sessions = [
        Session(each, own.timing.period) for each, own in zip(rigs, of(settings.tree), strict=True)
    ]
    group = on_rig.Rigs(sessions)
    group.together = True
    return Real(settings.machine, settings.tree, group.members)


def _like(settings: JointSettings, rig: Real) -> Real:
    each = zip(settings.machine.stages, of(settings.tree), rig.rigs, strict=True)
    return real(settings, [Like(a, own, h.channels, h.outputs) for (_, a), own, h in each])


def simulated(settings: JointSettings, seed: int) -> Simulated:
    first, second = (each.pitch for each in settings.lives)
    return Simulated(settings.machine, settings.tree, (first, second), seed)


def paired(settings: JointSettings, rig: Simulated | Real) -> Pair:
    tree = settings.tree
    leds = []
    for k, ((_, axis), own) in enumerate(zip(settings.machine.stages, of(tree), strict=True)):
        lead = guide.guide(axis, own, switched=ENABLE in rig.kinds[k].lines)

        def take(tree: object, k: int = k) -> None:
            rig.control.take(tree, k)

        led = live.Led(guide.parameters(axis, own), lead, settings.period, own, take)
        led.lines = lambda k=k: rig.lines[k]  # type: ignore[misc]
        led.degrees = lambda k=k: rig.lines[k].temperature  # type: ignore[misc]
        led.leaning = lambda k=k: guarding.leaning(rig.control.watches[k])  # type: ignore[misc]
        leds.append(led)
    made = Pair((leds[0], leds[1]), tree, Together(tree))
    made.other = lambda: rig.shown[1]
    made.effort = lambda: rig.control.efforts[1]
    rig.source = lambda: made.courses
    return made
