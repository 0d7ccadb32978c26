"""Run a programme on the virtual bench, compiled, a chunk at a time, into a recorder."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from macromicro import arrays, hall_table, interpreting, loop, recorded
from macromicro.control import calibration, supervisor
from macromicro.control import settings as control_settings
from macromicro.control.supervisor import Plan, Progress, Supervisor
from macromicro.loop import PERIOD, Run
from macromicro.plant import bench
from macromicro.plant.bench import NOISES, Plant, Truth
from macromicro.programme import Programme, moves
from macromicro.programme.rates import rates, turns
from macromicro.rig import guard
from macromicro.rig.codes import OK
from macromicro.rig.faults import Fault, describe
from macromicro.rig.guard import Guard, Watch
from macromicro.rig.guarded import CompiledGuarded
from macromicro.rig.twin import CompiledTwin, noise_source
from macromicro.settings import Settings
from macromicro.types import SAFE, Command, Sample

CHUNK = 5000
_USUAL_MOVE = 0.9  # s, until the arrival of a move of the carriage is declared


class Sink(Protocol):
    """Where recorded blocks go: a `Recorder`, or a list in memory."""

    def append(self, block: npt.NDArray[np.float64]) -> None:
        """Take a block of recorded periods."""


class Outcome(NamedTuple):
    """How a run of any machine ended."""

    finished: bool  # whether the programme came to its end
    watch: Any  # of the guard that found the fault, with its evidence, or of the first
    fault: Fault | None
    simulated: float  # time on the machine, s
    wall: float


def outcome(finished: bool, watch: Watch, simulated: float, began: float) -> Outcome:
    """The end of a run of the two-stage machine that began at a `time.perf_counter`."""
    return Outcome(finished, watch, describe(watch), simulated, time.perf_counter() - began)


class Rolled(NamedTuple):
    """The arguments of ``loop.rollout``, prepared once."""

    plant: Plant  # the bench
    control: Supervisor
    watchdog: Guard
    plan: Plan  # the programme
    run: Run  # the state at the start


def plan(programme: Programme) -> Plan:
    """The programme as the supervisor takes it."""
    velocity, acceleration = rates(programme)
    return Plan(
        np.ascontiguousarray(programme.start, dtype=float),
        np.ascontiguousarray(programme.stage, dtype=np.int64),
        np.ascontiguousarray(programme.target, dtype=float),
        np.ascontiguousarray(programme.hold, dtype=float),
        float(programme.end),
        velocity,
        acceleration,
        turns(programme),
        programme.correction,
    )


def prepare(settings: Settings, programme: Programme, fan: bool = False) -> Rolled:
    """Runtime parameters, and the state at the start: at rest at 0 mm, cold."""
    table = hall_table.of_bench(settings)
    plant = bench.prepare(settings.bench, settings.sensors)
    control = control_settings.prepare(
        settings.controller, fan, table, settings.sensors.encoder.pitch
    )
    return Rolled(
        plant,
        control,
        guard.prepare(settings.guard, control.calibration),
        plan(programme),
        Run(0, bench.initial(plant), supervisor.begin(0.0, control), guard.fresh()),
    )


def arguments(rolled: Rolled, count: int) -> tuple[Any, ...]:
    """What the loop is given for so many periods, without noise yet."""
    rows = len(recorded.columns(rolled.control))
    return *rolled, np.empty((count, NOISES)), np.empty((rows, count)), PERIOD


def longest(settings: Settings, programme: Programme) -> float:
    """Upper bound of a programme's duration: every macro move out of patience."""
    if not np.isnan(programme.end):
        return float(programme.end) + 1.0
    sequence = settings.controller.sequence
    macro_moves = int((programme.waiting & (programme.stage == moves.MACRO)).sum())
    # A move begins at a whole period, so a hold may last up to two periods longer than it says.
    rounding = 2.0 * PERIOD * len(programme.hold)
    waits = macro_moves * (sequence.patience + sequence.wait)
    return float(programme.hold.sum()) + waits + rounding + 1.0


def expected_duration(settings: Settings, programme: Programme) -> float:
    """Usual duration of a programme, s."""
    if programme.scheduled:
        return programme.end
    each = _USUAL_MOVE + settings.controller.sequence.wait
    return float(programme.hold.sum()) + each * int(
        (programme.waiting & (programme.stage == moves.MACRO)).sum()
    )


def _switched_off(
    rolled: Rolled, sample: Sample, progress: Progress, watch: Watch, real: Truth
) -> npt.NDArray[np.float64]:
    """The period after a run that was ended from outside: measured, and all outputs safe."""
    place = calibration.position(rolled.control.calibration, sample.hall)
    command = Command(progress.macro_reference, 0.0, progress.micro_reference, 0.0, place)
    column = np.empty((len(recorded.columns(rolled.control)), 1))
    recorded.beside(column, 0, rolled.control, progress)
    shown = recorded.inside(progress, watch, guard.temperature(rolled.watchdog.limits, watch))
    recorded.note(column, 0, sample, command, SAFE, shown, real)
    return column


def _interpret(
    rolled: Rolled,
    sink: Sink,
    seed: int,
    progress: Callable[[float, int], None] | None,
    seconds: float,
) -> Outcome:
    """`simulate` with a law that cannot be compiled: the control loop over the compiled bench."""
    began = time.perf_counter()
    twin = CompiledTwin(rolled.plant, seed)
    rig = CompiledGuarded(twin, rolled.watchdog, PERIOD)
    rows, done = list[npt.NDArray[np.float64]](), 0

    def flush() -> None:
        nonlocal done
        done += len(rows)
        if rows:
            sink.append(np.concatenate(rows, axis=1))
        rows.clear()

    def take(row: npt.NDArray[np.float64], last: Progress) -> None:
        rows.append(row)
        if len(rows) < CHUNK:
            return
        flush()
        if progress is not None:
            try:
                progress(done * PERIOD, last.move)
            except BaseException:
                rig.stop()
                rig.clock.wait(PERIOD)
                off = _switched_off(rolled, rig.read(), last, rig.watch, twin.truth())
                sink.append(off)
                raise

    periods = round(seconds / PERIOD)
    state = loop.run(rig, rolled.control, rolled.plan, PERIOD, rolled.run.progress, take, periods)
    flush()
    if progress is not None:
        progress(done * PERIOD, state.move)
    return outcome(state.phase == supervisor.DONE, rig.watch, done * PERIOD, began)


def simulate(
    settings: Settings,
    programme: Programme,
    sink: Sink,
    *,
    seed: int = 0,
    fan: bool = False,
    progress: Callable[[float, int], None] | None = None,
) -> Outcome:
    """Run a programme on the twin and append every period to a sink.

    The same seed gives the same rows, bit for bit. An exception from `progress` or the sink ends
    the run and keeps what was appended.
    """
    rolled = prepare(settings, programme, fan)
    if not rolled.control.compiles:
        return _interpret(rolled, sink, seed, progress, longest(settings, programme))
    periods, rows = (
        expected_duration(settings, programme) / PERIOD,
        len(recorded.columns(rolled.control)),
    )
    advance = interpreting.quickest(loop.rollout, periods, *arguments(rolled, 0))
    random = noise_source(seed)
    run = arrays.own(rolled.run)
    limit = round(longest(settings, programme) / PERIOD)
    began = time.perf_counter()
    while run.tick < limit:
        noise, block = random.standard_normal((CHUNK, NOISES)), np.empty((rows, CHUNK))
        run, written = advance(*rolled._replace(run=run), noise, block, PERIOD)
        sink.append(block[:, :written])
        if progress is not None:
            try:
                progress(run.tick * PERIOD, run.progress.move)
            except BaseException:
                draw = bench.Noise(*random.standard_normal(NOISES).tolist())
                sample = bench.measure(rolled.plant, run.bench, run.tick * PERIOD, draw)
                truth = bench.truth(rolled.plant, run.bench)
                sink.append(_switched_off(rolled, sample, run.progress, run.watch, truth))
                raise
        if written < CHUNK or run.progress.phase == supervisor.DONE or run.watch.fault != OK:
            break
    return outcome(run.progress.phase == supervisor.DONE, run.watch, run.tick * PERIOD, began)
