"""Everything a user may set, in one tree: bench, sensors, controller, guard, travel."""

from __future__ import annotations

from typing import NamedTuple

from macromicro import derived, rules
from macromicro.control.settings import Control
from macromicro.plant.bench import Bench, Sensors
from macromicro.programme.travel import Travel
from macromicro.rig.limits import Limits


class Settings(NamedTuple):
    """The tree behind ``--config`` and ``macromicro config show``."""

    bench: Bench = Bench()
    sensors: Sensors = Sensors()
    controller: Control = Control()
    guard: Limits = Limits()
    travel: Travel = Travel()

    def derived(self) -> tuple[derived.Derivation, ...]:
        """What follows from other settings, unless it is set itself."""
        return derived.DERIVED

    def together(self) -> list[rules.Problem]:
        """What cannot work together."""
        return rules.machine(self)
