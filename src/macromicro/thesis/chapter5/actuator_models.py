"""Both actuator models (5.2) from recordings of the micro-stage and the kiln's table.

Only measured channels are used: CTRL, laser, CONTRACT, and the kiln's thermocouple and encoder
through the table.
"""

from __future__ import annotations

from typing import NamedTuple

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.hysteresis.table import FodTable
from macromicro.identify import heating, wire_table
from macromicro.identify.heating import AMBIENT, StepRecord
from macromicro.identify.wire import WireFit
from macromicro.lab.machine import Machine
from macromicro.models import actuator as full_model
from macromicro.models import stressed as better_model
from macromicro.models.weighted_gain import Weighted
from macromicro.recording import Recording
from macromicro.thesis.chapter5 import _electrothermal_runs, actuator_fits
from macromicro.thesis.chapter5._electrothermal_runs import StepData
from macromicro.thesis.chapter5.actuator_fits import Judgement, ThesisFit, judged


class Compared(NamedTuple):
    thesis: Judgement  # with the identified gain
    printed: Judgement  # with the gain of (5.8)
    better: Judgement


class Trace(NamedTuple):
    """Mean of a step's trials and both models' response to its CTRL; contraction [mm], (n,)."""

    record: StepRecord
    thesis: Array
    better: Array


class Models(NamedTuple):
    table: FodTable  # Figure 5.8
    data: StepData
    thesis: ThesisFit
    better: WireFit
    traces: dict[float, Trace]  # by voltage [V]
    steps: dict[float, Judgement]  # the thesis' model on the data of its fit (S10)
    unseen: dict[str, Compared]  # all models on other runs, by name


class Unfitted(NamedTuple):
    """Table and data for which the models of Section 5.2 could not be fitted."""

    table: FodTable
    data: StepData
    why: str


def attempted(table: FodTable, plant: Machine | None = None, seed: int = 0) -> Models | Unfitted:
    """As `measured`, or `Unfitted` on a bench whose steps the procedure cannot use."""
    data = _electrothermal_runs.collect(plant, seed)
    try:
        return _fitted(table, data, plant, seed)
    except InputError as error:
        return Unfitted(table, data, str(error))


def measured(table: FodTable, plant: Machine | None = None, seed: int = 0) -> Models:
    """All open-loop runs of a bench, by default the default one, and all fits to them."""
    return _fitted(table, _electrothermal_runs.collect(plant, seed), plant, seed)


def _fitted(table: FodTable, data: StepData, plant: Machine | None, seed: int) -> Models:
    first = actuator_fits.thesis(table, data.steps, data.cooled[1.575])
    better = wire_table.with_table(table, _electrothermal_runs.for_fit(plant, seed + 10_000))
    printed = first.model._replace(gain=Weighted())
    unseen = {
        name: Compared(
            actuator_fits.against(first.model, [r]),
            actuator_fits.against(printed, [r]),
            _judged(better, r),
        )
        for name, r in _electrothermal_runs.for_judgement(plant, seed + 20_000).items()
    }
    traces = {v: _traced(table, first, better, trials) for v, trials in data.steps.items()}
    steps = {
        v: judged(c.record.t, c.record.position, c.thesis, table.span) for v, c in traces.items()
    }
    return Models(table, data, first, better, traces, steps, unseen)


def _traced(table: FodTable, first: ThesisFit, better: WireFit, trials: list[Recording]) -> Trace:
    record = heating.inferred_step(table, trials, AMBIENT)
    sent, dt = trials[0]["ctrl"][: len(record.t)], trials[0].dt
    return Trace(
        record,
        full_model.simulate(first.model, sent, dt)[0],
        better_model.simulate(better.model.wires, sent, dt)[0],
    )


def _judged(better: WireFit, recording: Recording) -> Judgement:
    """The improved model's free simulation against a recording from cold."""
    wires = better.model.wires
    made = better_model.simulate(wires, recording["ctrl"], recording.dt)[0]
    return judged(recording["t"], 1e-3 * recording["laser"], made, wires.hysteresis.span)
