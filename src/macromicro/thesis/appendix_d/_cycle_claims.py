"""Claims A1 to A6 from the cycle testing of Appendix D."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.thesis.appendix_d import cycle_runs
from macromicro.thesis.appendix_d.cycle_runs import CycleData, Cycles
from macromicro.thesis.claims import Claim, accepts, band, holds, judged, stated

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
            holds(good[0]),
            course=rise,
            per_second=float(np.nanmean(per_second.tau1[-LATE:])),
            drift=data.unlimited.max(),
            missed=int(np.isnan(free.tau1).sum()),
            cycles=len(free.tau1),
        ),
        stated("A2", again.late, holds(good[1]), course=again),
        stated(
            "A3",
            fall.late,
            holds(good[2]),
            course=fall,
            more=1e3 * (mean.fall[-1] - mean.fall[-LATE]),
            limit=band("A3")[1],
        ),
    ]


def _delay(runs: list[Cycles]) -> Claim:
    least = float(min((run.tau1 - run.tau2).min() for run in runs))
    good = accepts("A4", least)
    return stated("A4", least, holds(good), runs=len(runs), cycles=len(runs[0].tau1))


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
        holds(good),
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
    verdict = holds(grows and abs(trend.slope) <= trend.reach)
    values = {
        "first": found[0],
        "late": found[1],
        "slope": found[2],
        "reach": 1e3 * trend.reach,
    }
    if not np.isfinite(data.room).all():
        return stated("A6", found, verdict, "no-room", **values)
    room = (data.room.min(), data.room.max())
    return stated("A6", found, verdict, "room", room=room, **values)
