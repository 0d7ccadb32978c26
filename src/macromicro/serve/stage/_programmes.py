"""Programmes of clients for a single-stage machine."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from macromicro.control.live.parameters import SoftLimits
from macromicro.machines import pace, planning
from macromicro.programme import Programme
from macromicro.serve._programmes import Planned

USUAL = "usual"


class OneStage(NamedTuple):
    """`Programmes` of a single-stage machine with settings `tree`."""

    tree: Any

    def names(self) -> tuple[str, ...]:
        return (USUAL,)

    def named(self, name: str, soft: SoftLimits) -> Planned:
        return self._planned(planning.usual(self._within(soft)), soft)

    def read(self, path: Path, soft: SoftLimits) -> Planned:
        found = planning.load(path, self._within(soft), pace.period(self.tree))
        return self._planned(found, soft)

    def _planned(self, found: Programme, soft: SoftLimits) -> Planned:
        plan = planning.plan(found, self._within(soft), anywhere=True)
        return Planned(found.title, plan, len(plan.target))

    def _within(self, soft: SoftLimits) -> Any:
        travel = self.tree.travel._replace(low=soft.whole_low, high=soft.whole_high)
        return self.tree._replace(travel=travel)
