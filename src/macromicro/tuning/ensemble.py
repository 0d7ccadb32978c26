"""Benches like the default one: what a robust controller must live with.

Each member is drawn by Latin hypercube. In the ensemble that a search sees the first is the
bench as it is; the one that judges what was found (`fresh`) has new draws alone. A range is a
factor on the bench's own parameters, or the value itself. The linear model of the
macro-stage has no belt and takes the mass through its pole: with (4.2) the pole goes with
1 / mass while the steady speed per volt stays.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.errors import InputError
from macromicro.models.macro import discretised
from macromicro.nominal import PERIOD
from macromicro.schema.par import entries
from macromicro.schema.text import printable
from macromicro.tuning.evolution import latin

Array = npt.NDArray[np.float64]

AGGREGATES = ("worst", "q95")
FEWEST, MOST = 2, 1000
HELD_OUT = 1  # number of the random stream that a search never draws from


class Spread(NamedTuple):
    """A range of `low` to `high` for the parameters at `paths` of the settings: a factor, or
    (`absolute`) the value in the parameter's unit."""

    name: str
    low: float
    high: float
    paths: tuple[str, ...]
    absolute: bool = False


MACRO = (
    Spread(
        "friction",
        0.7,
        1.3,
        ("bench.friction.coulomb", "bench.friction.stribeck", "bench.friction.ripple"),
    ),
    Spread("gain", 0.9, 1.1, ("bench.amplifier.supply",)),
    Spread("mass", 0.8, 1.2, ("bench.carriage.mass",)),
    Spread("belt frequency", 0.8, 1.2, ("bench.belt.frequency",)),
    Spread("belt participation", 0.5, 2.0, ("bench.belt.participation",)),
)
MICRO = (
    Spread("ambient", 15.0, 35.0, ("bench.thermal.ambient",), absolute=True),
    Spread("cooling", 0.8, 1.2, ("bench.thermal.wire_resistance",)),
    Spread("preload", 0.8, 1.2, ("bench.bias.preload",)),
    Spread("driver supply", 0.95, 1.05, ("bench.driver.supply",)),
    Spread("driver lag", 0.5, 2.0, ("bench.driver.lag",)),
    Spread("Hall lag", 0.5, 2.0, ("sensors.hall.lag",)),
)
SPREADS = {"macro": MACRO, "micro": MICRO}


class Ensemble(NamedTuple):
    """Members' draws (members, spreads); of a search's the first row is nominal: factors 1, or
    the value that the bench has. `aggregate`: worst or q95, over the members' costs."""

    spreads: tuple[Spread, ...]
    draws: Array
    aggregate: str
    seed: int

    def total(self, costs: Array) -> Array:
        """Costs (n,) of members' costs (n, members): the worst, or the 95 % quantile."""
        found: Array = (
            costs.max(axis=1) if self.aggregate == "worst" else np.quantile(costs, 0.95, axis=1)
        )
        return found

    def on_bench(self, settings: Any) -> tuple[tuple[str, ...], Array]:
        """Dotted paths within the settings and each member's values there (members, paths)."""
        present = {e.path: e.value for e in entries(settings)}
        paths, columns = [], []
        for k, spread in enumerate(self.spreads):
            for path in spread.paths:
                scale = 1.0 if spread.absolute else present[path]
                paths.append(path)
                columns.append(scale * self.draws[:, k])
        return tuple(paths), np.stack(columns, axis=1)

    def on_model(self, a: float, b: float, width: float) -> Array:
        """Each member's a, b of (4.3) and dead zone [V], (members, 3)."""
        friction, gain, mass = (self.draws[:, k] for k in range(3))
        pole = -math.log(-a) / PERIOD
        slope = b / (1.0 + a) * pole
        # In (4.2) the inertia divides gain and pole alike.
        each = zip(slope * gain / mass, pole / mass, strict=True)
        held = [discretised(float(g), float(p), PERIOD) for g, p in each]
        return np.column_stack(([h.a for h in held], [h.b for h in held], friction * width))


def draw(stage: str, settings: Any, members: int, aggregate: str, seed: int) -> Ensemble:
    """An ensemble for a stage's search; raises `InputError` for a bad number or aggregation."""
    if aggregate not in AGGREGATES:
        raise InputError("--aggregate", printable(aggregate), f"one of {', '.join(AGGREGATES)}")
    _within("--benches", members)
    spreads = SPREADS[stage]
    present = {e.path: e.value for e in entries(settings)}
    nominal = [present[s.paths[0]] if s.absolute else 1.0 for s in spreads]
    draws = np.vstack((nominal, _drawn(spreads, members - 1, seed)))
    return Ensemble(spreads, draws, aggregate, seed)


def fresh(searched: Ensemble, members: int) -> Ensemble:
    """Another ensemble like the one that was searched on, to judge by: from a random stream
    of its own, without the nominal bench. Raises `InputError` for a bad number."""
    _within("--held-out", members)
    draws = _drawn(searched.spreads, members, (searched.seed, HELD_OUT))
    return searched._replace(draws=draws)


def _within(option: str, members: int) -> None:
    if not FEWEST <= members <= MOST:
        raise InputError(option, members, f"a whole number from {FEWEST} to {MOST}")


def _drawn(spreads: tuple[Spread, ...], members: int, seed: int | Sequence[int]) -> Array:
    low, high = (np.array([getattr(s, end) for s in spreads]) for end in ("low", "high"))
    found: Array = low + (high - low) * latin(len(spreads), members, seed)
    return found
