"""Ensembles of machines around given settings, for robust tuning.

Members are drawn from the table of uncertain parameters (`macromicro.uncertainty`). The
ensemble of the search starts with the machine itself; the one that judges (`fresh`) has
new draws only.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.schema.text import printable
from macromicro.settings import Settings
from macromicro.uncertainty import machines, table
from macromicro.uncertainty.table import Uncertain

AGGREGATES = ("worst", "q95")
FEWEST, MOST = 2, 1000
HELD_OUT = 1  # number of the random stream that a search never draws from


class Ensemble(NamedTuple):
    """Machines around given settings, and the rule that aggregates their costs."""

    uncertain: tuple[Uncertain, ...]  # k rows of the table
    draws: Array  # amounts on each row's own scale; of a search's ensemble the first row is nominal
    aggregate: str  # the worst of the members' costs, or their 95 % quantile
    seed: int  # of the draws
    settings: Settings  # the nominal machine

    def total(self, costs: Array) -> Array:
        found: Array = (
            costs.max(axis=1) if self.aggregate == "worst" else np.quantile(costs, 0.95, axis=1)
        )
        return found

    def on_bench(self) -> tuple[tuple[str, ...], Array]:
        trees = [machines.settings_at(self.settings, self.uncertain, row) for row in self.draws]
        return machines.columns(self.uncertain, trees)


def draw(stage: str, settings: Settings, members: int, aggregate: str, seed: int) -> Ensemble:
    if aggregate not in AGGREGATES:
        raise InputError("--aggregate", printable(aggregate), f"one of {', '.join(AGGREGATES)}")
    _within("--benches", members)
    rows = table.of_stage(stage)
    drawn = machines.draw(settings, rows, members - 1, seed).amounts
    draws = np.vstack((machines.centre(settings, rows), drawn))
    return Ensemble(rows, draws, aggregate, seed, settings)


def fresh(searched: Ensemble, members: int) -> Ensemble:
    """Draw another ensemble of the same kind, for judging."""
    _within("--held-out", members)
    stream: Sequence[int] = (searched.seed, HELD_OUT)
    found = machines.draw(searched.settings, searched.uncertain, members, stream)
    return searched._replace(draws=found.amounts)


def _within(option: str, members: int) -> None:
    if not FEWEST <= members <= MOST:
        raise InputError(option, members, f"a whole number from {FEWEST} to {MOST}")
