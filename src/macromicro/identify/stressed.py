"""Fit of the improved actuator model (`models.stressed`) to open-loop recordings.

Non-linear least squares of free simulations against the laser; the hysteresis table is fixed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.hysteresis.table import FodTable
from macromicro.identify import _stressed_begin, clusters
from macromicro.identify._free_run_search import Span, ended, nearest, search
from macromicro.identify._stressed_begin import NAMES, TIMES
from macromicro.identify.heating import AMBIENT
from macromicro.identify.notices import ConvergenceWarning, DataWarning, notice
from macromicro.identify.records import signal
from macromicro.models import stressed
from macromicro.models.actuator import Hysteresis
from macromicro.models.heating import Ladder
from macromicro.models.stressed import Stressed
from macromicro.recording import Recording

# Measurement is believed to this [mm]: the kiln's encoder and the table, not the laser.
_TABLE_ERROR = 0.01
_LEAST_R3 = 0.002
_POINTS = 150
# Searches on a grid so much coarser choose where the last one begins: rounds of every begin, how
# many go on, their rounds, those of the last one.
_COARSE = 8.0
_FEW, _BEST, _MORE, _ROUNDS = 4, 2, 8, 40
_SETTLED = 1e-7
_BLOCKS = 40  # parts of all records that errors are judged by
# Of 2 ms steps for two seconds where moves take half a second, and in proportion.
_USUAL = 0.5
_LOGS = [NAMES.index(name) for name in TIMES]


class StressedFit(NamedTuple):
    model: Stressed  # model with the fitted values
    values: dict[str, float]  # by name, heats as "heat 1.5 V" (K)
    std: dict[str, float]  # standard errors, likewise
    rms: float  # over the samples fitted to, mm
    iterations: int  # iterations of the search


class _Known(NamedTuple):
    volts: Array
    lag: float
    cut_on: float
    cut_off: float
    ambient: float
    hysteresis: Hysteresis


class _Run(NamedTuple):
    """A recording on the model's time grid: ctrl [V], share of cut time, dt [s], positions [mm]."""

    ctrl: Array
    cut: Array
    dt: Array
    at: npt.NDArray[np.int64]
    x: Array


def _grid(recording: Recording, scale: float = 1.0) -> _Run:
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
    at = np.unique(np.linspace(1, len(grid) - 1, _POINTS).astype(np.int64))
    return _Run(sent[grid], cut, t[ends] - t[grid], at, x[grid[at]])


def _cut(recordings: Sequence[Recording], end: float) -> tuple[float, float]:
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


def fit(
    table: FodTable,
    recordings: Sequence[Recording],
    ambient: float = AMBIENT,
    lag: float = 0.0,
    near: StressedFit | None = None,
) -> StressedFit:
    """The improved model from open-loop recordings; `ambient` in deg C."""
    # The heat map has a point at each held voltage. The resistances sum to 1, since heat is counted
    # in K. A recorded `contract` is followed, since its timing to the millisecond cannot be
    # predicted. Searches begin at several warmings and paces.
    if len(recordings) < 2:
        raise InputError("recordings", len(recordings), "2 open-loop recordings or more")
    means = _stressed_begin.means(table, recordings, ambient)
    step = 2.0 ** round(math.log2(means.pace / _USUAL))
    runs = [_grid(r, step) for r in recordings]
    places = _cut(recordings, table.f_low + table.span)
    known = _Known(means.volts, lag, *places, ambient, hysteresis(table))
    span = _stressed_begin.span(means)

    def residual(z: Array, runs: Sequence[_Run] = runs) -> Array:
        p = _with(known, _values(z))
        made = [stressed.simulate(p, r.ctrl, r.dt, r.cut)[0][r.at] for r in runs]
        return np.concatenate([(m - r.x) / _TABLE_ERROR for m, r in zip(made, runs, strict=True)])

    if near is None:
        coarse = [_grid(r, _COARSE * step) for r in recordings]

        def rough(z: Array) -> Array:
            return residual(z, coarse)

        begins = nearest(rough, _stressed_begin.begins(means), span, _FEW, _BEST)
        (begin,) = nearest(rough, begins, span, _MORE, 1)
    else:
        begin = _searched(np.array(list(near.values.values())))
    found = search(residual, begin, span, _ROUNDS, _SETTLED)
    if found.status <= 0:
        notice(ConvergenceWarning, "actuator model: search stopped before it settled")
    values = _values(found.x)
    edges = clusters.blocks(len(found.fun), max(_BLOCKS, 2 * len(values)))
    std = np.sqrt(np.diag(clusters.spread(found.jac, found.fun, edges).covariance))
    std[_LOGS] *= values[_LOGS]
    names = [*NAMES, *(f"heat {v:g} V" for v in means.volts[1:])]
    if at_end := _at_end(names, found.x, span, means.warming):
        notice(
            DataWarning,
            f"actuator model: {', '.join(at_end)}, a bound of the search; the records do not "
            "determine it, or need another model, and its standard error means little",
        )
    model = _with(known, values)
    if late := _late(model.ladder, means.longest):
        notice(
            DataWarning,
            f"actuator model: {late} longer than the longest record ({means.longest:.3g} s): "
            "the slowest node is a guess, as is the scale of heats and resistances, and "
            "their standard errors mean little. Hold a level for longer",
        )
    return StressedFit(
        model,
        dict(zip(names, (float(v) for v in values), strict=True)),
        dict(zip(names, (float(v) for v in std), strict=True)),
        float(np.sqrt(np.mean(found.fun**2))) * _TABLE_ERROR,
        int(found.nfev),
    )


def _values(z: Array) -> Array:
    values = z.copy()
    values[_LOGS] = np.exp(values[_LOGS])
    return values


def _searched(values: Array) -> Array:
    z = values.copy()
    z[_LOGS] = np.log(z[_LOGS])
    return z


def _late(ladder: Ladder, longest: float) -> str:
    """Time constants that the records are too short for, in words."""
    times = {"c2 r2": ladder.c2 * ladder.r2, "c3 r3": ladder.c3 * ladder.r3}
    late = [f"{name} ({value:.3g} s)" for name, value in times.items() if value > longest]
    return f"{' and '.join(late)} {'is' if len(late) == 1 else 'are'}" if late else ""


def _at_end(names: Sequence[str], z: Array, span: Span, warming: float) -> list[str]:
    """Parameters at a bound, in words; heats by parts of `warming`."""
    within = span.high - span.low
    within[len(NAMES) :] = warming
    least, most = ended(z, span.low, span.high, within)
    lowest, highest = _values(span.low), _values(span.high)
    return [
        f"{name} {'at least' if below else 'at most'} {lowest[k] if below else highest[k]:.4g}"
        for k, (name, below, above) in enumerate(zip(names, least, most, strict=True))
        if below or above
    ]


def _with(known: _Known, theta: Array) -> Stressed:
    """The model with the fitted values: NAMES, then the heats."""
    c1, r1, c2, r2, c3, latent, shift, stiffening = (float(v) for v in theta[: len(NAMES)])
    return Stressed(
        **known._asdict(),
        heat=np.concatenate([[0.0], theta[len(NAMES) :]]),
        ladder=Ladder(c1, r1, c2, r2, c3, max(1.0 - r1 - r2, _LEAST_R3)),
        latent=latent,
        shift=shift,
        stiffening=stiffening,
    )


def against(model: Stressed, recording: Recording) -> Judgement:
    """The model's free simulation against a recording from cold."""
    t = signal(recording["t"], "t")
    x = signal(recording["laser"], "laser") * 1e-3
    made = stressed.simulate(model, recording["ctrl"], recording.dt)[0]
    return judged(t, x, made, model.hysteresis.span)


def hysteresis(table: FodTable) -> Hysteresis:
    """The table in the form that the kernels take, mm."""
    return Hysteresis(table.everett(), table.f_low, table.span)


class Judgement(NamedTuple):
    """Error of a model, as shares of the stroke."""

    steady: float  # difference at the end
    dynamic: float  # RMS until the measured position has come to stay
    whole: float  # RMS throughout


def judged(t: Array, measured: Array, model: Array, stroke: float) -> Judgement:
    """Error of a model's position; the dynamic part is the rise and 1.5 times its time (2 %)."""
    error = (model - measured) / stroke
    last = t >= t[-1] - 0.02 * (t[-1] - t[0])
    arrived = int(np.argmax(measured >= 0.98 * measured.max()))
    moving = t <= t[0] + 1.5 * (t[arrived] - t[0])
    return Judgement(
        float(error[last].mean()),
        float(np.sqrt(np.mean(error[moving] ** 2))),
        float(np.sqrt(np.mean(error**2))),
    )
