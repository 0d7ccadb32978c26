"""Opening a machine of two axes for the loop process, and everything once before the first
period."""

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
from macromicro.errors import InputError
from macromicro.machines.joint import course, planning
from macromicro.machines.joint.settings import of
from macromicro.rig.opening import TWIN
from macromicro.rig.session import Session
from macromicro.serve.joint.machine import Pair
from macromicro.serve.joint.rig import Led, Simulated
from macromicro.serve.joint.settings import JointSettings
from macromicro.serve.joint.together import Together
from macromicro.serve.loop_spec import Spec
from macromicro.serve.persist import Evident
from macromicro.serve.stage import guide
from macromicro.serve.stage import machine as live
from macromicro.serve.stage.opening import REST, rehearsed
from macromicro.types import ENABLE, Sample


class Opened(NamedTuple):
    """What `loop_process.Opened` is for the bench."""

    rig: Simulated
    made: Pair
    settings: JointSettings
    paced: bool = False

    def witness(self, sample: Sample) -> Evident:
        """What confirms a position that was kept."""
        return Evident(False, math.nan)

    def machine(self) -> Pair:
        """The live machine."""
        return self.made

    def guarded(self, session: Session) -> Led:
        """The rig under its guards."""
        return Led(session, self.rig)

    def warm(self) -> None:
        """Drive another pair of simulated axes through the very loop."""
        settings = self.settings
        rig = simulated(settings, 0)
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
    """The machine of two axes that `spec` names; nothing is switched on. Raises InputError."""
    settings = spec.settings
    assert isinstance(settings, JointSettings)
    if spec.rig != TWIN:
        accepted = "twin: both axes are served on the simulated machine alone; a rig of yours one "
        accepted += "axis at a time, with a file of `macromicro config show --axis`"
        raise InputError("--rig", spec.rig, accepted)
    rig = simulated(settings, spec.seed)
    return Opened(rig, paired(settings, rig), settings)


def simulated(settings: JointSettings, seed: int) -> Simulated:
    """Both axes of the settings."""
    first, second = (each.pitch for each in settings.lives)
    return Simulated(settings.machine, settings.tree, (first, second), seed)


def paired(settings: JointSettings, rig: Simulated) -> Pair:
    """The live machine of both axes."""
    tree = settings.tree
    leds = []
    for k, (axis, own) in enumerate(zip(settings.machine.axes, of(tree), strict=True)):
        lead = guide.guide(axis, own, switched=ENABLE in axis.kind.lines)

        def take(gains: object, k: int = k) -> None:
            rig.control.take(k, gains)

        led = live.Led(guide.parameters(axis, own), lead, settings.period, own, take)
        led.lines = lambda k=k: rig.lines[k]  # type: ignore[misc]
        leds.append(led)
    made = Pair((leds[0], leds[1]), tree, Together(tree))
    made.other = lambda: rig.second
    made.effort = lambda: rig.control.efforts[1]
    rig.source = lambda: made.courses
    return made
