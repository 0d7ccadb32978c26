"""What jobs on the whole bench have in common: supervisor, guard and noise, no recording kept."""

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
    """A programme on the whole bench, as `runs.programmed` runs it, no recording kept.

    A variant's own noise seed stands at the path "seed", beside those of the settings; the others
    share the job's, so that variants differ by their parameters alone.

    Parameters
    ----------
    settings : Settings, optional
        That variants start from.
    seed : int
        Of the noise.
    fan : bool
        Cool the actuator by a fan.
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
        """Give the settings that variants start from.

        Returns
        -------
        Settings
            A tree of parameters.
        """
        return self._settings

    def programme(self, settings: Settings) -> Programme:
        """Give what a bench is to do.

        Parameters
        ----------
        settings : Settings
            Of the bench.

        Returns
        -------
        Programme
            With lengths as counts of its encoder.

        Raises
        ------
        NotImplementedError
            The job says it.
        """
        raise NotImplementedError

    def measure(self, place: Scratch, settings: Settings, outcome: Outcome) -> list[float]:
        """Measure one run.

        Parameters
        ----------
        place : Scratch
            With the run's columns.
        settings : Settings
            Of the run.
        outcome : Outcome
            How it ended.

        Returns
        -------
        list of float
            As `metrics`.

        Raises
        ------
        NotImplementedError
            The job says it.
        """
        raise NotImplementedError

    def evaluate(self, variants: Variants, first: int = 0) -> Array:
        """Evaluate variants.

        Parameters
        ----------
        variants : Variants
            n of them.
        first : int
            Number of the first one, for errors.

        Returns
        -------
        ndarray, shape (n, metrics)
            As `metrics`.

        Raises
        ------
        InputError
            With variant and key: an impossible value.
        """
        compiled(loop.rollout)  # once, before threads ask for it
        values = checked(self._known, variants, first, (SEED,))
        noise = seeds(variants, values, self._seed, first)
        out = np.empty((len(values), len(self.metrics)))
        for k, row in enumerate(values):
            settings = applied(self._settings, variants.paths, row, first + k, (SEED,))
            place = scratch(self.columns)
            out[k] = self.measure(place, settings, self._run(settings, noise[k], place))
        return out

    def _run(self, settings: Settings, seed: int, place: Scratch) -> Outcome:
        what = self.programme(settings)
        return programmed.perform(what, settings, place, seed=seed, fan=self._fan)

    def trace(self, variants: Variants, every: int = 10, first: int = 0) -> Trajectories:
        """Give the columns `TRACED` of each run's recording.

        Parameters
        ----------
        variants : Variants
            n of them.
        every : int
            Every so many rows.
        first : int
            Number of the first variant, for errors.

        Returns
        -------
        Trajectories
            NaN after a run's end.

        Raises
        ------
        InputError
            With variant and key: an impossible value.
        """
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
