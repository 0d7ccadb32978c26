"""Cycle testing of the actuator alone (Appendix D): Figures D.9 to D.14, claims A1 to A6."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from macromicro import signals
from macromicro.arrays import Array
from macromicro.drawing.exhibit import Drawn
from macromicro.drawing.style import (
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    RED,
    dots,
    finish,
    new,
    note,
    single,
)
from macromicro.errors import MacromicroError
from macromicro.identify.clusters import within
from macromicro.kernel import compiled, kernel
from macromicro.rig.fixtures import CYCLE_PERIOD, CycleOutputs
from macromicro.rig.session import Fixture, Session
from macromicro.rig.twin import noise_source
from macromicro.thesis import cycle_bench
from macromicro.thesis.claims import Claim, accepts, band, judge, printed_value, state
from macromicro.thesis.contents import CAPTIONS, caption
from macromicro.thesis.cycle_bench import CycleBed, CyclePlant, CycleState
from macromicro.thesis.procedure import Lab

if TYPE_CHECKING:
    from matplotlib.axes import Axes


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
    """All runs on any rig, as `cycling_runs` does them; the room temperature is not controlled."""
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


def cycling_runs(
    plant: CycleBed,
    seed: int = 0,
    runs: int = RUNS,
    cycles: int = CYCLES,
    room_std: float = ROOM_STD,
    rest_s: float = REST_S,
) -> CycleData:
    """All runs, the first from cold, each later one after `rest_s` [s] of rest.

    On the twin the room temperature varies from run to run by `room_std` [K].
    """
    if isinstance(plant, Fixture):
        return _on_rig(plant, seed, runs, cycles, rest_s)
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


def measure(counts: Array) -> Cycles:
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


LATE = 10  # cycles at the end that count as settled
STEADY = 2.0  # % of their mean, within which they may still change
EARLY = 4  # cycles at the beginning, in which nearly all of the growth of the shares comes


def claims(data: CycleData) -> list[Claim]:
    runs = [measure(c) for c in data.counts]
    mean = Cycles(*(np.mean([run[k] for run in runs], axis=0) for k in range(5)))
    return judge(
        [
            (("A1", "A2", "A3"), lambda: _times(data, mean)),
            ("A4", lambda: _delay(runs)),
            ("A5", lambda: _shares(mean)),
            ("A6", lambda: _total(data, runs, mean)),
        ]
    )


def settled_value(values: Array) -> float:
    return float(values[-LATE:].mean())


class Course(NamedTuple):
    """A time over the cycles."""

    first: float  # in cycle 1 [s]
    late: float  # mean of the last ten cycles [s]
    spread: float  # largest difference between two of these [% of their mean]

    @property
    def steady(self) -> bool:
        return self.spread < STEADY


def course(values: Array) -> Course:
    late = settled_value(values)
    spread = float(np.ptp(values[-LATE:])) / late
    return Course(float(values[0]), late, 100.0 * spread)


def _times(data: CycleData, mean: Cycles) -> list[Claim]:
    per_second, free = measure(data.literal), measure(data.unlimited)
    rise, again, fall = (course(v) for v in (mean.tau1, mean.tau2, mean.fall))
    good = (
        accepts("A1", rise.late) and rise.first > rise.late and rise.steady,
        accepts("A2", again.late) and again.steady,
        accepts("A3", fall.late) and fall.first < fall.late and fall.steady,
    )
    return [
        state(
            "A1",
            rise.late,
            good[0],
            course=rise,
            per_second=float(np.nanmean(per_second.tau1[-LATE:])),
            drift=data.unlimited.max(),
            missed=int(np.isnan(free.tau1).sum()),
            cycles=len(free.tau1),
        ),
        state("A2", again.late, good[1], course=again),
        state(
            "A3",
            fall.late,
            good[2],
            course=fall,
            more=1e3 * (mean.fall[-1] - mean.fall[-LATE]),
            limit=band("A3")[1],
        ),
    ]


def _delay(runs: list[Cycles]) -> Claim:
    least = float(min((run.tau1 - run.tau2).min() for run in runs))
    good = accepts("A4", least)
    return state("A4", least, good, runs=len(runs), cycles=len(runs[0].tau1))


def _shares(mean: Cycles) -> Claim:
    n = np.arange(len(mean.first))
    slopes = [float(np.polyfit(n, v, 1)[0]) for v in (mean.first, mean.last)]
    early = [float(v[:LATE].mean()) for v in (mean.first, mean.last)]
    late = [settled_value(v) for v in (mean.first, mean.last)]
    good = (
        min(slopes) > 0.0
        and all(b > a for a, b in zip(early, late, strict=True))
        and bool(np.all(mean.last > mean.first))
    )
    after = [float(np.polyfit(n[EARLY:], v[EARLY:], 1)[0]) for v in (mean.first, mean.last)]
    top = [int(np.argmax(v)) + 1 for v in (mean.first, mean.last)]
    return state(
        "A5",
        [early[0], late[0], early[1], late[1]],
        good,
        mean=mean,
        early=early,
        late=late,
        slopes=slopes,
        highest=(mean.first.max(), mean.last.max()),
        top=top,
        begin=EARLY + 1,
        after=after,
    )


def _total(data: CycleData, runs: list[Cycles], mean: Cycles) -> Claim:
    total = mean.tau1 + mean.fall
    per_run = np.array([float((run.tau1 + run.fall).mean()) for run in runs])
    trend = run_trend(per_run, data.room)
    grows = float(np.polyfit(np.arange(len(total)), total, 1)[0]) > 0.0
    grows = grows and settled_value(total) > float(total[0])
    found = [float(total[0]), settled_value(total), 1e3 * trend.slope]
    good = grows and abs(trend.slope) <= trend.reach
    values = {"first": found[0], "late": found[1], "slope": found[2], "reach": 1e3 * trend.reach}
    if not np.isfinite(data.room).all():
        return state("A6", found, good, wording="no-room", **values)
    room = (data.room.min(), data.room.max())
    return state("A6", found, good, wording="room", room=room, **values)


NAMES = {"tau1": "rise time tau1", "fall": "fall time"}
LEVELS = ((149.0, BLUE, "s"), (150.0, RED, "o"), (151.0, GREEN, "^"), (152.0, PURPLE, "v"))


def collect(lab: Lab) -> CycleData:
    """Eleven runs of forty cycles, and one each with the other readings of the printed PID."""
    return cycling_runs(lab.cycle(), lab.seed)


def shares(counts: Array) -> tuple[Array, Array]:
    """Mean share [%] of samples at each of `LEVELS` in both windows; shape (levels, cycles)."""
    cycles = counts.reshape(len(counts), -1, round(PERIOD_S / DT))
    each = np.array([[[share(c, level) for c in run] for run in cycles] for level, _, _ in LEVELS])
    mean = each.mean(axis=1)
    return mean[..., 0], mean[..., 1]


def _measure(data: CycleData) -> Cycles:
    return Cycles(*np.stack([measure(c) for c in data.counts], axis=1))


def _light(ax: Axes, values: Array) -> None:
    cycle = np.arange(1, values.shape[1] + 1)
    ax.plot(cycle, values.T, color="0.75", linewidth=0.7)
    ax.lines[0].set_label("each run")
    ax.plot(cycle, values.mean(axis=0), color=BLUE, linewidth=2.2, label="mean")


def _time(number: str, column: str, data: CycleData) -> Drawn:
    values = getattr(_measure(data), column)
    figure, ax = single(3.4)
    _light(ax, values)
    _draw_printed(ax, printed_value(CAPTIONS[number].claims[0]))
    finish(ax, "", "cycle", f"{NAMES[column]} [s]", legend=True)
    return caption(number, figure, runs=len(values), settled=settled_value(values.mean(axis=0)))


def _draw_printed(ax: Axes, value: float) -> None:
    ax.axhline(value, color=ORANGE, linestyle="--", linewidth=1.2, label="thesis")


def rise(data: CycleData) -> Drawn:
    """Figure D.10, and the excess of tau1 over tau2."""
    runs = _measure(data)
    figure, axes = new(3.4, 1, 2)
    rise, delay = axes[0]
    _light(rise, runs.tau2)
    _draw_printed(rise, printed_value("A2"))
    finish(rise, "(a) tau2", "cycle", "tau2 [s]", legend=True)
    _light(delay, 1e3 * (runs.tau1 - runs.tau2))
    delay.set_ylim(bottom=0.0)
    finish(delay, "(b) delay", "cycle", "tau1 - tau2 [ms]")
    return caption(
        "D.10",
        figure,
        settled=settled_value(runs.tau2.mean(axis=0)),
        delay=1e3 * (runs.tau1 - runs.tau2).min(),
    )


def rise_and_fall(data: CycleData) -> Drawn:
    runs, room = _measure(data), data.room
    total = runs.tau1 + runs.fall
    figure, axes = new(3.4, 1, 2, gridspec_kw={"width_ratios": [1.5, 1]})
    by_cycle, by_run = axes[0]
    _light(by_cycle, total)
    finish(by_cycle, "(a) by cycle", "cycle", "total time [s]", legend=True)
    each = total.mean(axis=1)
    trend = run_trend(each, room)
    dots(by_run, np.arange(1, len(each) + 1), each, BLUE, "o")
    known = bool(np.isfinite(room).all())
    if known:
        for k, (value, degc) in enumerate(zip(each, room, strict=True), 1):
            note(by_run, f"{degc:.1f}", (k, value), (0, 6), fontsize=7, ha="center")
    by_run.margins(y=0.15)
    finish(by_run, "(b) mean of each run", "run", "total time [s]")
    by_run.margins(x=0.06)
    by_run.xaxis.get_major_locator().set_params(integer=True)
    about = "; the numbers are the room's temperature [degC], which is allowed for" if known else ""
    return caption("D.12", figure, slope=1e3 * trend.slope, reach=1e3 * trend.reach, about=about)


def _share(number: str, which: int, data: CycleData) -> Drawn:
    both = shares(data.counts)
    figure, ax = single(3.4)
    cycle = np.arange(1, both[which].shape[1] + 1)
    for (level, colour, marker), values in zip(LEVELS, both[which], strict=True):
        ax.plot(
            cycle, values, color=colour, marker=marker, ms=3.5, lw=1.1, label=f"{level:g} counts"
        )
    ax.set_ylim(-2.0, 1.08 * float(np.nanmax(both)))
    finish(ax, "", "cycle", "share of samples [%]", legend=True)
    here = both[which][[level for level, _, _ in LEVELS].index(PEAK)]
    return caption(number, figure, window=WINDOW, first=here[0], settled=settled_value(here))


rise_time = partial(_time, "D.9", "tau1")
fall_time = partial(_time, "D.11", "fall")
first_share = partial(_share, "D.13", 0)
last_share = partial(_share, "D.14", 1)
