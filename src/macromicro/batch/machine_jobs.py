"""The jobs "programme" and those named by a machine: runs of a programme, judged by its metrics."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from macromicro import joining, loop
from macromicro import programme as programmes
from macromicro.arrays import Array
from macromicro.batch.variant_job import VariantJob
from macromicro.columns import Column
from macromicro.errors import ProblemError
from macromicro.kernel import compiled
from macromicro.machines import composite, compositions, setups
from macromicro.machines.tree import is_own, joined
from macromicro.programme import Programme
from macromicro.programme.travel import limits
from macromicro.runs.programmed import TwoStageSetup
from macromicro.runs.setup import Setup
from macromicro.schema.config import load_overrides
from macromicro.schema.text import is_toml
from macromicro.settings import Settings

TRACED = ("position", "target", "effort")  # of each stage


class MachineJob(VariantJob):
    """A machine with a programme, as `macromicro run` runs it, without a recording."""

    def setup(self, settings: Any) -> Setup:
        """The machine under settings with its programme."""
        raise NotImplementedError

    def one(self, settings: Any, seed: int) -> Any:
        return self.setup(settings).trial(seed)

    def courses(self, settings: Any, seed: int) -> dict[str, Array]:
        recording, _ = self.setup(settings).seen(seed, ("t", *self.traced))
        return {name: recording[name] for name in self.traced}

    def columns(self) -> tuple[Column, ...]:
        return self.setup(self._settings).columns()


class TwoStageJob(MachineJob):
    traced = (
        *("macro_reference", "macro_position", "motor", "micro_reference", "hall_position"),
        *("ctrl", "laser", "phase"),
    )

    def prepare(self) -> None:
        compiled(loop.rollout)


class ProgrammeJob(TwoStageJob):
    """The whole bench with supervisor and guard on a motion programme.

    A bench with another Hall sensor is calibrated first, as in `macromicro run`.
    """

    name, metrics = "programme", TwoStageSetup.metrics

    def __init__(
        self,
        programme: str = "thesis",
        cycles: int = 1,
        fan: bool = False,
        seed: int = 0,
        settings: Settings | None = None,
    ) -> None:
        super().__init__(Settings() if settings is None else settings, seed)
        path = programmes.find(str(programme))

        @cache
        def loaded(pitch: float) -> Programme:
            # One programme for all variants, whose stages may have less of their ways left.
            return programmes.load(path, limits(self._settings.travel, pitch)).repeated(cycles)

        self._loaded, self._fan = loaded, fan
        self.setup(self._settings)  # what is wrong with the file is said at once

    def setup(self, settings: Settings) -> TwoStageSetup:
        return TwoStageSetup(settings, self._loaded(settings.sensors.encoder.pitch), fan=self._fan)


class StageJob(MachineJob):
    """Stages with a programme.

    Derived values (gains, limits of the motion, the guard) follow a variant's parameters, unless
    the settings have set them. Settings that no file could have are an infeasible variant.
    The parameters of several axes begin with the axis ("x.friction.coulomb"); a heavier y changes
    the limits, the gains and the guard of an x that carries it.
    """

    refuses = True

    def __init__(
        self,
        machine: Any,
        programme: str = "",
        seed: int = 0,
        settings: Any = None,
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
        self.metrics, self.period = setup.metrics, setup.period
        before = [f"{name}_" if name else "" for name in composite.names(found)]
        self.traced = tuple(f"{each}{name}" for each in before for name in TRACED)

    def loaded(self, path: Path | None, law: str | None) -> Any:
        if law is not None and len(self._trees) > 1:
            raise ProblemError(
                "--law", "not allowed here", "Name the law of each axis in the settings file."
            )
        tree = self._settings if law is None else joined(self._settings, law, "--law")
        if path is not None:
            tree = load_overrides(path, tree, self.name)
        return tree if law is None else joined(tree, law, "--law")  # before the file's word

    def laws(self) -> list[str]:
        return [tree.law for tree in self._trees if is_own(tree)]

    def kinds(self) -> list[Any]:
        each = (one.kind for _, one in self._machine.stages)
        return [kind for kind in each if joining.foreign(kind.advance)]

    def setup(self, settings: Any) -> Setup:
        return setups.stages(self._machine, settings, self._programme)
