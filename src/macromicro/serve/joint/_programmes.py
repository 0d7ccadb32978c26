"""Programmes of clients for a machine of two axes."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from macromicro.control.live.parameters import SoftLimits
from macromicro.machines.joint import course, planning
from macromicro.machines.moves import Course
from macromicro.nominal import PERIOD
from macromicro.serve._programmes import Planned
from macromicro.serve.stage._programmes import USUAL


class TwoAxes(NamedTuple):
    """`Programmes` of a two-axis machine with settings `tree`."""

    tree: Any

    def names(self) -> tuple[str, ...]:
        return (USUAL,)

    def named(self, name: str, soft: SoftLimits) -> Planned:
        return self._planned(course.usual(self.tree))

    def read(self, path: Path, soft: SoftLimits) -> Planned:
        return self._planned(course.load(path))

    def _planned(self, found: Course) -> Planned:
        plan = planning.plan(found, self.tree, step=PERIOD)  # messages to the loop are short
        return Planned(found.title, plan.plans, len(plan.legs))
