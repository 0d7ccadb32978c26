"""Cycle testing of the actuator alone (Appendix D, its Figures 9 to 14).

150 encoder counts every 4 s, half an hour of rest between the runs, logged at 1 ms. The
thesis prints the PID's gains but not its form; `Law` defines what it leaves open.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from macromicro import signals
from macromicro.arrays import Array
from macromicro.errors import MacromicroError
from macromicro.identify.clusters import within
from macromicro.kernel import compiled, kernel
from macromicro.rig.fixtures import CYCLE_PERIOD, CycleOutputs
from macromicro.rig.session import Fixture, Session
from macromicro.rig.twin import noise_source
from macromicro.thesis import cycle_bench
from macromicro.thesis.cycle_bench import CycleBed, CycleBench, CyclePlant, CycleState

DT = CYCLE_PERIOD
PEAK, PERIOD_S = 150.0, 4.0
CYCLES, RUNS, REST_S = 40, 11, 1800.0
# "Approximately 23 degC": the room of each run is drawn with this standard deviation [K].
ROOM_STD = 0.5
_REST_DT = 0.01
WINDOW = 1000
SILENT = 5  # samples


class Law(NamedTuple):
    """PID on counts: kp [V/count], ki [V/(count s)], kd [V/count for a change in one sample].

    `conditional` 1: integrate only where the effort is within 0-5 V or the error leads back
    into it; 0: always.
    """

    kp: float = 0.5
    ki: float = 0.5
    kd: float = 0.1
    conditional: int = 1


WORKING = Law()
# The derivative per second: 0.1 V s/count is 100 V for a count in one sample of 1 ms.
PER_SECOND = Law(kd=0.1 / DT)
UNLIMITED = Law(conditional=0)


class Memory(NamedTuple):
    """Integral effort [V] and last error [counts]."""

    integral: float
    error: float


@kernel
def step(p: Law, s: Memory, error: float, dt: float) -> tuple[Memory, float]:
    """New state and effort [V], clamped to 0-5 V, for an error [counts]."""
    requested = p.kp * error + s.integral + p.kd * (error - s.error)
    integral = s.integral
    inside = 0.0 <= requested <= 5.0
    back = (requested < 0.0 and error > 0.0) or (requested > 5.0 and error < 0.0)
    if p.conditional == 0 or inside or back:
        integral = integral + p.ki * error * dt
    return Memory(integral, error), min(max(requested, 0.0), 5.0)


@kernel
def _run(
    plant: CyclePlant, s: CycleState, p: Law, reference: Array, out: Array, dt: float
) -> CycleState:
    """Closed loop on the twin: counts into `out`."""
    memory = Memory(0.0, 0.0)
    for k in range(len(reference)):
        sample = cycle_bench.measure(plant, s, k * dt)
        out[k] = sample.encoder
        memory, ctrl = step(p, memory, reference[k] - sample.encoder, dt)
        s = cycle_bench.advance(plant, s, ctrl, 0.0, dt)
    return s


@kernel
def _rest(plant: CyclePlant, s: CycleState, periods: int, dt: float) -> CycleState:
    for _ in range(periods):
        s = cycle_bench.advance(plant, s, 0.0, 0.0, dt)
    return s


def reference(cycles: int) -> Array:
    """The pulse train [counts], one value per ms."""
    return signals.pulse_train(signals.times(cycles * PERIOD_S, DT), PEAK, PERIOD_S)


class CycleData(NamedTuple):
    """Counts of every run, and one cold run each with the other readings of the PID."""

    counts: Array  # (runs, samples)
    room: Array  # [degC] at the start of each run, or NaN
    literal: Array  # as `PER_SECOND`
    unlimited: Array  # as `UNLIMITED`


def _one_run(session: Session, p: Law, requested: Array) -> tuple[Array, float]:
    """Counts (samples,) of one run on an opened rig, and the room [degC] at its start, or NaN.

    While counts are missing the law stands still and its output is off; after 5 ms it is an error.
    """
    memory, silent = Memory(0.0, 0.0), 0
    counts = np.empty(len(requested))
    room = math.nan
    for k, goal in enumerate(requested):
        sample = session.read()
        if k == 0 and "room" in session.channels:
            room = float(sample.room)
        counts[k], ctrl = sample.encoder, 0.0
        silent = silent + 1 if math.isnan(sample.encoder) else 0
        if silent > SILENT:
            raise MacromicroError("cycle bench: no reading from the encoder; check its plug")
        if not silent:
            memory, ctrl = step(p, memory, float(goal) - counts[k], DT)
        session.write(CycleOutputs(ctrl, 0.0))
        session.clock.wait(DT)
    return counts, room


def _on_rig(rig: Fixture, seed: int, runs: int, cycles: int, rest_s: float) -> CycleData:
    """All runs on any rig, as `collect` does them; the room temperature is not controlled."""
    rig.need("cycle testing", "encoder")
    requested = reference(cycles)
    found = []
    with rig.open(seed) as session:
        session.idle(rig.rest)
        for k in range(runs):
            session.idle(rest_s if k else 0.0)
            found.append(_one_run(session, WORKING, requested))
    others = []
    for law in (PER_SECOND, UNLIMITED):
        with rig.open(seed) as session:
            session.idle(rig.rest)
            others.append(_one_run(session, law, requested)[0])
    counts, room = zip(*found, strict=True)
    return CycleData(np.array(counts), np.array(room), *others)


def collect(
    bed: CycleBed | None = None,
    seed: int = 0,
    runs: int = RUNS,
    cycles: int = CYCLES,
    room_std: float = ROOM_STD,
    rest_s: float = REST_S,
) -> CycleData:
    """All runs, the first from cold, each later one after `rest_s` [s] of rest.

    By default on the twin, whose room temperature varies from run to run by `room_std` [K].
    """
    if isinstance(bed, Fixture):
        return _on_rig(bed, seed, runs, cycles, rest_s)
    plant = bed or cycle_bench.prepare(CycleBench())
    drive, idle = compiled(_run), compiled(_rest)
    room = plant.micro.thermal.ambient + room_std * noise_source(seed).standard_normal(runs)
    requested = reference(cycles)

    def in_room(degc: float) -> CyclePlant:
        thermal = plant.micro.thermal._replace(ambient=degc)
        return plant._replace(micro=plant.micro._replace(thermal=thermal))

    counts = np.empty((runs, len(requested)))
    state = cycle_bench.initial(in_room(float(room[0])))
    for k in range(runs):
        here = in_room(float(room[k]))
        state = drive(here, state, WORKING, requested, counts[k], DT)
        state = idle(here, state, round(rest_s / _REST_DT), _REST_DT)
    others = np.empty((2, len(requested)))
    for row, law in zip(others, (PER_SECOND, UNLIMITED), strict=True):
        drive(plant, cycle_bench.initial(plant), law, requested, row, DT)
    return CycleData(counts, room, others[0], others[1])


class Cycles(NamedTuple):
    """Times [s] and shares [%] of every cycle of a run, shape (cycles,); NaN if not reached."""

    tau1: Array  # from the step to 149 counts
    tau2: Array  # from the last 0 to 149 counts
    fall: Array  # from the step back to 0 counts
    first: Array  # of 1000 samples, share at 150 counts from the first of them
    last: Array  # of 1000 samples, share at 150 counts before the output drops


def measured(counts: Array) -> Cycles:
    rows = [_one(part) for part in counts.reshape(-1, round(PERIOD_S / DT))]
    return Cycles(*np.array(rows).T)


def _one(part: Array) -> tuple[float, float, float, float, float]:
    half = len(part) // 2
    up, down = part[:half], part[half:]
    nan = float("nan")
    there = np.flatnonzero(up >= PEAK - 1.0)
    zeros = np.flatnonzero(up[: there[0]] <= 0.0) if len(there) else there
    tau1 = float(there[0]) * DT if len(there) else nan
    tau2 = float(there[0] - zeros[-1]) * DT if len(zeros) else nan
    back = np.flatnonzero(down <= 0.0)
    fall = float(back[0]) * DT if len(back) else nan
    first, last = share(part, PEAK)
    return tau1, tau2, fall, first, last


def share(part: Array, level: float) -> tuple[float, float]:
    """Share [%] of samples at `level` [counts] in both windows of a cycle (its Figures 13, 14).

    NaN where the output does not reach 150 counts in time for a whole window.
    """
    half = len(part) // 2
    reached = np.flatnonzero(part[:half] >= PEAK)
    if not len(reached) or reached[0] + WINDOW > len(part):
        return float("nan"), float("nan")
    dropped = np.flatnonzero(part[half:] < PEAK)
    end = half + (int(dropped[0]) if len(dropped) else 0)
    a, b = part[reached[0] :][:WINDOW], part[end - WINDOW : end]
    return 100.0 * float(np.mean(a == level)), 100.0 * float(np.mean(b == level))


class Trend(NamedTuple):
    """Change of a run's mean total time [s] per run, corrected for room temperature."""

    slope: float
    reach: float  # half width of the 95 % interval


def run_trend(totals: Array, room: Array) -> Trend:
    """Least squares of `totals` [s], shape (runs,), on run number and `room` [degC]."""
    n = len(totals)
    columns = [np.ones(n), np.arange(n) - 0.5 * (n - 1)]
    if np.ptp(room) > 0.0:
        columns.append(room - room.mean())
    x = np.column_stack(columns)
    found = np.linalg.lstsq(x, totals, rcond=None)[0]
    left, free = totals - x @ found, n - x.shape[1]
    variance = float(left @ left) / free * float(np.linalg.inv(x.T @ x)[1, 1])
    return Trend(float(found[1]), within(free) * float(np.sqrt(variance)))
