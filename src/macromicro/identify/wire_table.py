"""Fit of shape-memory wires by a kiln's table, whose temperatures were measured."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise, product
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.control.inverse import model
from macromicro.control.inverse.model import Inverse
from macromicro.errors import InputError, ProblemError
from macromicro.hysteresis.table import FodTable
from macromicro.identify import clusters, search
from macromicro.identify.heating import AMBIENT
from macromicro.identify.notices import ConvergenceWarning, DataWarning, notice
from macromicro.identify.records import signal
from macromicro.identify.search import best, minimum
from macromicro.identify.wire import (
    BLOCKS,
    ROUNDS,
    Index,
    Parameter,
    WireFit,
    bounds_of,
    by_parameter,
    errors,
    search_values,
)
from macromicro.identify.wire_model import Wire, hysteresis
from macromicro.models import stressed
from macromicro.models.heating import Ladder
from macromicro.models.stressed import Stressed
from macromicro.recording import Recording

MOST_VOLTAGES = 60
_TABLE_ERROR = 0.01  # mm: of the kiln's encoder and the table, not the laser
_LEAST_R3 = 0.002
_COMPARED = 150  # points of a record
# Searches on a grid so much coarser choose where the last one begins: rounds of every begin, how
# many go on, their rounds.
_COARSE = 8.0
_FEW, _BEST, _MORE = 4, 2, 8
_SETTLED = 1e-7
# Of 2 ms steps for two seconds where moves take half a second, and in proportion.
_USUAL = 0.5
_MOVED = 0.02  # of the table's span: what counts as a move
_LARGE = 0.1  # of the same: a move whose pace is looked at
_FULL = (1.5, 3.0, 6.0)  # final warming by the greatest drive, over what contraction needs
_QUICK = (0.4, 1.5)  # the wires' time constant, over the pace of quick moves
_PLATES, _BODY = 15.0, 120.0  # time constants of plates and body, likewise
_R1, _R2 = 0.7, 0.2
_LATENT, _STIFF = 0.3, 0.05  # of the warming that contraction needs
_POWER = 2.0  # of the drive: heat of a current or a voltage in a resistance
_MOST = 30.0  # times the warming that contraction needs: of every heat

# The driver's and the sensor's lag.
_EARLY = 15  # periods before and after a change of CTRL, at first
_BEYOND = 10.0 / 3.0  # times that: a lag is searched so far
_SHORT = 0.1  # of the shortest hold of CTRL: records with longer periods tell no lag
_DEGREE = 9


class Means(NamedTuple):
    volts: Array  # points of the heat map: 0, and every level of the drive
    warming: float  # from the room to where the wires contract, K
    span: float  # of the contraction, mm
    pace: float  # time in which the quickest tenth of moves are 63 % done, s
    shortest: float  # sample, s
    longest: float  # record, s


def means(table: FodTable, recordings: Sequence[Recording], ambient: float) -> Means:
    """Prior knowledge from table and records; `ambient` in deg C."""
    holds = [hold for r in recordings for hold in _holds(r)]
    span = table.span
    if not any(h.level > 0.0 and np.abs(h.x - h.cold).max() > _MOVED * span for h in holds):
        problem = f"no level moves the wires by {100 * _MOVED:g} % of {span:g} mm"
        remedy = "Record levels that contract them, held for a while."
        raise ProblemError("recordings, ctrl", problem, remedy)
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


def parameters_of(m: Means) -> list[Parameter]:
    # A temperature step spans the kinks of the table's cells.
    soon, late, away = 0.2 * m.shortest, 100.0 * m.longest, m.warming
    stiff = m.warming / m.span
    return [
        Parameter("c1", 1.0, soon, late, True, 1.0),
        Parameter("r1", _R1, 0.02, 0.98, nudge=1.0),
        Parameter("c2", 1.0, soon, late, True, 1.0),
        Parameter("r2", _R2, 0.005, 0.9, nudge=1.0),
        Parameter("c3", 1.0, soon, late, True, 1.0),
        Parameter("latent", _LATENT * m.warming, 0.0, 5.0 * m.warming, nudge=m.warming),
        # By more, and they were contracted in the room.
        Parameter("shift", 0.0, -away, away, nudge=m.warming),
        Parameter("stiffening", _STIFF * stiff, 0.0, 4.0 * stiff, nudge=stiff),
        *(Parameter(f"heat {v:g} V", 0.0, 0.0, _MOST * away, nudge=away) for v in m.volts[1:]),
    ]


def _starts(m: Means, parameters: Sequence[Parameter]) -> list[Array]:
    found = []
    share = m.volts[1:] / m.volts[-1]
    for full, quick in product(_FULL, _QUICK):
        heats = full * m.warming * share**_POWER
        values = dict(zip([p.name for p in parameters[-len(heats) :]], heats.tolist(), strict=True))
        values["c1"] = quick * m.pace / _R1
        values["c2"] = _PLATES * m.pace / _R2
        values["c3"] = _BODY * m.pace / (1.0 - _R1 - _R2)
        found.append(search_values(parameters, values))
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


class _Run(NamedTuple):
    """A recording on the model's time grid: ctrl [V], share of cut time, dt [s], positions [mm]."""

    ctrl: Array
    cut: Array
    dt: Array
    at: Index
    x: Array


def grid_recording(recording: Recording, scale: float = 1.0) -> _Run:
    """Time grid for a recording and the positions to compare."""
    # 2 ms for two seconds after each change, 10 ms up to ten seconds, then 50 ms, all times `scale`
    # for slower wires. Comparisons are even on this grid, so fast parts count most.
    t, sent = signal(recording["t"], "t"), signal(recording["ctrl"], "ctrl")
    x = signal(recording["laser"], "laser") * 1e-3
    edges = [0, *(np.flatnonzero(np.diff(sent)) + 1), len(t) - 1]
    places = []
    for a, b in pairwise(edges):
        for begin, end, step in ((0.0, 2.0, 0.002), (2.0, 10.0, 0.01), (10.0, np.inf, 0.05)):
            first = a + round(scale * begin / recording.dt)
            last = b if np.isinf(end) else min(b, a + round(scale * end / recording.dt))
            apart = max(round(scale * step / recording.dt), 1)
            places.append(np.arange(first, last, apart, dtype=np.int64))
    grid = np.concatenate(places)
    ends = np.append(grid[1:], len(t) - 1)
    contract = recording["contract"] if "contract" in recording else np.zeros(len(t))
    total = np.r_[0.0, np.cumsum(signal(contract, "contract"))]
    cut = (total[ends] - total[grid]) / (ends - grid)
    at = np.unique(np.linspace(1, len(grid) - 1, _COMPARED).astype(np.int64))
    return _Run(sent[grid], cut, t[ends] - t[grid], at, x[grid[at]])


def switching_positions(recordings: Sequence[Recording], end: float) -> tuple[float, float]:
    """Positions [mm] at which CONTRACT closed and opened, limited to the table's range."""
    on, off = [], []
    for r in recordings:
        if "contract" not in r:
            continue
        change = np.diff(signal(r["contract"], "contract"))
        place = signal(r["laser"], "laser") * 1e-3
        on += list(place[1:][change > 0])
        off += list(place[1:][change < 0])
    if not on:
        return np.inf, np.inf
    close = float(np.median(on))
    gap = close - float(np.median(off)) if off else 0.01
    close = min(close, end - 0.002)
    return close, close - max(gap, 0.002)


def with_table(
    table: FodTable,
    recordings: Sequence[Recording],
    ambient: float = AMBIENT,
    lag: float = 0.0,
    near: WireFit | None = None,
) -> WireFit:
    """The wires from open-loop recordings and the kiln's table; `ambient` in deg C."""
    # The heat map has a point at each held voltage. The resistances sum to 1, since heat is counted
    # in K. A recorded `contract` is followed, since its timing to the millisecond cannot be
    # predicted. Searches begin at several warmings and paces.
    if len(recordings) < 2:
        raise InputError("recordings", len(recordings), "2 open-loop recordings or more")
    m = means(table, recordings, ambient)
    step = 2.0 ** round(math.log2(m.pace / _USUAL))
    cut_on, cut_off = switching_positions(recordings, table.f_low + table.span)
    known = {
        **{"volts": m.volts, "lag": lag, "cut_on": cut_on, "cut_off": cut_off},
        **{"ambient": ambient, "hysteresis": hysteresis(table)},
    }
    parameters = parameters_of(m)
    bounds = bounds_of(parameters)

    def missed(runs: Sequence[_Run]) -> search.Missed:
        def residual(z: Array) -> Array:
            p = wires_of(known, by_parameter(parameters, z))
            made = [stressed.simulate(p, r.ctrl, r.dt, r.cut)[0][r.at] for r in runs]
            left = [(own - r.x) / _TABLE_ERROR for own, r in zip(made, runs, strict=True)]
            return np.concatenate(left)

        return residual

    fine = missed([grid_recording(r, step) for r in recordings])
    if near is None:
        rough = missed([grid_recording(r, _COARSE * step) for r in recordings])
        begins = best(rough, _starts(m, parameters), bounds, _FEW, _BEST)
        (begin,) = best(rough, begins, bounds, _MORE, 1)
    else:
        begin = search_values(parameters, near.values)
    end = minimum(fine, begin, bounds, ROUNDS, _SETTLED)
    if end.status <= 0:
        notice(ConvergenceWarning, "actuator: search stopped before it settled")
    values = by_parameter(parameters, end.x)
    edges = clusters.blocks(len(end.fun), max(BLOCKS, 2 * len(values)))
    # Heats are at a bound by parts of the warming.
    within = bounds.high - bounds.low
    within[len(within) - len(m.volts) + 1 :] = m.warming
    std = errors(parameters, end, lambda z: by_parameter(parameters, z), edges, within)
    found = wires_of(known, values)
    if late := too_slow(found.ladder, m.longest):
        notice(
            DataWarning,
            f"actuator: {late} longer than the longest record ({m.longest:.3g} s): "
            "the slowest node is a guess, as is the scale of heats and resistances, and "
            "their standard errors mean little. Hold a level for longer",
        )
    rms = float(np.sqrt(np.mean(end.fun**2))) * _TABLE_ERROR
    return WireFit(Wire(found), table, values, std, rms, int(end.nfev))


def wires_of(known: Mapping[str, Any], values: Mapping[str, float]) -> Stressed:
    """The wires with the fitted values: the heats last."""
    c1, r1, c2, r2, c3, latent, shift, stiffening, *heats = values.values()
    ladder = Ladder(c1, r1, c2, r2, c3, max(1.0 - r1 - r2, _LEAST_R3))
    own: dict[str, Any] = {"latent": latent, "shift": shift, "stiffening": stiffening}
    return Stressed(heat=np.array([0.0, *heats]), ladder=ladder, **known, **own)


def too_slow(ladder: Ladder, longest: float) -> str:
    """Time constants that the records are too short for, in words."""
    times = {"c2 r2": ladder.c2 * ladder.r2, "c3 r3": ladder.c3 * ladder.r3}
    late = [f"{name} ({value:.3g} s)" for name, value in times.items() if value > longest]
    return f"{' and '.join(late)} {'is' if len(late) == 1 else 'are'}" if late else ""


class LawFit(NamedTuple):
    fit: WireFit  # driver, heat, relays
    sensor: float  # lag of the position's sensor, s; NaN where no record has one
    gains: Inverse  # of the law `inverse`, with the default speed


def for_law(table: FodTable, records: Sequence[Recording], ambient: float = AMBIENT) -> LawFit:
    """The model of the law `inverse`, from open-loop heatings and the kiln's table."""
    # The driver's lag is found from the change of speed just after a change of CTRL, where the
    # table's error cancels.
    held = shortest(records)
    quick = [r for r in records if r.dt <= _SHORT * held * (1.0 + 1e-9)]
    if not quick:
        slowest = min(r.dt for r in records) if records else math.nan
        most = f"Record some at {_SHORT * held:g} s or less, a tenth of the shortest hold of CTRL."
        raise ProblemError("records", f"the shortest period is {slowest:g} s", most)
    first = with_table(table, records, ambient)
    driver = driver_lag(first.model.wires, quick)
    fit = with_table(table, records, ambient, driver, first)
    with_sensor = [r for r in quick if "hall_voltage" in r]
    lag = sensor_lag(with_sensor) if with_sensor else math.nan
    sensor = lag if math.isfinite(lag) else 0.0
    return LawFit(fit, lag, model.gains(fit.model.wires, sensor, fit.rms))


def shortest(records: Sequence[Recording]) -> float:
    edges = [(np.flatnonzero(np.diff(signal(r["ctrl"], "ctrl"))), r.dt) for r in records]
    return min((float(np.diff(at).min()) * dt for at, dt in edges if len(at) > 1), default=math.inf)


def driver_lag(model: Stressed, records: Sequence[Recording]) -> float:
    """Lag of the heat behind CTRL, beyond the D/A's period."""
    # Searched in a short time after each change; for a longer lag in twice that time, up to the
    # shortest hold of CTRL.
    early, held = _EARLY * min(r.dt for r in records), shortest(records)
    while True:
        lag = _seen_within(model, records, early)
        if lag <= early or 2.0 * early > held:
            return lag
        early *= 2.0


def _seen_within(model: Stressed, records: Sequence[Recording], early: float) -> float:
    """`driver_lag` from so many seconds after each change."""
    runs = [_changes(r, early) for r in records]
    if not any(len(run.at) for run in runs):
        remedy = "Record steps from one level to another."
        raise ProblemError("records, ctrl", "CTRL never changes", remedy)

    def left(lag: float) -> float:
        total, count = 0.0, 0
        for r, run in zip(records, runs, strict=True):
            made = stressed.simulate(model._replace(lag=lag), run.ctrl, r.dt, run.cut)[0]
            off = run.x - made
            before = run.since - round(early / r.dt)
            slope = (off[run.since] - off[before]) / (run.since - before)
            soon = off[run.at] - off[run.since] - slope * (run.at - run.since)
            total, count = total + float(soon @ soon), count + len(soon)
        return total / count

    return _least(left, _BEYOND * early)


def _least(cost: Callable[[float], float], most: float) -> float:
    from scipy.optimize import minimize_scalar

    how = {"xatol": 2e-4 * most}
    return float(minimize_scalar(cost, bounds=(0.0, most), method="bounded", options=how).x)


class _Changes(NamedTuple):
    """CTRL [V], share of cut time, positions [mm], and samples after a change."""

    ctrl: Array
    cut: Array
    x: Array
    at: Index
    since: Index


def _changes(r: Recording, early: float) -> _Changes:
    sent, x = signal(r["ctrl"], "ctrl"), 1e-3 * signal(r["laser"], "laser")
    acts = np.r_[0.0, sent[:-1]]
    cut = signal(r["contract"], "contract") if "contract" in r else np.full(len(sent), np.nan)
    span = round(early / r.dt)
    edges = np.flatnonzero(np.diff(acts)) + 1
    edges = edges[edges >= span]
    soon = (edges[:, None] + np.arange(span)[None, :]).ravel()
    since, there = np.repeat(edges, span), soon < len(x)
    return _Changes(acts, cut, x, soon[there], since[there])


def sensor_lag(records: Sequence[Recording]) -> float:
    """Lag of a sensor's voltage behind the laser: the one with the smoothest relation."""
    places = [signal(r["laser"], "laser") for r in records]
    volts = np.concatenate([signal(r["hall_voltage"], "hall_voltage") for r in records])
    low, high = min(p.min() for p in places), max(p.max() for p in places)
    # Standing still tells nothing: weights by how far the stage moved since.
    moved = np.concatenate([np.abs(np.gradient(p)) for p in places])

    def left(lag: float) -> float:
        seen = [_lag_behind(p, lag, r.dt) for p, r in zip(places, records, strict=True)]
        x = 2.0 * (np.concatenate(seen) - low) / (high - low) - 1.0
        basis = np.polynomial.chebyshev.chebvander(x, _DEGREE)
        weight = np.sqrt(moved)[:, None]
        found, *_ = np.linalg.lstsq(basis * weight, volts * weight[:, 0], rcond=None)
        return float(np.mean(moved * (volts - basis @ found) ** 2))

    dt = min(r.dt for r in records)
    most = _BEYOND * _EARLY * dt
    while (found := _least(left, most)) > most / 2.0 and most < dt * min(map(len, places)):
        most *= 2.0
    return found


def _lag_behind(x: Array, lag: float, dt: float) -> Array:
    """A first-order lag of a signal that is linear between samples."""
    from scipy.signal import lfilter, lfilter_zi

    if lag < 1e-6:
        return x
    a = math.exp(-dt / lag)
    # Exact for straight pieces (first-order hold).
    one = lag / dt * (1.0 - a)
    b = np.array([1.0 - one, one - a])
    state = lfilter_zi(b, [1.0, -a]) * x[0]
    return np.asarray(lfilter(b, [1.0, -a], x, zi=state)[0])
