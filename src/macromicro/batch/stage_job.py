"""The jobs named by a machine: metrics of its run of a programme."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from macromicro.arrays import Array
from macromicro.batch.variants import SEED, Metric, Trajectories, Variants, applied, checked, seeds
from macromicro.batch.variants import table as parameters
from macromicro.columns import layout
from macromicro.errors import InputError
from macromicro.machines import composite, compositions, programmes, runs
from macromicro.machines.composite import AnyMachine
from macromicro.machines.machine import Machine
from macromicro.machines.planning import Planned
from macromicro.machines.trial import kind, trial
from macromicro.place import LENGTH
from macromicro.recording import Recording
from macromicro.schema.config import check
from macromicro.schema.par import NO_UNIT
from macromicro.schema.text import is_toml

TRACED = ("position", "target", "effort")


def metrics(machine: AnyMachine) -> tuple[Metric, ...]:
    """Metrics of a run, the fields of `trial.kind`."""
    place = machine.stages[0][1].kind.place if isinstance(machine, Machine) else LENGTH
    return tuple(
        Metric(c.name, "" if c.unit in NO_UNIT else c.unit, c.meaning)
        for c in layout(kind(machine), place=place).columns
    )


class StageJob:
    """A programme on a machine, as `macromicro run` runs it, without a recording.

    Derived values (gains, limits of the motion, the guard) follow a variant's parameters, unless
    the settings have set them. Settings that no file could have are an infeasible variant.
    The parameters of several axes begin with the axis ("x.friction.coulomb"); a heavier y changes
    the limits, the gains and the guard of an x that carries it.
    """

    block = 1

    def __init__(
        self,
        machine: Any,
        programme: str = "",
        seed: int = 0,
        settings: Any = None,
    ) -> None:
        if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
            raise InputError("seed", seed, "a whole number from 0")
        self._seed = seed
        self._open(machine, settings)
        self._known = parameters(self._settings)
        self._programme = str(programme) if programme else None
        self._plan(self._settings)  # a wrong programme is refused at once

    def _open(self, machine: Any, settings: Any) -> None:
        found: Any
        if isinstance(machine, str) and is_toml(machine):
            found, own = compositions.load(Path(machine))
        else:
            found = compositions.machine(machine, "job")
            own = found.settings
        self.name = found.name
        self._settings = own if settings is None else settings
        self._machine: AnyMachine = composite.under(found, self._settings)
        self.metrics = metrics(found)
        self.kinds = tuple(one.kind for _, one in self._machine.stages)
        self.trees = found.trees(self._settings)
        before = [f"{name}_" if name else "" for name in composite.names(found)]
        self.traced = tuple(f"{each}{name}" for each in before for name in TRACED)

    def base(self) -> Any:
        return self._settings

    def _plan(self, tree: Any) -> Planned:
        moves = programmes.chosen(self._machine, tree, self._programme)
        planned: Planned = programmes.plan(self._machine, tree, moves)
        return planned

    def _trial(self, tree: Any, seed: int) -> Any:
        return trial(self._machine, tree, self._plan(tree), seed)

    def _recorded(self, tree: Any, seed: int) -> Recording:
        return runs.record(self._machine, tree, self._plan(tree), seed=seed).recording

    def _trees(self, variants: Variants, first: int) -> tuple[list[Any], list[int]]:
        values = checked(self._known, variants, first, (SEED,))
        noise = seeds(variants, values, self._seed, first)
        trees = []
        for k, row in enumerate(values):
            tree = applied(self._settings, variants.paths, row, first + k, (SEED,))
            check(tree, f"variant {first + k}")
            trees.append(tree)
        return trees, noise

    def evaluate(self, variants: Variants, first: int = 0) -> Array:
        trees, noise = self._trees(variants, first)
        found = [self._trial(tree, seed) for tree, seed in zip(trees, noise, strict=True)]
        return np.array(found, dtype=np.float64).reshape(len(found), len(self.metrics))

    def trace(self, variants: Variants, every: int = 10, first: int = 0) -> Trajectories:
        trees, noise = self._trees(variants, first)
        seen = [self._recorded(tree, seed) for tree, seed in zip(trees, noise, strict=True)]
        done = [
            np.array([each[n][::every] for n in self.traced], dtype=np.float64) for each in seen
        ]
        rows = max((run.shape[1] for run in done), default=0)
        shown = np.full((len(self.traced), len(done), rows), math.nan)
        for k, run in enumerate(done):
            shown[:, k, : run.shape[1]] = run
        columns = runs.columns(self._machine)
        units = {c.name: c.unit for c in columns if c.name in self.traced}
        t = np.arange(rows * every, step=every) * float(self.trees[0].timing.period)
        return Trajectories(t, dict(zip(self.traced, shown, strict=True)), units)
