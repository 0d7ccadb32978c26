"""Machines for experiments: the simulated bench, compiled, or any rig, sample by sample."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from macromicro import loop, simulate
from macromicro.arrays import Array
from macromicro.columns import Column, quantities
from macromicro.control import calibration, macro, outside, supervisor
from macromicro.control import settings as control_settings
from macromicro.control.calibration import Calibration
from macromicro.control.macro import MacroLaw
from macromicro.control.settings import Control
from macromicro.control.stage_law import Sample as StageSample
from macromicro.control.stage_law import Target
from macromicro.control.supervisor import Progress, Supervisor
from macromicro.errors import MacromicroError
from macromicro.nominal import PERIOD, PITCH
from macromicro.plant.bench import Plant
from macromicro.programme import Programme
from macromicro.recorded import COLUMNS
from macromicro.recorder import Behind
from macromicro.recording import Recording
from macromicro.rig import guard
from macromicro.rig.faults import describe
from macromicro.rig.guard import Guard
from macromicro.rig.guarded import Guarded
from macromicro.rig.limits import Limits
from macromicro.rig.session import Fixture, Session
from macromicro.settings import Settings
from macromicro.simulate import Outcome, Sink
from macromicro.types import Command, Outputs, Sample

Machine = Plant | Fixture
Law = Callable[[int, Sample], tuple[Command, Outputs]]

NEAR = 1.0  # counts
SETTLE_S = 0.2
PATIENCE_S = 20.0
FLAGS = tuple(k for k, note in quantities(Sample).items() if not note.dtype.startswith("f"))
_TOLD = round(1.0 / PERIOD)  # periods between two calls of `progress`
_SHOWN_AS = {note.column: channel for channel, note in quantities(Sample).items()}
_SHOWN_AS |= {"hall_position": "hall"}


class GuardTripped(MacromicroError):
    """The guard ended a run that must be complete."""

    def __init__(self, what: str, rig: Guarded) -> None:
        fault = describe(rig.watch)
        assert fault is not None
        super().__init__(f"{what}: {fault.text}")


def watchdog(limits: Limits | None, table: Calibration | None) -> Guard:
    return guard.prepare(
        limits or Limits(), calibration.default_calibration() if table is None else table
    )


def law_of_approach(controller: Control, pitch: float) -> MacroLaw:
    """The chosen law if it is none of the thesis, of which only the tuned PD stops within a count.

    `pitch` is that of the encoder [m].
    """
    if controller.macro_law in macro.NAMES:
        controller = controller._replace(macro_law="pd-tuned", dead_zone_inverse="as designed")
    return control_settings.prepare(controller, pitch=pitch).macro


def under(settings: Settings, fixture: Fixture) -> Fixture:
    """The rig with law and guard of these settings, as far as it has none of its own."""
    law = law_of_approach(settings.controller, settings.sensors.encoder.pitch)
    return fixture._replace(limits=fixture.limits or settings.guard, law=fixture.law or law)


def approach(fixture: Fixture, session: Session, place: float) -> None:
    """Bring the carriage to rest at a place [counts], within a count.

    The rig's law drives it, through the guard, unless it stands there already.
    """
    dt = fixture.dt
    what = f"{fixture.name}, on the way to {place:.0f} counts"
    rig = Guarded(session, watchdog(fixture.limits, fixture.table), dt)
    law = fixture.law or law_of_approach(Control(), PITCH)
    memory, last, quiet = macro.begun(law), math.nan, 0
    for k in range(round(PATIENCE_S / dt)):
        x = rig.read().encoder
        near = abs(place - x) <= NEAR
        if near and (k == 0 or quiet >= round(SETTLE_S / dt)):
            session.stop()
            return
        motor = 0.0
        quiet = quiet + 1 if near and x == last else 0
        last = x
        if near:
            memory = (*macro.rest(place - x), *outside.again(memory[macro.SHIPPED :]))
        elif not math.isnan(x):
            memory, motor = macro.step(
                law, memory, Target(place, 0.0, 0.0, math.inf), StageSample(k * dt, x), dt
            )
        rig.expect(Command(place, 1.0, 0.0, 0.0, 0.0))
        rig.write(Outputs(motor, 0.0, 0.0, 0.0))
        if rig.tripped:
            raise GuardTripped(what, rig)
        session.wait(dt)
    raise MacromicroError(
        f"{what}: the carriage is at {last:.0f} counts after {PATIENCE_S:g} s; free the carriage "
        "and check that the encoder counts from the lower end of the travel"
    )


def play(
    fixture: Fixture,
    what: str,
    periods: int,
    law: Law,
    *,
    seed: int = 0,
    start: float | None = None,
) -> dict[str, Array]:
    """Drive a rig from `start` [counts] by a law for command and outputs.

    Returns each channel of `Sample` and each output, shape (periods,). All outputs pass the guard;
    if it trips, or the rig fails, outputs are safe and the error is raised.
    """
    samples, given = [], []
    with fixture.open(seed) as session:
        if start is None:
            session.cold(fixture.rest)
        else:
            approach(fixture, session, start)
        session.restart()
        rig = Guarded(session, watchdog(fixture.limits, fixture.table), fixture.dt)
        for k in range(periods):
            sample = rig.read()
            command, outputs = law(k, sample)
            rig.expect(command)
            rig.write(outputs)
            if rig.tripped:
                raise GuardTripped(f"{fixture.name}, {what}", rig)
            samples.append(sample)
            given.append(rig.given)
            session.wait(fixture.dt)
        if start is not None:  # so that the next run finds the carriage at rest
            session.idle(SETTLE_S)
    shown, written = (np.array(rows, dtype=np.float64).T for rows in (samples, given))
    found = dict(zip((*Sample._fields, *Outputs._fields), (*shown, *written), strict=True))
    return {name: fill_gaps(row) if name in FLAGS else row for name, row in found.items()}


def follow(
    rig: Any,
    programme: Programme,
    control: Supervisor,
    limits: Limits | None,
    sink: Sink,
    longest: int,
    progress: Callable[[float, int], None] | None = None,
) -> Outcome:
    """Run a programme on an opened rig, for at most `longest` periods, through the guard.

    The sink lags by at most a tenth of a second.
    """
    rows, began = 0, time.perf_counter()
    guarded = Guarded(rig, watchdog(limits, control.calibration), PERIOD)
    with Behind(sink) as behind:

        def take(row: Array, state: Progress) -> None:
            nonlocal rows
            behind.append(row)
            rows += 1
            if progress is not None and rows % _TOLD == 0:
                progress(rows * PERIOD, state.move)

        plan, start = simulate.plan(programme), supervisor.begin(0.0, control)
        last = loop.run(guarded, control, plan, PERIOD, start, take, longest)
    return simulate.outcome(last.phase == supervisor.DONE, guarded.watch, rows * PERIOD, began)


def fill_gaps(flag: Array) -> Array:
    """A flag whose missing values (NaN) are the last known one."""
    there = ~np.isnan(flag)
    row = np.maximum.accumulate(np.where(there, np.arange(len(flag)), -1))
    return np.where(row >= 0, flag[row], 0.0)


def visible_columns(fixture: Fixture, columns: Sequence[Column] = COLUMNS) -> tuple[Column, ...]:
    """Columns that a rig can fill: no truth, nothing unmeasured."""
    return tuple(
        c
        for c in columns
        if not c.name.startswith("true_") and _SHOWN_AS.get(c.name, "t") in ("t", *fixture.channels)
    )


def as_recording(
    fixture: Fixture,
    columns: Sequence[Column],
    values: dict[str, Any],
    dt: float,
    seed: int,
    attributes: Mapping[str, str | int | float] | None = None,
) -> Recording:
    shown = visible_columns(fixture, columns)
    about = {"seed": seed, "rig": fixture.name, **(attributes or {})}
    return Recording.from_arrays(shown, [values[c.name] for c in shown], dt, about)
