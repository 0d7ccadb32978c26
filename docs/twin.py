"""The two-stage machine under both pairs of laws, with set points that may change at any time.

`docs/make_twin.py` exports it for the page.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np

from macromicro import hall_table
from macromicro.columns import Meaning
from macromicro.control import macro, supervisor
from macromicro.control import settings as control_settings
from macromicro.control.supervisor import MACRO, Plan, Progress, Supervisor
from macromicro.export.units import Entry, Unit
from macromicro.kernel import kernel
from macromicro.nominal import PERIOD
from macromicro.plant import bench
from macromicro.plant.bench import Noise, Plant, State
from macromicro.settings import Settings
from macromicro.types import Outputs


class Aim(NamedTuple):
    """What the page asks for."""

    carriage: Annotated[float, Meaning("set point of the carriage", "count")]
    micro: Annotated[float, Meaning("set point of the micro-stage", "m")]
    own: Annotated[float, Meaning("1: the laws terminal and inverse; 0: those of the thesis")]
    backlash: Annotated[float, Meaning("between encoder and carriage", "m")]


class Twin(NamedTuple):
    bench: State
    carriage: float  # position behind the backlash, m
    thesis: Progress
    own: Progress
    chosen: float  # the laws of the last period, as in `Aim`


class Shown(NamedTuple):
    """What the page shows."""

    carriage: Annotated[float, Meaning("position of the carriage", "m")]
    micro: Annotated[float, Meaning("position of the micro-stage", "m")]
    laser: Annotated[float, Meaning("position of both, with the belt", "m")]
    temperature: Annotated[float, Meaning("of the wires", "degC")]
    plates: Annotated[float, Meaning("temperature of the plates", "degC")]
    relay: Annotated[float, Meaning("input of the relays", "degC")]
    austenite: Annotated[float, Meaning("fraction")]
    high: Annotated[float, Meaning("upper value of the asked corner, NaN beyond the last", "degC")]
    low: Annotated[float, Meaning("lower value of the asked corner", "degC")]
    corners: Annotated[float, Meaning("number of corners")]


@kernel
def _aimed(s: Progress, aim: Aim, changed: bool, t: float) -> Progress:
    """The supervisor with the page's set points; a new one of the carriage begins its move."""
    if changed or s.move < 0 or s.macro_reference != aim.carriage:
        return Progress(
            0, MACRO, t, t, math.nan, 0, aim.carriage, 0.0, macro.again(s.macro), 0.0, s.fine
        )
    return Progress(
        s.move, s.phase, s.began, s.entered, s.inside, s.zeroed, s.macro_reference, aim.micro,
        s.macro, s.integral, s.fine,
    )  # fmt: skip


@kernel
def step(
    plant: Plant,
    thesis: Supervisor,
    own: Supervisor,
    plan: Plan,
    s: Twin,
    aim: Aim,
    t: float,
    dt: float,
) -> tuple[
    Annotated[Twin, Meaning(name="state")],
    Annotated[float, Meaning("phase of the supervisor", name="phase")],
    Annotated[Outputs, Meaning(name="outputs")],
]:
    """One control period without noise."""
    draw = Noise(0.0, 0.0, 0.0)
    sample = bench.measure(plant, s.bench, t, draw)
    changed = s.chosen != aim.own
    first, second = s.thesis, s.own
    if aim.own > 0.5:
        second = _aimed(second, aim, changed, t)
        second, _, outputs = supervisor.step(own, plan, second, sample, dt)
        phase = float(second.phase)
    else:
        first = _aimed(first, aim, changed, t)
        first, _, outputs = supervisor.step(thesis, plan, first, sample, dt)
        phase = float(first.phase)
    machine = bench.advance(plant, s.bench, outputs, draw, dt)
    carriage = _behind(s.carriage, machine.macro.x, aim.backlash)
    return Twin(machine, carriage, first, second, aim.own), phase, outputs


@kernel
def _behind(carriage: float, driven: float, gap: float) -> float:
    """Position of a carriage that friction holds until a side of the gap pushes it."""
    return min(max(carriage, driven - 0.5 * gap), driven + 0.5 * gap)


@kernel
def show(plant: Plant, s: Twin, corner: float) -> Shown:
    """True quantities, and one corner of the Preisach memory."""
    truth = bench.truth(plant, s.bench)
    memory = s.bench.micro.wire.memory
    k = int(corner)
    high, low = math.nan, math.nan
    if k <= memory.pairs:
        high, low = memory.corners[k, 0], memory.corners[k, 1]
    return Shown(
        s.carriage, truth.micro, s.carriage + truth.micro + truth.belt, truth.wire,
        truth.plates, s.bench.micro.wire.u, truth.austenite, high, low, float(memory.pairs + 1),
    )  # fmt: skip


def unit() -> Unit:
    """The twin as a unit of export."""
    spec = Settings()
    plant = bench.prepare(spec.bench, spec.sensors)
    pair = [
        spec,
        spec.with_({"controller.macro_law": "terminal", "controller.micro_law": "inverse"}),
    ]
    table, pitch = hall_table.of_bench(spec), spec.sensors.encoder.pitch
    thesis, own = (
        control_settings.prepare(each.controller, table=table, pitch=pitch) for each in pair
    )
    nothing = np.empty(0)
    # The carriage's move, then the micro-stage's without end.
    plan = Plan(
        np.array([0.0, math.nan]), np.array([0, 1]), np.zeros(2), np.array([0.0, math.inf]),
        math.nan, nothing, nothing, nothing, nothing,
    )  # fmt: skip
    first = Twin(
        bench.initial(plant), 0.0, supervisor.begin(0.0, thesis), supervisor.begin(0.0, own), 0.0
    )
    aim = Aim(0.0, 0.0, 0.0, 0.0)
    entries = (
        Entry("step", step, (plant, thesis, own, plan, first, aim, 0.0, 0.0)),
        Entry("show", show, (plant, first, 0.0)),
    )
    given = {"plant": plant, "thesis": thesis, "own": own, "plan": plan}
    return Unit("twin", "the two-stage machine in a page", entries, given, first, PERIOD)
