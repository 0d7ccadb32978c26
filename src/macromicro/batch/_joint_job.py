"""The job "xy": metrics of a machine of two axes on a programme."""

from __future__ import annotations

from typing import Any

from macromicro.batch.stage_job import StageJob, told
from macromicro.columns import Column
from macromicro.errors import InputError
from macromicro.machines.joint import course, planning, runs
from macromicro.machines.joint.machine import XY_MACHINE, under
from macromicro.machines.joint.settings import of
from macromicro.machines.joint.trial import JointTrial, trial
from macromicro.recording import Recording


class JointJob(StageJob):
    """A programme on both axes, as `macromicro run` runs it, without a recording.

    Derived values of both axes follow a variant's parameters: a heavier y changes the limits, the
    gains and the guard of x, which carries it. Paths begin with the axis ("x.friction.coulomb").
    """

    traced = tuple(f"{axis}_{name}" for axis in "xy" for name in ("position", "target", "effort"))

    def __init__(
        self, machine: str = "xy", programme: str = "", seed: int = 0, settings: Any = None
    ) -> None:
        super().__init__(machine, programme, seed, settings)

    def _open(self, machine: Any, settings: Any) -> None:
        if machine != XY_MACHINE.name:
            raise InputError("machine", machine, XY_MACHINE.name)
        self.name = XY_MACHINE.name
        self._settings = XY_MACHINE.settings if settings is None else settings
        self._machine = under(self._settings)
        self.metrics = told(JointTrial)
        self.kinds, self.trees = runs.kinds(self._machine), of(self._settings)

    def _plan(self, tree: Any) -> Any:
        moves = course.usual(tree) if self._path is None else course.load(self._path)
        return planning.plan(moves, tree)

    def _trial(self, tree: Any, seed: int) -> Any:
        return trial(self._machine, tree, self._plan(tree), seed)

    def _recorded(self, tree: Any, seed: int) -> Recording:
        return runs.record(self._machine, tree, self._plan(tree), seed=seed).recording

    def _columns(self) -> tuple[Column, ...]:
        return runs.columns(self._machine)
