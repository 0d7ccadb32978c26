"""From raw recordings of the micro-stage and the kiln's table to both actuator models (5.2).

Nothing but measured channels goes in: CTRL, laser, CONTRACT, and the kiln's thermocouple
and encoder by way of the table.
"""

from __future__ import annotations

from typing import NamedTuple

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.hysteresis.table import FodTable
from macromicro.identify import actuator, stressed, thermal
from macromicro.identify.actuator import AMBIENT, Judgement, ThesisFit
from macromicro.identify.stressed import StressedFit
from macromicro.identify.thermal import StepRecord
from macromicro.models import actuator as full_model
from macromicro.models import stressed as better_model
from macromicro.models.weighted_gain import Weighted
from macromicro.recording import Recording
from macromicro.runs.machine import Machine
from macromicro.thesis.chapter5 import electrothermal_runs
from macromicro.thesis.chapter5.electrothermal_runs import StepData


class Compared(NamedTuple):
    """One recording that no model was fitted to: the thesis' model with the identified gain
    and with the printed (5.8), and the better model."""

    thesis: Judgement
    printed: Judgement
    better: Judgement


class Trace(NamedTuple):
    """A step, mean of its trials, and what the models make of its CTRL: `record` as the
    laser showed it, contraction [mm] by the `thesis`' model and by the `better` one, (n,)."""

    record: StepRecord
    thesis: Array
    better: Array


class Models(NamedTuple):
    """`table` of Figure 5.8; `data`: the steps' recordings; fits of both models; `traces` and
    `steps`: both models along the steps by voltage, and how the thesis' model does on these,
    from which it was made (S10); `unseen`: all models on other runs, by name."""

    table: FodTable
    data: StepData
    thesis: ThesisFit
    better: StressedFit
    traces: dict[float, Trace]
    steps: dict[float, Judgement]
    unseen: dict[str, Compared]


class Unfitted(NamedTuple):
    """`table` and `data` as in `Models`, where no model of Section 5.2 could be made of them;
    `why`."""

    table: FodTable
    data: StepData
    why: str


def attempted(table: FodTable, plant: Machine | None = None, seed: int = 0) -> Models | Unfitted:
    """As `measured`; on a bench whose steps the thesis' procedure cannot use, what there is."""
    data = electrothermal_runs.collect(plant, seed)
    try:
        return _fitted(table, data, plant, seed)
    except InputError as error:
        return Unfitted(table, data, str(error))


def measured(table: FodTable, plant: Machine | None = None, seed: int = 0) -> Models:
    """All open-loop runs of a bench, by default the default one, and all fits to them."""
    return _fitted(table, electrothermal_runs.collect(plant, seed), plant, seed)


def _fitted(table: FodTable, data: StepData, plant: Machine | None, seed: int) -> Models:
    first = actuator.thesis(table, data.steps, data.cooled[1.575])
    better = stressed.fit(table, electrothermal_runs.for_fit(plant, seed + 10_000))
    printed = first.model._replace(gain=Weighted())
    unseen = {
        name: Compared(
            actuator.against(first.model, [r]),
            actuator.against(printed, [r]),
            stressed.against(better.model, r),
        )
        for name, r in electrothermal_runs.for_judgement(plant, seed + 20_000).items()
    }
    traces = {v: _traced(table, first, better, trials) for v, trials in data.steps.items()}
    steps = {
        v: actuator.judged(c.record.t, c.record.position, c.thesis, table.span)
        for v, c in traces.items()
    }
    return Models(table, data, first, better, traces, steps, unseen)


def _traced(
    table: FodTable, first: ThesisFit, better: StressedFit, trials: list[Recording]
) -> Trace:
    """Both models along the CTRL of one voltage's trials."""
    record = thermal.inferred_step(table, trials, AMBIENT)
    sent, dt = trials[0]["ctrl"][: len(record.t)], trials[0].dt
    return Trace(
        record,
        full_model.simulate(first.model, sent, dt)[0],
        better_model.simulate(better.model, sent, dt)[0],
    )
