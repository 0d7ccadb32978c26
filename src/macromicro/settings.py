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
        """What follows from other settings, unless it is set itself.

        Returns
        -------
        tuple[derived.Derivation, ...]
            Pairs of a path and the rule that computes its value from the tree.
        """
        return derived.DERIVED

    def together(self) -> list[rules.Problem]:
        """What cannot work together.

        Returns
        -------
        list[rules.Problem]
            Path, value, and what is accepted and why; none if all is well.
        """
        return rules.machine(self)
