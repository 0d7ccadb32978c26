"""Runs of a machine of one stage, or of several on one clock."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from macromicro import interpreting
from macromicro.batch.variants import Metric
from macromicro.columns import Column
from macromicro.drawing import files
from macromicro.errors import ProblemError
from macromicro.machines import composite, on_rig, performing, period, planning, results, trial
from macromicro.machines.composite import AnyMachine, Composite
from macromicro.machines.machine import as_toml
from macromicro.machines.on_rig import Rigs
from macromicro.machines.planning import Planned
from macromicro.machines.stage import compiles
from macromicro.programme import Programme
from macromicro.recording import Recording
from macromicro.rig.session import Fixture
from macromicro.runs import folder
from macromicro.runs.arrivals import Rest
from macromicro.runs.setup import Done, Progress, Setup
from macromicro.simulate import Outcome, Sink
from macromicro.types import Rig
from macromicro.uncertainty import stages
from macromicro.uncertainty.table import Uncertain

FIGURES = ("response", "moves")  # of a machine of one stage
PATH_FIGURES = ("path", "axes")  # of one of several

MOST_DRAWN = 6  # metrics

On = Rigs | Sequence[Rig] | Rig | None


class StageSetup(Setup):
    """Stages with a programme; `bench` has the settings of a simulated machine of another kind."""

    remedy, kernels = results.REMEDY, "period.period"

    def __init__(
        self,
        machine: AnyMachine,
        settings: Any,
        plan: Planned,
        *,
        programme: Any = None,
        title: str = "",
        bench: Any = None,
        cycles: int = 1,
    ) -> None:
        self.machine, self.settings, self.plan, self.bench = machine, settings, plan, bench
        self.name, self.default = machine.name, machine.settings
        self.programme, self.title = programme, title or getattr(programme, "title", "")
        self.cycles = cycles
        self.period = composite.period(machine, settings)
        self.expected = performing.expected_duration(machine, settings, plan)
        self.attributes = {"machine": machine.name}
        self.place = machine.stages[0][1].kind.place
        drawn = PATH_FIGURES if isinstance(machine, Composite) else FIGURES
        self.files = (folder.RECORDING, folder.SUMMARY, folder.PAGE, *files.names(drawn))

    @property
    def planned(self) -> int:
        """Number of moves."""
        return len(planning.each(self.plan)[0].target)

    @property
    def timed(self) -> bool:
        """Whether set points come by time, and wait for no arrival."""
        return bool(np.isfinite(planning.each(self.plan)[0].end))

    @property
    def _simulated(self) -> tuple[AnyMachine, Any, Planned]:
        return self.machine, self.settings, self.plan

    def with_settings(self, settings: Any) -> StageSetup:
        how: Any = {"programme": self.programme, "title": self.title, "cycles": self.cycles}
        return StageSetup(self.machine, settings, self.plan, **how)

    def as_toml(self) -> str:
        return as_toml(self.machine, self.settings)

    def columns(self, on: On = None) -> tuple[Column, ...]:
        return performing.columns(self.machine, on.members if isinstance(on, Rigs) else on)

    def perform(
        self, sink: Sink, *, on: On = None, seed: int = 0, progress: Progress | None = None
    ) -> Outcome:
        if isinstance(on, Rigs):
            return on_rig.perform(*self._simulated, sink, on, progress)
        how: Any = {"on": on, "seed": seed, "progress": progress, "bench": self.bench}
        return performing.perform(*self._simulated, sink, **how)

    @property
    def _compiles(self) -> bool:
        return all(compiles(one.law) for _, one in self.machine.stages)

    def compile(self) -> None:
        # Interpreted, a period shows whether its kernels compile.
        stages, given = performing.begin(*self._simulated, count=0 if self._compiles else 1)
        period.fastest(stages)(*given)

    def runs_interpreted(self) -> bool:
        stages, given = performing.begin(*self._simulated, count=0)
        periods = self.expected / self.period
        loop = period.period(stages)
        return self._compiles and interpreting.is_quicker(loop, periods, *given)

    def source(self, rig: str, seed: int) -> tuple[Fixture, ...] | None:
        return on_rig.find_rigs(rig, self.machine, self.settings, seed)

    def open(self, source: Sequence[Fixture] | None, seed: int) -> Rigs | None:
        return None if source is None else on_rig.open_rigs(source, seed)

    def intent(self, source: Sequence[Fixture] | None) -> list[str]:
        if source is None:
            return []
        return on_rig.announce(*self._simulated, self.title, source, self.expected)

    def results(self, recording: Recording) -> dict[str, Any]:
        return {"moves": results.of(self.machine, recording, self.plan, self.settings)}

    def uncertain(self, *, variants: bool = False) -> tuple[Uncertain, ...]:
        if variants:
            raise ProblemError("--variants", "only for the two-stage machine")
        return stages.uncertain(self.machine, self.settings)

    def kept(self, drawn: Any) -> Any:
        return stages.keep_settings(self.machine, self.settings, drawn)

    @property
    def main(self) -> tuple[str, ...]:
        """Errors on the way and at rest before all others."""
        names = [each.name for each in self.metrics[2:]]
        last = ("mean_settling", "effort", "rough")
        return tuple(sorted(names, key=lambda name: name.startswith(last))[:MOST_DRAWN])

    @property
    def limits(self) -> dict[str, tuple[float, str]]:
        if not (isinstance(self.machine, Composite) and self.machine.has_plane):
            return {}
        return {"contour": (1e6 * self.settings.path.tolerance, "path.tolerance")}

    @property
    def metrics(self) -> tuple[Metric, ...]:
        return trial.metrics(self.machine)

    def measured(self, recording: Recording, code: int) -> Any:
        return trial.figures_of(*self._simulated, recording, code)

    def rests(self, recording: Recording) -> list[Rest]:
        if self.timed:
            return []
        return results.rests(self.results(recording)["moves"], composite.places(self.machine))


def record(
    machine: AnyMachine,
    settings: Any,
    programme: Programme | Planned,
    *,
    on: On = None,
    title: str = "",
    seed: int = 0,
    warn: bool = True,
    bench: Any = None,
) -> Done:
    """A run in memory."""
    moving = programme if isinstance(programme, Programme) else None
    planned: Any = programme if moving is None else planning.plan(moving, settings)
    setup = StageSetup(machine, settings, planned, programme=moving, title=title, bench=bench)
    return setup.record(on=on, seed=seed, warn=warn)
