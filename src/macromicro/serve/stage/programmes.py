"""Programmes as clients send them to a machine of one stage."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from macromicro.control.live.parameters import SoftLimits
from macromicro.machines import planning
from macromicro.programme import Programme
from macromicro.serve.programmes import Planned

USUAL = "usual"


class OneStage(NamedTuple):
    """`serve.programmes.Programmes` of a machine of one stage. `tree`: its settings."""

    tree: Any

    def names(self) -> tuple[str, ...]:
        """The moves that `macromicro run` makes without a programme."""
        return (USUAL,)

    def named(self, name: str, soft: SoftLimits) -> Planned:
        """Those moves, within the soft limits."""
        return self._planned(planning.usual(self._within(soft)), soft)

    def read(self, path: Path, soft: SoftLimits) -> Planned:
        """Moves, motion profiles or a trajectory in a file."""
        return self._planned(planning.load(path, self._within(soft)), soft)

    def _planned(self, found: Programme, soft: SoftLimits) -> Planned:
        plan = planning.plan(found, self._within(soft), anywhere=True)
        return Planned(found.title, plan, len(plan.target))

    def _within(self, soft: SoftLimits) -> Any:
        travel = self.tree.travel._replace(low=soft.whole_low, high=soft.whole_high)
        return self.tree._replace(travel=travel)
