"""The job "programme": a motion programme on the two-stage machine, judged by its metrics."""

from __future__ import annotations

from functools import cache

from macromicro import loop
from macromicro import programme as programmes
from macromicro.batch.variant_job import MachineJob
from macromicro.kernel import compiled
from macromicro.programme import Programme
from macromicro.programme.travel import limits
from macromicro.runs.programmed import TwoStageSetup
from macromicro.settings import Settings


class TwoStageJob(MachineJob):
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
