"""The one control loop for any rig, and the same steps compiled for the virtual bench."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro import nominal
from macromicro.arrays import Array
from macromicro.control import pi, supervisor
from macromicro.control.pi import PiAntiWindup
from macromicro.control.supervisor import DONE, Plan, Progress, Supervisor
from macromicro.kernel import kernel
from macromicro.plant import bench
from macromicro.plant.bench import Plant, State, Truth
from macromicro.recorded import beside, columns, inside, note
from macromicro.rig import guard
from macromicro.rig.codes import OK
from macromicro.rig.guard import Guard, Watch
from macromicro.rig.guarded import Guarded
from macromicro.types import Outputs

PERIOD = nominal.PERIOD


class Run(NamedTuple):
    tick: int  # control periods so far
    bench: State  # the bench's state
    progress: Progress
    watch: Watch  # the guard's state


def run(
    rig: Guarded,
    control: Supervisor,
    plan: Plan,
    dt: float,
    progress: Progress,
    sink: Callable[[Array, Progress], None] | None = None,
    periods: int | None = None,
) -> Progress:
    """Drive a guarded rig until the plan is completed, a fault trips, or `periods` pass."""
    real, rows = getattr(rig.rig, "truth", None), len(columns(control))
    done = 0
    with rig:
        while periods is None or done < periods:
            sample = rig.read()
            progress, command, requested = supervisor.step(control, plan, progress, sample, dt)
            rig.expect(command)
            truth = real() if real is not None else _UNKNOWN
            rig.write(requested)
            if sink is not None:
                column = np.empty((rows, 1))
                seen = inside(progress, rig.watch, rig.temperature)
                note(column, 0, sample, command, rig.given, seen, truth)
                beside(column, 0, control, progress)
                sink(column, progress)
            done += 1
            if progress.phase == DONE or rig.tripped:
                break
            rig.clock.wait(dt)
    return progress


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
    """Run the twin for up to ``len(noise)`` control periods."""
    tick, machine, progress, watch = run.tick, run.bench, run.progress, run.watch
    written = 0
    for k in range(noise.shape[0]):
        draw = bench.drawn(noise, k)
        sample = bench.measure(plant, machine, tick * dt, draw)
        progress, command, requested = supervisor.step(control, plan, progress, sample, dt)
        watch, given = guard.step(watchdog, watch, sample, command, requested, dt)
        truth = bench.truth(plant, machine)
        shown = inside(progress, watch, guard.temperature(watchdog.limits, watch))
        note(out, k, sample, command, given, shown, truth)
        beside(out, k, control, progress)
        machine = bench.advance(plant, machine, given, draw, dt)
        tick += 1
        written += 1
        if progress.phase == DONE or watch.fault != OK:
            break
    return Run(tick, machine, progress, watch), written


# Rows of `stage`, by channel.
STAGE = ("encoder", "ctrl", "laser", "hall", "contract", "micro", "wire")


@kernel
def stage(
    p: Plant,
    s: State,
    law: PiAntiWindup,
    closed: bool,
    given: Array,
    noise: Array,
    out: Array,
    every: int,
    dt: float,
) -> State:
    """The twin under the rows of `given`: motor volts, and CTRL or, `closed`, what a law holds.

    Writes the rows `STAGE` of every `every`-th period.
    """
    integral = 0.0
    for k in range(given.shape[1]):
        draw = bench.drawn(noise, k)
        sample = bench.measure(p, s, k * dt, draw)
        ctrl = given[1, k]
        if closed:
            integral, ctrl = pi.step(law, integral, given[1, k] - sample.laser, dt)
        if k % every == 0:
            j = k // every
            out[0, j] = sample.encoder
            out[1, j] = ctrl
            out[2, j] = sample.laser
            out[3, j] = sample.hall
            out[4, j] = sample.contract
            out[5, j] = s.micro.wire.x
            out[6, j] = s.micro.wire.temperature
        s = bench.advance(p, s, Outputs(given[0, k], ctrl, 0.0, 0.0), draw, dt)
    return s
