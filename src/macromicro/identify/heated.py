"""The model of the law `inverse`, from open-loop heatings and the kiln's table."""

# Driver, heat, latent heat and stress by `stressed.fit`. The driver's lag is found from the change
# of speed just after a change of CTRL, where the table's error cancels; the sensor's lag from its
# voltage against the laser.

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.control.inverse import model
from macromicro.control.inverse.model import Inverse
from macromicro.errors import ProblemError
from macromicro.hysteresis.table import FodTable
from macromicro.identify import stressed
from macromicro.identify.heating import AMBIENT
from macromicro.identify.records import signal
from macromicro.identify.stressed import StressedFit
from macromicro.models import stressed as stressed_model
from macromicro.models.stressed import Stressed
from macromicro.recording import Recording

_EARLY = 15  # periods before and after a change of CTRL, at first
_BEYOND = 10.0 / 3.0  # times that: a lag is searched so far
_QUICK = 0.1  # of the shortest hold of CTRL: records with longer periods tell no lag
_DEGREE = 9


class HeatedFit(NamedTuple):
    fit: StressedFit  # driver, heat, relays
    sensor: float  # lag of the position's sensor, s; NaN where no record has one
    gains: Inverse  # of the law, with the default speed


def found(table: FodTable, records: Sequence[Recording], ambient: float = AMBIENT) -> HeatedFit:
    """The law's model; `ambient` in deg C."""
    held = shortest(records)
    quick = [r for r in records if r.dt <= _QUICK * held * (1.0 + 1e-9)]
    if not quick:
        slowest = min(r.dt for r in records) if records else math.nan
        most = f"Record some at {_QUICK * held:g} s or less, a tenth of the shortest hold of CTRL."
        raise ProblemError("records", f"the shortest period is {slowest:g} s", most)
    first = stressed.fit(table, records, ambient)
    fit = stressed.fit(table, records, ambient, driver_lag(first.model, quick), first)
    with_sensor = [r for r in quick if "hall_voltage" in r]
    lag = sensor_lag(with_sensor) if with_sensor else math.nan
    sensor = lag if math.isfinite(lag) else 0.0
    return HeatedFit(fit, lag, model.gains(fit.model, sensor, fit.rms))


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
    runs = [_Changes(*_changes(r, early)) for r in records]
    if not any(len(run.at) for run in runs):
        raise ProblemError(
            "records, ctrl", "CTRL never changes", "Record steps from one level to another."
        )

    def left(lag: float) -> float:
        total, count = 0.0, 0
        for r, run in zip(records, runs, strict=True):
            made = stressed_model.simulate(model._replace(lag=lag), run.ctrl, r.dt, run.cut)[0]
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
    at: npt.NDArray[np.int64]
    since: npt.NDArray[np.int64]


def _changes(
    r: Recording, early: float
) -> tuple[Array, Array, Array, npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    sent, x = signal(r["ctrl"], "ctrl"), 1e-3 * signal(r["laser"], "laser")
    acts = np.r_[0.0, sent[:-1]]
    cut = signal(r["contract"], "contract") if "contract" in r else np.full(len(sent), np.nan)
    span = round(early / r.dt)
    edges = np.flatnonzero(np.diff(acts)) + 1
    edges = edges[edges >= span]
    soon = (edges[:, None] + np.arange(span)[None, :]).ravel()
    since, there = np.repeat(edges, span), soon < len(x)
    return acts, cut, x, soon[there], since[there]


def sensor_lag(records: Sequence[Recording]) -> float:
    """Lag of a sensor's voltage behind the laser: the one with the smoothest relation."""
    places = [signal(r["laser"], "laser") for r in records]
    volts = np.concatenate([signal(r["hall_voltage"], "hall_voltage") for r in records])
    low, high = min(p.min() for p in places), max(p.max() for p in places)
    # Standing still tells nothing: weights by how far the stage moved since.
    moved = np.concatenate([np.abs(np.gradient(p)) for p in places])

    def left(lag: float) -> float:
        seen = [_lagged(p, lag, r.dt) for p, r in zip(places, records, strict=True)]
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


def _lagged(x: Array, lag: float, dt: float) -> Array:
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
