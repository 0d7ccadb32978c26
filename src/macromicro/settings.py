"""Everything a user may set, in one tree: bench, sensors, controller, guard."""

from __future__ import annotations

from typing import NamedTuple

from macromicro.control.settings import Control
from macromicro.plant.bench import Bench, Sensors
from macromicro.rig.limits import Limits


class Settings(NamedTuple):
    """The tree behind ``--config`` and ``macromicro config show``."""

    bench: Bench = Bench()
    sensors: Sensors = Sensors()
    controller: Control = Control()
    guard: Limits = Limits()
