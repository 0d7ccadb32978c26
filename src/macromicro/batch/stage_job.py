"""The jobs named by a machine: runs of a programme, judged by its metrics."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from macromicro import joining
from macromicro.batch.variant_job import MachineJob
from macromicro.errors import ProblemError
from macromicro.machines import composite, compositions, setups
from macromicro.machines.tree import is_own, with_law
from macromicro.runs.setup import Setup
from macromicro.schema.config import load_overrides
from macromicro.schema.text import is_toml


class StageJob(MachineJob):
    """Stages with a programme.

    Derived values (gains, limits of the motion, the guard) follow a variant's parameters, unless
    the settings have set them. Settings that no file could have are an infeasible variant.
    The parameters of several axes begin with the axis ("x.friction.coulomb"); a heavier y changes
    the limits, the gains and the guard of an x that carries it.
    """

    refuses = True

    def __init__(
        self, machine: Any, programme: str = "", seed: int = 0, settings: Any = None
    ) -> None:
        found: Any
        if isinstance(machine, str) and is_toml(machine):
            found, own = compositions.load(Path(machine))
        else:
            found = compositions.machine(machine, "job")
            own = found.settings
        super().__init__(own if settings is None else settings, seed)
        self.name, self._machine = found.name, composite.under(found, self._settings)
        self._trees = found.trees(self._settings)
        self._programme = str(programme) if programme else None
        setup = self.setup(self._settings)  # a wrong programme is refused at once
        self.metrics = setup.metrics

    def loaded(self, path: Path | None, law: str | None) -> Any:
        if law is not None and len(self._trees) > 1:
            raise ProblemError(
                "--law", "not allowed here", "Name the law of each axis in the settings file."
            )
        tree = self._settings if law is None else with_law(self._settings, law, "--law")
        if path is not None:
            tree = load_overrides(path, tree, self.name)
        return tree if law is None else with_law(tree, law, "--law")  # before the file's word

    def laws(self) -> list[str]:
        return [tree.law for tree in self._trees if is_own(tree)]

    def kinds(self) -> list[Any]:
        each = (one.kind for _, one in self._machine.stages)
        return [kind for kind in each if joining.foreign(kind.advance)]

    def setup(self, settings: Any) -> Setup:
        return setups.stages(self._machine, settings, self._programme)
