"""Claims A1 to A6 from the cycle testing of Appendix D."""

from __future__ import annotations

import numpy as np

from macromicro.arrays import Array
from macromicro.thesis.appendix_d import cycle_runs
from macromicro.thesis.appendix_d.cycle_runs import CycleData, Cycles
from macromicro.thesis.claims import MET, Claim, accepts, band, holds, judged, stated

LATE = 10  # cycles at the end that count as settled
STEADY = 0.02  # of their mean, within which they may still change
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


def unrest(values: Array) -> float:
    """Largest difference between two of the last ten cycles, as a share of their mean."""
    return float(np.ptp(values[-LATE:])) / settled(values)


def _course(values: Array) -> str:
    return f"{values[0]:.3f} s in cycle 1, {settled(values):.3f} s over the last ten"


def _steady(values: Array) -> str:
    return f"{_course(values)}, which lie within {100.0 * unrest(values):.1f} % of each other"


def _times(data: CycleData, mean: Cycles) -> list[Claim]:
    per_second, free = cycle_runs.measured(data.literal), cycle_runs.measured(data.unlimited)
    missed = int(np.isnan(free.tau1).sum())
    reading = (
        "The printed gains leave two things open. Kd as a derivative per second gives tau1 "
        f"{float(np.nanmean(per_second.tau1[-LATE:])):.3f} s. An integral without limit drifts: "
        f"{data.unlimited.max():.0f} counts in cycle 1, and then 149 are missed in {missed} of "
        f"{len(free.tau1)} cycles. In use: Kd per sample, integration only within 0-5 V"
    )
    spring = "the fixture's preload and outer resistances were chosen with these times in view"
    t1, t2, fall = (settled(v) for v in (mean.tau1, mean.tau2, mean.fall))
    calm = [unrest(v) < STEADY for v in (mean.tau1, mean.tau2, mean.fall)]
    good = (
        accepts("A1", t1) and mean.tau1[0] > t1 and calm[0],
        accepts("A2", t2) and calm[1],
        accepts("A3", fall) and mean.fall[0] < fall and calm[2],
    )
    return [
        stated("A1", t1, holds(good[0]), f"{_steady(mean.tau1)}; {spring}. {reading}"),
        stated("A2", t2, holds(good[1]), f"{_steady(mean.tau2)}; {spring}"),
        stated(
            "A3",
            fall,
            holds(good[2]),
            f"{_steady(mean.fall)}: still {1e3 * (mean.fall[-1] - mean.fall[-LATE]):.0f} ms more "
            f"from the first of those to the last; up to {band('A3')[1]:g} s count as 1.2 s; "
            f"{spring}",
        ),
    ]


def _delay(runs: list[Cycles]) -> Claim:
    least = float(min((run.tau1 - run.tau2).min() for run in runs))
    return stated(
        "A4",
        least,
        holds(accepts("A4", least)),
        f"least of {len(runs)} runs of {len(runs[0].tau1)} cycles; {MET}",
    )


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
        f"first 1000 samples: {mean.first[0]:.0f} % in cycle 1, mean of the first ten "
        f"{early[0]:.0f} %, of the last ten {late[0]:.0f} %; last 1000: {mean.last[0]:.0f}, "
        f"{early[1]:.0f}, {late[1]:.0f} %; lines through all cycles rise by {slopes[0]:.2f} and "
        f"{slopes[1]:.2f} % a cycle. The growth is that of the first cycles, which pull the lines "
        f"up: the highest shares are {mean.first.max():.0f} % (cycle {top[0]}) and "
        f"{mean.last.max():.0f} % (cycle {top[1]}), and lines through the cycles from "
        f"{EARLY + 1} on change by {after[0]:+.2f} and {after[1]:+.2f} % a cycle",
    )


def _room(room: Array) -> str:
    if not np.isfinite(room).all():
        return "whatever the room was, which nothing measured"
    return f"the room ({room.min():.1f} to {room.max():.1f} degC; the twin draws it) allowed for"


def _total(data: CycleData, runs: list[Cycles], mean: Cycles) -> Claim:
    total = mean.tau1 + mean.fall
    per_run = np.array([float((run.tau1 + run.fall).mean()) for run in runs])
    trend = cycle_runs.run_trend(per_run, data.room)
    grows = float(np.polyfit(np.arange(len(total)), total, 1)[0]) > 0.0
    grows = grows and settled(total) > float(total[0])
    return stated(
        "A6",
        [float(total[0]), settled(total), 1e3 * trend.slope],
        holds(grows and abs(trend.slope) <= trend.reach),
        f"{_course(total)}; from run to run {1e3 * trend.slope:.2f} +- {1e3 * trend.reach:.2f} ms "
        f"(95 %), {_room(data.room)}. Half an hour is some twenty of the slowest time constants: "
        "nothing is left to tell one run from the next, and the bench has no ageing",
    )
