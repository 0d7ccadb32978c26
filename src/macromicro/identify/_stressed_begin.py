"""Starting points and bounds of `stressed.fit`, from table and records."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.hysteresis.table import FodTable
from macromicro.identify._free_run_search import SLOPE, Span
from macromicro.identify.records import signal
from macromicro.recording import Recording

MOST_VOLTAGES = 60
TIMES = ("c1", "c2", "c3")  # in s; searched in their logarithms
NAMES = ("c1", "r1", "c2", "r2", "c3", "latent", "shift", "stiffening")
_MOVED = 0.02  # of the table's span: what counts as a move
_LARGE = 0.1  # of the same: a move whose pace is looked at
_FULL = (1.5, 3.0, 6.0)  # final warming by the greatest drive, over what contraction needs
_QUICK = (0.4, 1.5)  # the wires' time constant, over the pace of quick moves
_PLATES, _BODY = 15.0, 120.0  # time constants of plates and body, likewise
_R1, _R2 = 0.7, 0.2
_LATENT, _STIFF = 0.3, 0.05  # of the warming that contraction needs
_POWER = 2.0  # of the drive: heat of a current or a voltage in a resistance
_MOST = 30.0  # times the warming that contraction needs: of every heat


class Means(NamedTuple):
    volts: Array  # points of the heat map: 0, and every level of the drive
    warming: float  # from the room to where the wires contract, K
    span: float  # of the contraction, mm
    pace: float  # time in which the quickest tenth of moves are 63 % done, s
    # shortest, longest: A sample, and a record, s
    shortest: float
    longest: float


def means(table: FodTable, recordings: Sequence[Recording], ambient: float) -> Means:
    """Prior knowledge from table and records; `ambient` in deg C."""
    holds = [hold for r in recordings for hold in _holds(r)]
    span = table.span
    if not any(h.level > 0.0 and np.abs(h.x - h.cold).max() > _MOVED * span for h in holds):
        raise ProblemError(
            "recordings, ctrl",
            f"no level moves the wires by {100 * _MOVED:g} % of {span:g} mm",
            "Record levels that contract them, held for a while.",
        )
    pace = _pace(holds, span)
    levels = sorted({float(v) for r in recordings for v in np.unique(r["ctrl"]) if v > 0.0})
    if len(levels) > MOST_VOLTAGES:
        found = f"there are {len(levels)} different levels above 0"
        remedy = f"Record at most {MOST_VOLTAGES}, held for a while."
        raise ProblemError("recordings, ctrl", found, remedy)
    up, rise, _ = table.major_loop
    middle = 0.5 * (float(rise.min()) + float(rise.max()))
    there = float(np.interp(middle, rise, up))
    if not there > ambient:
        accepted = f"less than {there:g} deg C, where the table is half contracted"
        raise InputError("ambient", ambient, accepted)
    longest = max(len(r["t"]) * r.dt for r in recordings)
    shortest = min(r.dt for r in recordings)
    return Means(np.array([0.0, *levels]), there - ambient, span, pace, shortest, longest)


def span(m: Means) -> Span:
    """Bounds and steps of the search values (NAMES with logarithms of times, then heats)."""
    # A temperature step spans the kinks of the table's cells.
    soon, late = np.log(0.2 * m.shortest), np.log(100.0 * m.longest)
    many, most, stiff = len(m.volts) - 1, _MOST * m.warming, m.warming / m.span
    away = m.warming  # a shift by more, and they were contracted in the room
    low = [soon, 0.02, soon, 0.005, soon, 0.0, -away, 0.0, *[0.0] * many]
    high = [late, 0.98, late, 0.9, late, 5.0 * m.warming, away, 4.0 * stiff, *[most] * many]
    nudge = [1.0, 1.0, 1.0, 1.0, 1.0, m.warming, m.warming, stiff, *[m.warming] * many]
    return Span(np.array(low), np.array(high), SLOPE * np.array(nudge))


def begins(m: Means) -> list[Array]:
    found = []
    share = m.volts[1:] / m.volts[-1]
    for full, quick in product(_FULL, _QUICK):
        wire = quick * m.pace
        times = np.log([wire / _R1, _PLATES * m.pace / _R2, _BODY * m.pace / (1.0 - _R1 - _R2)])
        stiff = _STIFF * m.warming / m.span
        values = [times[0], _R1, times[1], _R2, times[2], _LATENT * m.warming, 0.0, stiff]
        found.append(np.concatenate([values, full * m.warming * share**_POWER]))
    return found


class _Hold(NamedTuple):
    """A level of the drive; sample time [s], positions [mm], start of the record [mm]."""

    level: float
    dt: float
    x: Array
    cold: float


def _holds(r: Recording) -> list[_Hold]:
    sent, x = signal(r["ctrl"], "ctrl"), 1e-3 * signal(r["laser"], "laser")
    edges = [0, *(np.flatnonzero(np.diff(sent)) + 1), len(sent)]
    return [_Hold(float(sent[a]), r.dt, x[a:b], float(x[0])) for a, b in pairwise(edges)]


def _pace(holds: Sequence[_Hold], span: float) -> float:
    """Time to 63 % of the travel, of the quickest tenth of all moves."""
    times = []
    for h in holds:
        way = h.x - h.x[0]
        if abs(way[-1]) > _LARGE * span:
            times.append(h.dt * (1 + int(np.argmax(np.abs(way) >= 0.63 * abs(way[-1])))))
    if not times:
        times = [h.dt * len(h.x) for h in holds]
    return float(np.quantile(times, 0.1))
