"""Programmes of clients for the two-stage machine."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from macromicro import programme
from macromicro.control.live.parameters import SoftLimits
from macromicro.errors import InputError, ProblemError
from macromicro.machines import moves, pace, planning
from macromicro.machines.composite import Composite
from macromicro.machines.joint import course
from macromicro.machines.joint import planning as paths
from macromicro.machines.moves import Course
from macromicro.nominal import PERIOD
from macromicro.programme import Limits, Programme


class Planned(NamedTuple):
    """A programme ready to run."""

    title: str
    plan: Any  # for `messages.Programme`
    moves: int


def error_under_name(error: InputError, path: Path, name: str) -> InputError:
    """An error in a file, under the `name` that the client knows."""
    return error.at(error.where.replace(str(path), name))


class TwoStage(NamedTuple):
    """Programmes of the two-stage machine: its own, by their names, and those of files."""

    pitch: float  # m per count
    rates: bool = False  # the law uses speed and acceleration of the set point

    def names(self) -> tuple[str, ...]:
        return tuple(programme.shipped())

    def named(self, name: str, soft: SoftLimits) -> Planned:
        path = programme.shipped()[name]
        try:
            return self.read(path, soft)
        except InputError as error:
            raise error_under_name(error, path, path.name) from None

    def read(self, path: Path, soft: SoftLimits) -> Planned:
        """The programme in a file."""
        from macromicro.simulate import plan

        micro = 0.0, soft.micro_high  # at 0 the micro-stage is let go
        limits = Limits(soft.macro_low, soft.macro_high, *micro, 1.0 / self.pitch)
        found = programme.load(path, limits)
        if found.from_rest():
            remedy = (
                "Put [[profiles]] behind [[moves]] of their stage, which define the start, or use "
                "CSV; `macromicro run` runs this programme."
            )
            raise ProblemError(str(path), "motion profiles begin at 0", remedy)
        made = plan(found)
        if not self.rates:  # messages to the loop are short
            made = made._replace(velocity=np.empty(0), acceleration=np.empty(0))
        return Planned(found.title, made, len(found.target))


USUAL = "usual"


class OneStage(NamedTuple):
    """Programmes of a single-stage machine with settings `tree`."""

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
    """Programmes of a machine of several stages with settings `tree`."""

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


Programmes = TwoStage | OneStage | SeveralStages
