"""Programmes as clients send them to a machine of two axes."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from macromicro.control.live.parameters import SoftLimits
from macromicro.machines.joint import course, planning
from macromicro.machines.joint.course import Course
from macromicro.nominal import PERIOD
from macromicro.serve.programmes import Planned
from macromicro.serve.stage.programmes import USUAL


class TwoAxes(NamedTuple):
    """`serve.programmes.Programmes` of a machine of two axes. `tree`: its settings."""

    tree: Any

    def names(self) -> tuple[str, ...]:
        """The moves that `macromicro run` makes without a programme."""
        return (USUAL,)

    def named(self, name: str, soft: SoftLimits) -> Planned:
        """Those moves."""
        return self._planned(course.usual(self.tree))

    def read(self, path: Path, soft: SoftLimits) -> Planned:
        """Moves, paths or a trajectory in a file."""
        return self._planned(course.load(path))

    def _planned(self, found: Course) -> Planned:
        plan = planning.plan(found, self.tree, step=PERIOD)  # messages to the loop are short
        return Planned(found.title, plan.plans, len(plan.legs))
