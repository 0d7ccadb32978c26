"""The job "programme": the whole bench with supervisor and guard on a motion programme."""

from __future__ import annotations

from functools import cache

from macromicro import programme as programmes
from macromicro import simulate
from macromicro.batch.bench_job import BenchJob
from macromicro.batch.programme_metrics import COLUMNS, METRICS, measure
from macromicro.batch.scratch import Scratch
from macromicro.programme import Programme
from macromicro.programme.travel import limits
from macromicro.settings import Settings
from macromicro.simulate import Outcome


class ProgrammeJob(BenchJob):
    """The same runs as `macromicro run`, bit for bit, judged by their moves.

    A bench with another Hall sensor is calibrated first, as in `macromicro run`.
    """

    name = "programme"
    metrics = METRICS
    columns = COLUMNS

    def __init__(
        self,
        programme: str = "thesis",
        cycles: int = 1,
        fan: bool = False,
        seed: int = 0,
        settings: Settings | None = None,
    ) -> None:
        super().__init__(settings, seed, fan)
        path = programmes.find(str(programme))

        @cache
        def loaded(pitch: float) -> Programme:
            # One programme for all variants, whose stages may have less of their ways left.
            most = limits(self._settings.travel, pitch)
            return programmes.load(path, most).repeated(cycles)

        self._loaded = loaded
        self.programme(self._settings)  # what is wrong with the file is said at once

    def programme(self, settings: Settings) -> Programme:
        return self._loaded(settings.sensors.encoder.pitch)

    def compile(self) -> None:
        """Compile the bench, or load it from the cache."""
        settings = self.base()
        simulate.compile_bench(settings, self.programme(settings))

    def measure(self, place: Scratch, settings: Settings, outcome: Outcome) -> list[float]:
        fault = int(outcome.watch.fault)
        row = measure(place.recording(), self.programme(settings), settings, fault)
        return [float(value) for value in row]
