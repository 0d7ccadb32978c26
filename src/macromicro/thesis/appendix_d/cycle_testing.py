"""Cycle testing of the actuator alone (Appendix D): Figures D.9 to D.14, claims A1 to A6."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.drawing.exhibit import Drawn
from macromicro.drawing.style import BLUE, GREEN, ORANGE, PURPLE, RED, finish, new
from macromicro.thesis.appendix_d import cycle_runs
from macromicro.thesis.appendix_d.cycle_runs import PEAK, PERIOD_S, CycleData, Cycles
from macromicro.thesis.captions import CAPTIONS, captioned
from macromicro.thesis.claims import Claim, accepts, band, judged, printed, stated
from macromicro.thesis.contents import procedure
from macromicro.thesis.procedure import Lab

if TYPE_CHECKING:
    from matplotlib.axes import Axes


LATE = 10  # cycles at the end that count as settled
STEADY = 2.0  # % of their mean, within which they may still change
EARLY = 4  # cycles at the beginning, in which nearly all of the growth of the shares comes


def claims(data: CycleData | None = None) -> list[Claim]:
    seen = data or cycle_runs.collect()
    runs = [cycle_runs.measured(c) for c in seen.counts]
    mean = Cycles(*(np.mean([run[k] for run in runs], axis=0) for k in range(5)))
    return judged(
        [
            (("A1", "A2", "A3"), lambda: _times(seen, mean)),
            ("A4", lambda: _delay(runs)),
            ("A5", lambda: _shares(mean)),
            ("A6", lambda: _total(seen, runs, mean)),
        ]
    )


def settled(values: Array) -> float:
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
    late = settled(values)
    spread = float(np.ptp(values[-LATE:])) / late
    return Course(float(values[0]), late, 100.0 * spread)


def _times(data: CycleData, mean: Cycles) -> list[Claim]:
    per_second, free = cycle_runs.measured(data.literal), cycle_runs.measured(data.unlimited)
    rise, again, fall = (course(v) for v in (mean.tau1, mean.tau2, mean.fall))
    good = (
        accepts("A1", rise.late) and rise.first > rise.late and rise.steady,
        accepts("A2", again.late) and again.steady,
        accepts("A3", fall.late) and fall.first < fall.late and fall.steady,
    )
    return [
        stated(
            "A1",
            rise.late,
            good[0],
            course=rise,
            per_second=float(np.nanmean(per_second.tau1[-LATE:])),
            drift=data.unlimited.max(),
            missed=int(np.isnan(free.tau1).sum()),
            cycles=len(free.tau1),
        ),
        stated("A2", again.late, good[1], course=again),
        stated(
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
    return stated("A4", least, good, runs=len(runs), cycles=len(runs[0].tau1))


def _shares(mean: Cycles) -> Claim:
    n = np.arange(len(mean.first))
    slopes = [float(np.polyfit(n, v, 1)[0]) for v in (mean.first, mean.last)]
    early = [float(v[:LATE].mean()) for v in (mean.first, mean.last)]
    late = [settled(v) for v in (mean.first, mean.last)]
    good = (
        min(slopes) > 0.0
        and all(b > a for a, b in zip(early, late, strict=True))
        and bool(np.all(mean.last > mean.first))
    )
    after = [float(np.polyfit(n[EARLY:], v[EARLY:], 1)[0]) for v in (mean.first, mean.last)]
    top = [int(np.argmax(v)) + 1 for v in (mean.first, mean.last)]
    return stated(
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
    trend = cycle_runs.run_trend(per_run, data.room)
    grows = float(np.polyfit(np.arange(len(total)), total, 1)[0]) > 0.0
    grows = grows and settled(total) > float(total[0])
    found = [float(total[0]), settled(total), 1e3 * trend.slope]
    good = grows and abs(trend.slope) <= trend.reach
    values = {"first": found[0], "late": found[1], "slope": found[2], "reach": 1e3 * trend.reach}
    if not np.isfinite(data.room).all():
        return stated("A6", found, good, "no-room", **values)
    room = (data.room.min(), data.room.max())
    return stated("A6", found, good, "room", room=room, **values)


NAMES = {"tau1": "rise time tau1", "fall": "fall time"}
LEVELS = ((149.0, BLUE, "s"), (150.0, RED, "o"), (151.0, GREEN, "^"), (152.0, PURPLE, "v"))


def collect(lab: Lab) -> CycleData:
    """Eleven runs of forty cycles, and one each with the other readings of the printed PID."""
    return cycle_runs.collect(lab.cycle(), lab.seed)


def shares(counts: Array) -> tuple[Array, Array]:
    """Mean share [%] of samples at each of `LEVELS` in both windows; shape (levels, cycles)."""
    cycles = counts.reshape(len(counts), -1, round(PERIOD_S / cycle_runs.DT))
    each = np.array(
        [[[cycle_runs.share(c, level) for c in run] for run in cycles] for level, _, _ in LEVELS]
    )
    mean = each.mean(axis=1)
    return mean[..., 0], mean[..., 1]


def _measured(data: CycleData) -> Cycles:
    return Cycles(*np.stack([cycle_runs.measured(c) for c in data.counts], axis=1))


def _light(ax: Axes, values: Array) -> None:
    cycle = np.arange(1, values.shape[1] + 1)
    ax.plot(cycle, values.T, color="0.75", linewidth=0.7)
    ax.lines[0].set_label("each run")
    ax.plot(cycle, values.mean(axis=0), color=BLUE, linewidth=2.2, label="mean")


def _time(number: str, column: str, data: CycleData) -> Drawn:
    values = getattr(_measured(data), column)
    figure, axes = new(3.4, 1)
    ax = axes[0, 0]
    _light(ax, values)
    _printed(ax, printed(CAPTIONS[number].claims[0]))
    finish(ax, "", "cycle", f"{NAMES[column]} [s]", legend=True)
    return captioned(number, figure, runs=len(values), settled=settled(values.mean(axis=0)))


def _printed(ax: Axes, value: float) -> None:
    ax.axhline(value, color=ORANGE, linestyle="--", linewidth=1.2, label="thesis")


def _rise(data: CycleData) -> Drawn:
    """Figure D.10, and the excess of tau1 over tau2."""
    runs = _measured(data)
    figure, axes = new(3.4, 1, 2)
    rise, delay = axes[0]
    _light(rise, runs.tau2)
    _printed(rise, printed("A2"))
    finish(rise, "(a) tau2", "cycle", "tau2 [s]", legend=True)
    _light(delay, 1e3 * (runs.tau1 - runs.tau2))
    delay.set_ylim(bottom=0.0)
    finish(delay, "(b) delay", "cycle", "tau1 - tau2 [ms]")
    return captioned(
        "D.10",
        figure,
        settled=settled(runs.tau2.mean(axis=0)),
        delay=1e3 * (runs.tau1 - runs.tau2).min(),
    )


def _rise_and_fall(data: CycleData) -> Drawn:
    runs, room = _measured(data), data.room
    total = runs.tau1 + runs.fall
    figure, axes = new(3.4, 1, 2, gridspec_kw={"width_ratios": [1.5, 1]})
    by_cycle, by_run = axes[0]
    _light(by_cycle, total)
    finish(by_cycle, "(a) by cycle", "cycle", "total time [s]", legend=True)
    each = total.mean(axis=1)
    trend = cycle_runs.run_trend(each, room)
    by_run.plot(np.arange(1, len(each) + 1), each, color=BLUE, marker="o", ms=5, linestyle="")
    known = bool(np.isfinite(room).all())
    if known:
        for k, (value, degc) in enumerate(zip(each, room, strict=True), 1):
            by_run.annotate(
                f"{degc:.1f}",
                (k, value),
                (0, 6),
                textcoords="offset points",
                fontsize=7,
                horizontalalignment="center",
            )
    by_run.margins(y=0.15)
    finish(by_run, "(b) mean of each run", "run", "total time [s]")
    by_run.margins(x=0.06)
    by_run.xaxis.get_major_locator().set_params(integer=True)
    about = "; the numbers are the room's temperature [degC], which is allowed for" if known else ""
    return captioned("D.12", figure, slope=1e3 * trend.slope, reach=1e3 * trend.reach, about=about)


def _share(number: str, which: int, data: CycleData) -> Drawn:
    both = shares(data.counts)
    figure, axes = new(3.4, 1)
    ax = axes[0, 0]
    cycle = np.arange(1, both[which].shape[1] + 1)
    for (level, colour, marker), values in zip(LEVELS, both[which], strict=True):
        ax.plot(
            cycle, values, color=colour, marker=marker, ms=3.5, lw=1.1, label=f"{level:g} counts"
        )
    ax.set_ylim(-2.0, 1.08 * float(np.nanmax(both)))
    finish(ax, "", "cycle", "share of samples [%]", legend=True)
    here = both[which][[level for level, _, _ in LEVELS].index(PEAK)]
    return captioned(number, figure, window=cycle_runs.WINDOW, first=here[0], settled=settled(here))


PROCEDURE = procedure(
    "cycle-testing",
    {
        "D.9": partial(_time, "D.9", "tau1"),
        "D.10": _rise,
        "D.11": partial(_time, "D.11", "fall"),
        "D.12": _rise_and_fall,
        "D.13": partial(_share, "D.13", 0),
        "D.14": partial(_share, "D.14", 1),
    },
    collect,
    claims,
)
