"""From raw recordings of kiln and micro-stage to both actuator models (Section 5.2).

Nothing but measured channels goes in: thermocouple, encoder, CTRL, laser, CONTRACT.
"""

from __future__ import annotations

from typing import NamedTuple

from macromicro.experiments import electrothermal, kiln
from macromicro.hysteresis.table import FodTable
from macromicro.identify import actuator, stressed
from macromicro.identify import kiln as kiln_fit
from macromicro.identify.actuator import Judgement, ThesisFit
from macromicro.identify.stressed import StressedFit
from macromicro.models.weighted_gain import Weighted
from macromicro.plant.bench import Plant
from macromicro.plant.kiln import KilnBench


class Compared(NamedTuple):
    """One recording that no model was fitted to: the thesis' model with the identified gain
    and with the printed (5.8), and the better model."""

    thesis: Judgement
    printed: Judgement
    better: Judgement


class Models(NamedTuple):
    """`table` of Figure 5.8; `kiln_errors`: RMS share of the stroke on each new profile (S2);
    `fit`s of both models; `steps`: the thesis' model on the steps that it was made from,
    by voltage (S10); `unseen`: all models on other runs, by name."""

    table: FodTable
    kiln_errors: list[float]
    thesis: ThesisFit
    better: StressedFit
    steps: dict[float, Judgement]
    unseen: dict[str, Compared]


def measured(plant: Plant | None = None, oven: KilnBench | None = None, seed: int = 0) -> Models:
    """All procedures and fits on a bench, by default the default one."""
    heated = kiln.collect(oven, seed)
    table = kiln_fit.fod_table([heated.curves])
    data = electrothermal.collect(plant, seed)
    first = actuator.thesis(table, data.steps, data.cooled[1.575])
    better = stressed.fit(table, electrothermal.for_fit(plant, seed + 10_000), first.model.gain)
    printed = first.model._replace(gain=Weighted())
    unseen = {
        name: Compared(
            actuator.against(first.model, [r]),
            actuator.against(printed, [r]),
            stressed.against(better.model, r),
        )
        for name, r in electrothermal.for_judgement(plant, seed + 20_000).items()
    }
    return Models(
        table,
        [kiln_fit.predicted(table, r).share for r in heated.tests],
        first,
        better,
        {v: actuator.against(first.model, runs) for v, runs in data.steps.items()},
        unseen,
    )
