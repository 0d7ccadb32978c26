"""The job "xy": a machine of two axes on a programme, in figures."""

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
    """A programme on both axes, as `macromicro run` runs it, no recording kept.

    What follows from a variant's values follows anew, on both axes: with a heavier y the limits,
    the gains and the guard of x, which carries it. The parameters are those of both axes with their
    letter in front ("x.friction.coulomb"), of the stack and of the path.

    Parameters
    ----------
    machine : str
        Its name.
    programme : str
        A file; "" for the machine's usual moves.
    seed : int
        Of the noise.
    settings : Any, optional
        That variants start from; None for the machine's own.
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
