"""Jobs on the whole bench: supervisor, guard and noise, without a recording."""

from __future__ import annotations

import math

import numpy as np

from macromicro import loop
from macromicro.arrays import Array
from macromicro.batch.scratch import Scratch, scratch
from macromicro.batch.variants import SEED, Metric, Trajectories, Variants, applied, checked, seeds
from macromicro.batch.variants import table as parameters
from macromicro.errors import InputError
from macromicro.kernel import compiled
from macromicro.loop import PERIOD
from macromicro.programme import Programme
from macromicro.recorded import COLUMNS
from macromicro.runs import programmed
from macromicro.settings import Settings
from macromicro.simulate import Outcome

TRACED = (
    *("macro_reference", "macro_position", "motor", "micro_reference", "hall_position"),
    *("ctrl", "laser", "phase"),
)


class BenchJob:
    """A programme on the whole bench, as `runs.programmed` runs it, without a recording.

    The path "seed" sets a variant's own noise; all others share the job's, so that variants differ
    only by their parameters.
    """

    name: str
    metrics: tuple[Metric, ...]
    columns: tuple[str, ...]
    block = 1

    def __init__(
        self,
        settings: Settings | None = None,
        seed: int = 0,
        fan: bool = False,
    ) -> None:
        if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
            raise InputError("seed", seed, "a whole number from 0")
        self._settings = Settings() if settings is None else settings
        self._known = parameters(self._settings)
        self._seed, self._fan = seed, fan

    def base(self) -> Settings:
        return self._settings

    def programme(self, settings: Settings) -> Programme:
        raise NotImplementedError

    def measure(self, place: Scratch, settings: Settings, outcome: Outcome) -> list[float]:
        raise NotImplementedError

    def evaluate(self, variants: Variants, first: int = 0) -> Array:
        compiled(loop.rollout)  # once, before threads ask for it
        values = checked(self._known, variants, first, (SEED,))
        noise = seeds(variants, values, self._seed, first)
        out = np.empty((len(values), len(self.metrics)))
        for k, row in enumerate(values):
            settings = applied(self._settings, variants.paths, row, first + k, (SEED,))
            out[k] = self.one(settings, noise[k])
        return out

    def one(self, settings: Settings, seed: int) -> list[float]:
        """The metrics of a run under other settings than the job's."""
        place = scratch(self.columns)
        return self.measure(place, settings, self._run(settings, seed, place))

    def _run(self, settings: Settings, seed: int, place: Scratch) -> Outcome:
        what = self.programme(settings)
        return programmed.perform(what, settings, place, seed=seed, fan=self._fan)

    def trace(self, variants: Variants, every: int = 10, first: int = 0) -> Trajectories:
        """The columns `TRACED` of each run's recording."""
        values = checked(self._known, variants, first, (SEED,))
        noise = seeds(variants, values, self._seed, first)
        runs: list[Array] = []
        for k, row in enumerate(values):
            settings = applied(self._settings, variants.paths, row, first + k, (SEED,))
            place = scratch(("t", *TRACED))
            self._run(settings, noise[k], place)
            seen = place.recording()
            runs.append(np.array([seen[name][::every] for name in TRACED], dtype=np.float64))
        rows = max((run.shape[1] for run in runs), default=0)
        shown = np.full((len(TRACED), len(runs), rows), math.nan)
        for k, run in enumerate(runs):
            shown[:, k, : run.shape[1]] = run
        units = {c.name: c.unit for c in COLUMNS if c.name in TRACED}
        t = np.arange(rows * every, step=every) * PERIOD
        return Trajectories(t, dict(zip(TRACED, shown, strict=True)), units)
