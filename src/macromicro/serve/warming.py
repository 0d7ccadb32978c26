"""Everything that runs in a period runs once before the first: nothing is imported, compiled
or specialised by the interpreter while a machine is being driven."""

from __future__ import annotations

import math
from collections.abc import Callable

from macromicro.control.live.messages import (
    ClearFault,
    Disable,
    EmergencyStop,
    Enable,
    Fan,
    Home,
    Jog,
    MoveTo,
    Stop,
)
from macromicro.plant import bench
from macromicro.rig.guard import Guard
from macromicro.rig.guarded import CompiledGuarded
from macromicro.rig.twin import CompiledTwin
from macromicro.serve.link import Outbox, pair
from macromicro.serve.machine import Machine
from macromicro.serve.persist import Restored
from macromicro.serve.settings import LiveSettings
from macromicro.serve.shared import PERIOD, Shared
from macromicro.serve.ticking import Loop

_PERIODS = 40
_REQUESTS = (
    Enable(),
    Home(),
    Stop(),
    Fan(True),
    Jog("macro", 0.001),
    Jog("macro", 0.0),
    MoveTo(0.0),
    EmergencyStop(),
    ClearFault(),
    Fan(False),
    Disable(),
)


def warm(make: Callable[[], Machine], limits: Guard, settings: LiveSettings) -> None:
    """Drive a machine of the same make on a virtual bench of its own, through the very loop,
    with its own memory and a socket to nobody, as fast as it goes."""
    plain = LiveSettings()
    twin = CompiledTwin(bench.prepare(plain.bench, plain.sensors), 0)
    shared = Shared.create(256)
    ours, theirs = pair()
    try:
        rig = CompiledGuarded(twin, limits, PERIOD)
        machine = make()
        loop = Loop(rig, machine, shared, Outbox(theirs), settings.serve, PERIOD, False)
        with rig:
            machine.begin(rig.read(), Restored(True, 0.0, "warming"))
            loop.rehearse(_REQUESTS, _PERIODS)
            machine.begin(rig.read(), Restored(False, math.nan, "warming"))
            loop.rehearse(_REQUESTS, _PERIODS)
    finally:
        ours.close()
        theirs.close()
        shared.close()
