"""A time column: rate, gaps, repeated and falling times."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.identify.runs import GAP


class Timing(NamedTuple):
    rows: int
    duration: float  # from first to last, of all runs together, s
    rate: float  # rows a second by the usual step, Hz; 0 where times do not increase
    uneven: float  # largest relative deviation of steps without gaps
    # gaps, twice, falls: steps that are gaps, times that are repeated, times that fall
    gaps: int
    twice: int
    falls: int
    # first_gap, first_twice, first_fall: row of the first one, from 1; 0 where there is none
    first_gap: int
    first_twice: int
    first_fall: int
    longest: float  # the longest gap, s
    runs: int = 1  # records in the file, each with times of its own


def timing(t: Array, run: Array | None = None) -> Timing:
    steps = np.diff(t)
    apart = np.zeros(len(steps), dtype=np.bool_) if run is None else np.diff(run) != 0.0
    steps[apart] = np.nan
    rising = steps[steps > 0.0]
    usual = float(np.median(rising)) if len(rising) else 0.0
    gaps = np.flatnonzero(steps > GAP * usual) if usual else np.empty(0, dtype=np.int64)
    twice, falls = np.flatnonzero(steps == 0.0), np.flatnonzero(steps < 0.0)
    near = rising[rising <= GAP * usual]
    uneven = float(np.abs(near - usual).max()) / usual if len(near) else 0.0

    def row(places: object) -> int:
        found = np.asarray(places)
        return int(found[0]) + 2 if len(found) else 0

    return Timing(
        rows=len(t),
        duration=float(np.nansum(steps)),
        rate=1.0 / usual if usual else 0.0,
        uneven=uneven,
        gaps=len(gaps),
        twice=len(twice),
        falls=len(falls),
        first_gap=row(gaps),
        first_twice=row(twice),
        first_fall=row(falls),
        longest=float(steps[gaps].max()) if len(gaps) else 0.0,
        runs=int(apart.sum()) + 1,
    )


def words(seen: Timing) -> list[str]:
    if not seen.rate:
        return [f"{seen.rows} rows; times do not increase"]
    said = [f"{seen.rows} rows over {seen.duration:.6g} s, {seen.rate:.6g} Hz"]
    if seen.runs > 1:
        said.append(f"{seen.runs} runs")
    if seen.uneven > 0.02:
        said.append(f"steps differ from the usual one by up to {100.0 * seen.uneven:.0f} %")
    if seen.gaps:
        said.append(
            f"{seen.gaps} gaps, the first before row {seen.first_gap}, the longest of "
            f"{seen.longest:.4g} s"
        )
    if seen.twice:
        said.append(f"{seen.twice} times repeated, the first in row {seen.first_twice}")
    if seen.falls:
        said.append(f"{seen.falls} times fall, the first in row {seen.first_fall}")
    return said
