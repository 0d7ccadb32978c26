"""The one control loop, and the same steps compiled for the virtual bench.

`run` drives any rig: read, control, guard, write, wait. `rollout` is that loop unrolled
for the twin; with the same seed both give the same recording.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro import nominal
from macromicro.columns import COLUMNS
from macromicro.control import supervisor
from macromicro.control.macro import MacroMemory
from macromicro.control.supervisor import DONE, FAULT, Plan, Progress, Supervisor
from macromicro.kernel import kernel
from macromicro.plant import bench
from macromicro.plant.bench import Plant, State, Truth
from macromicro.rig import guard
from macromicro.rig.codes import OK
from macromicro.rig.guard import Guard, Watch
from macromicro.rig.guarded import Guarded
from macromicro.types import Command, Controller, Outputs, Sample

PERIOD = nominal.PERIOD
ROWS = len(COLUMNS)


class Run(NamedTuple):
    """State of a run on the twin: control periods so far, bench, supervisor, guard."""

    tick: int
    bench: State
    progress: Progress
    watch: Watch


@kernel
def note(
    out: npt.NDArray[np.float64],
    k: int,
    sample: Sample,
    command: Command,
    given: Outputs,
    progress: Progress,
    watch: Watch,
    real: Truth,
) -> None:
    """Write one control period into column `k` of a block; rows as in `COLUMNS`."""
    out[0, k] = sample.t
    out[1, k] = progress.macro_reference
    out[2, k] = sample.encoder
    out[3, k] = given.motor
    out[4, k] = progress.macro.integral
    out[5, k] = progress.micro_reference
    out[6, k] = sample.hall
    out[7, k] = command.micro_position
    out[8, k] = given.ctrl
    out[9, k] = progress.integral
    out[10, k] = sample.laser * 1e6
    out[11, k] = guard.temperature(watch)
    out[12, k] = progress.phase if watch.fault == OK else FAULT
    out[13, k] = progress.move
    out[14, k] = sample.extend
    out[15, k] = sample.contract
    out[16, k] = given.fan
    out[17, k] = given.laser_reset
    out[18, k] = real.carriage * 1e3
    out[19, k] = real.speed * 1e3
    out[20, k] = real.belt * 1e6
    out[21, k] = real.micro * 1e3
    out[22, k] = real.current
    out[23, k] = real.wire
    out[24, k] = real.plates
    out[25, k] = real.body
    out[26, k] = real.austenite
    out[27, k] = real.heat


Block = npt.NDArray[np.float64]


def run(
    rig: Guarded,
    controller: Controller,
    reference: Any,
    dt: float,
    state: Any,
    sink: Callable[[Block], None] | None = None,
    periods: int | None = None,
) -> Any:
    """Drive a guarded rig until the reference is worked off, a fault trips, or `periods` pass.

    Every period: read, control, guard, write, record, wait. `state` is the controller's
    state at the start; the last one is returned. `sink` takes one column (rows as in
    `COLUMNS`) a period; quantities that only a bench knows are NaN on a real rig. The
    rig is entered and left here, so it ends safe whatever happens.
    """
    real = getattr(rig.rig, "truth", None)
    done = 0
    with rig:
        while periods is None or done < periods:
            sample = rig.read()
            state, command, wanted = controller.step(state, reference, sample, dt)
            rig.expect(command)
            truth = real() if real is not None else _UNKNOWN
            rig.write(wanted)
            if sink is not None:
                column = np.empty((ROWS, 1))
                over = controller.finished(state)
                shown = _shown(state, command, over)
                note(column, 0, sample, command, rig.given, shown, rig.watch, truth)
                sink(column)
            done += 1
            if controller.finished(state) or rig.tripped:
                break
            rig.clock.wait(dt)
    return state


def _shown(state: Any, command: Command, over: bool) -> Progress:
    """What is recorded of a controller's state: of one of another kind than the supervisor's,
    what its command tells; integrals and the number of the move are then unknown."""
    if isinstance(state, Progress):
        return state
    nan = float("nan")
    phase = supervisor.WAITING
    if over:
        phase = DONE
    elif command.macro_active > 0.5:
        phase = supervisor.MACRO
    elif command.micro_active > 0.5:
        phase = supervisor.MICRO
    return supervisor.begin(0.0)._replace(
        phase=phase,
        macro_reference=command.macro_reference,
        micro_reference=command.micro_reference,
        macro=MacroMemory(nan, nan),
        integral=nan,
    )


_UNKNOWN = Truth(*[float("nan")] * len(Truth._fields))


@kernel
def rollout(
    plant: Plant,
    control: Supervisor,
    watchdog: Guard,
    plan: Plan,
    run: Run,
    noise: npt.NDArray[np.float64],
    out: npt.NDArray[np.float64],
    dt: float,
) -> tuple[Run, int]:
    """Run the twin for up to ``len(noise)`` control periods into `out` (rows, periods).

    Returns the state after them and the number of periods written: fewer than asked
    for when the programme ended or the guard tripped (that period is the last written).
    """
    tick, machine, progress, watch = run.tick, run.bench, run.progress, run.watch
    written = 0
    for k in range(noise.shape[0]):
        sample = bench.measure(plant, machine, tick * dt, noise[k, 0], noise[k, 1])
        progress, command, wanted = supervisor.step(control, plan, progress, sample, dt)
        watch, given = guard.step(watchdog, watch, sample, command, wanted, dt)
        note(out, k, sample, command, given, progress, watch, bench.truth(plant, machine))
        machine = bench.advance(plant, machine, given, noise[k, 2], dt)
        tick += 1
        written += 1
        if progress.phase == DONE or watch.fault != OK:
            break
    return Run(tick, machine, progress, watch), written
