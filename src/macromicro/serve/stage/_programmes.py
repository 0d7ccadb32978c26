"""Programmes of clients for a machine of one or several stages."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from macromicro.control.live.parameters import SoftLimits
from macromicro.machines import moves, pace, planning
from macromicro.machines.composite import Composite
from macromicro.machines.joint import course
from macromicro.machines.joint import planning as paths
from macromicro.machines.moves import Course
from macromicro.nominal import PERIOD
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


class SeveralStages(NamedTuple):
    """`Programmes` of a machine of several stages with settings `tree`."""

    machine: Composite
    tree: Any

    def names(self) -> tuple[str, ...]:
        return (USUAL,)

    def named(self, name: str, soft: SoftLimits) -> Planned:
        if self.machine.has_plane:
            return self._planned(course.usual(self.tree))
        return self._planned(moves.usual(self.machine, self.tree))

    def read(self, path: Path, soft: SoftLimits) -> Planned:
        if self.machine.has_plane:
            return self._planned(course.load(path))
        return self._planned(moves.load(path, self.machine, self.tree))

    def _planned(self, found: Course) -> Planned:
        if self.machine.has_plane:  # messages to the loop are short
            plan = paths.plan(found, self.tree, step=PERIOD)
        else:
            plan = moves.plan(self.machine, self.tree, found)
        return Planned(found.title, plan.plans, len(plan.legs))
