"""Programmes of clients for a machine of several stages."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from macromicro.control.live.parameters import SoftLimits
from macromicro.machines import moves
from macromicro.machines.composite import Composite
from macromicro.machines.joint import course, planning
from macromicro.machines.moves import Course
from macromicro.nominal import PERIOD
from macromicro.serve._programmes import Planned
from macromicro.serve.stage._programmes import USUAL


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
            plan = planning.plan(found, self.tree, step=PERIOD)
        else:
            plan = moves.plan(self.machine, self.tree, found)
        return Planned(found.title, plan.plans, len(plan.legs))
