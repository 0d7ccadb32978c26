"""Machines like the one at hand: what a robust controller must live with.

They are drawn from the table of what is not known about a machine
(`macromicro.uncertainty`), from the rows of the stage that is tuned. In the ensemble that a
search sees the first is the machine as it is; the one that judges what was found (`fresh`)
has new draws alone. The identified model of the macro-stage has no belt; what it has of a
row is said in the table.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.models.macro import discretised
from macromicro.nominal import PERIOD
from macromicro.schema.text import printable
from macromicro.settings import Settings
from macromicro.uncertainty import machines, table
from macromicro.uncertainty.table import Uncertain

AGGREGATES = ("worst", "q95")
FEWEST, MOST = 2, 1000
HELD_OUT = 1  # number of the random stream that a search never draws from


class Ensemble(NamedTuple):
    """Machines around given settings, and how their costs become one.

    Attributes
    ----------
    uncertain : tuple of Uncertain
        k rows of the table.
    draws : ndarray, shape (members, k)
        Amounts on each row's own scale; of a search's ensemble the first row is nominal.
    aggregate : {"worst", "q95"}
        The worst of the members' costs, or their 95 % quantile.
    seed : int
        Of the draws.
    settings : Settings
        The nominal machine.
    """

    uncertain: tuple[Uncertain, ...]
    draws: Array
    aggregate: str
    seed: int
    settings: Settings

    def total(self, costs: Array) -> Array:
        """Put the members' costs together.

        Parameters
        ----------
        costs : ndarray, shape (n, members)
            Of n designs.

        Returns
        -------
        ndarray, shape (n,)
            As `aggregate` says.
        """
        found: Array = (
            costs.max(axis=1) if self.aggregate == "worst" else np.quantile(costs, 0.95, axis=1)
        )
        return found

    def on_bench(self) -> tuple[tuple[str, ...], Array]:
        """Give the members as a batch on the bench takes them.

        Returns
        -------
        paths : tuple of str
            Dotted paths within the settings.
        values : ndarray, shape (members, paths)
            In the units that the parameters are stored in.
        """
        trees = [machines.settings_at(self.settings, self.uncertain, row) for row in self.draws]
        return machines.columns(self.uncertain, trees)

    def on_model(self, a: float, b: float, width: float) -> Array:
        """Give the members as variants of the macro-stage's model.

        Parameters
        ----------
        a, b : float
            Of (4.3), as identified; b in counts/(V s).
        width : float
            Dead zone [V].

        Returns
        -------
        ndarray, shape (members, 3)
            Each member's a, b and dead zone.
        """
        gain, pole, zone = (
            machines.on_model(self.uncertain, self.draws, quantity)
            for quantity in (table.GAIN, table.POLE, table.WIDTH)
        )
        nominal = -math.log(-a) / PERIOD
        each = zip(b / (1.0 + a) * nominal * gain, nominal * pole, strict=True)
        held = [discretised(float(g), float(p), PERIOD) for g, p in each]
        return np.column_stack(([h.a for h in held], [h.b for h in held], zone * width))


def draw(stage: str, settings: Settings, members: int, aggregate: str, seed: int) -> Ensemble:
    """Draw an ensemble for a stage's search.

    Parameters
    ----------
    stage : {"macro", "micro"}
        Whose rows of the table are drawn.
    settings : Settings
        The nominal machine, which is the first member.
    members : int
        From `FEWEST` to `MOST`.
    aggregate : {"worst", "q95"}
        How the members' costs become one.
    seed : int
        Of the draws.

    Returns
    -------
    Ensemble
        With draws (members, k).

    Raises
    ------
    InputError
        A bad number or aggregate, or settings around which hardly any machine is possible.
    """
    if aggregate not in AGGREGATES:
        raise InputError("--aggregate", printable(aggregate), f"one of {', '.join(AGGREGATES)}")
    _within("--benches", members)
    rows = table.of_stage(stage)
    drawn = machines.draw(settings, rows, members - 1, seed).amounts
    draws = np.vstack((machines.centre(settings, rows), drawn))
    return Ensemble(rows, draws, aggregate, seed, settings)


def fresh(searched: Ensemble, members: int) -> Ensemble:
    """Draw another ensemble like the one that was searched on, to judge by.

    Parameters
    ----------
    searched : Ensemble
        Its rows, settings, aggregate and seed are taken.
    members : int
        From `FEWEST` to `MOST`.

    Returns
    -------
    Ensemble
        From a random stream of its own, without the nominal machine.

    Raises
    ------
    InputError
        A bad number.
    """
    _within("--held-out", members)
    stream: Sequence[int] = (searched.seed, HELD_OUT)
    found = machines.draw(searched.settings, searched.uncertain, members, stream)
    return searched._replace(draws=found.amounts)


def _within(option: str, members: int) -> None:
    if not FEWEST <= members <= MOST:
        raise InputError(option, members, f"a whole number from {FEWEST} to {MOST}")
