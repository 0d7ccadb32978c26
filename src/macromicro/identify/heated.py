"""What the law `inverse` needs, from heatings in open loop and the kiln's table.

Driver, heat, latent heat and stress by `stressed.fit`. The driver's lag shows in the first moments
after CTRL has changed, in how the speed changes, where the table's own error is left out.
The lag of the position's sensor is that by which its voltage follows the laser.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.control.inverse import model
from macromicro.control.inverse.model import Inverse
from macromicro.errors import InputError
from macromicro.hysteresis.table import FodTable
from macromicro.identify import stressed
from macromicro.identify.actuator import AMBIENT
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
    """An actuator as found.

    Attributes
    ----------
    fit : StressedFit
        Driver, heat, relays.
    sensor : float
        Lag of the position's sensor, s; NaN where no record has one.
    gains : Inverse
        Of the law, with the default speed.
    """

    fit: StressedFit
    sensor: float
    gains: Inverse


def found(table: FodTable, records: Sequence[Recording], ambient: float = AMBIENT) -> HeatedFit:
    """The law's model.

    Parameters
    ----------
    table : FodTable
        From the kiln: deg C to mm.
    records : Sequence[Recording]
        Columns t, ctrl, laser, and contract and hall_voltage perhaps; two or more, each from cold.
        Some with ten samples or more in the shortest hold of CTRL.
    ambient : float, optional
        Room temperature, deg C.

    Returns
    -------
    HeatedFit
        With standard errors in its fit.

    Raises
    ------
    InputError
        Fewer than two records, too few voltages, or none quick enough to tell a lag.
    """
    held = shortest(records)
    quick = [r for r in records if r.dt <= _QUICK * held * (1.0 + 1e-9)]
    if not quick:
        slowest = min(r.dt for r in records) if records else math.nan
        most = f"some of at most {_QUICK * held:g} s, a tenth of the shortest hold of CTRL"
        raise InputError("records", f"periods of {slowest:g} s", most)
    first = stressed.fit(table, records, ambient)
    fit = stressed.fit(table, records, ambient, driver_lag(first.model, quick), first)
    with_sensor = [r for r in quick if "hall_voltage" in r]
    lag = sensor_lag(with_sensor) if with_sensor else math.nan
    sensor = lag if math.isfinite(lag) else 0.0
    return HeatedFit(fit, lag, model.gains(fit.model, sensor, fit.rms))


def shortest(records: Sequence[Recording]) -> float:
    """The shortest time for which CTRL stays between two changes.

    Parameters
    ----------
    records : Sequence[Recording]
        Columns ctrl.

    Returns
    -------
    float
        s; infinite where it changes once at most in each.
    """
    edges = [(np.flatnonzero(np.diff(signal(r["ctrl"], "ctrl"))), r.dt) for r in records]
    return min((float(np.diff(at).min()) * dt for at, dt in edges if len(at) > 1), default=math.inf)


def driver_lag(model: Stressed, records: Sequence[Recording]) -> float:
    """The lag with which heat follows CTRL, beside the period by which the D/A is late.

    Seen within a short time after each change, as long as the lag or longer; of a lag that is
    longer than it, twice the time is looked at, up to the shortest hold of CTRL.

    Parameters
    ----------
    model : Stressed
        As fitted, whatever its lag.
    records : Sequence[Recording]
        Columns t, ctrl and laser, contract perhaps.

    Returns
    -------
    float
        s.

    Raises
    ------
    InputError
        CTRL changes in none of them.
    """
    early, held = _EARLY * min(r.dt for r in records), shortest(records)
    while True:
        lag = _seen_within(model, records, early)
        if lag <= early or 2.0 * early > held:
            return lag
        early *= 2.0


def _seen_within(model: Stressed, records: Sequence[Recording], early: float) -> float:
    """`driver_lag` by what shows so soon after a change [s]."""
    runs = [_Changes(*_changes(r, early)) for r in records]
    if not any(len(run.at) for run in runs):
        raise InputError("records, ctrl", "no change of CTRL", "steps from one level to another")

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
    """The lag up to `most` [s] of least cost."""
    from scipy.optimize import minimize_scalar

    how = {"xatol": 2e-4 * most}
    return float(minimize_scalar(cost, bounds=(0.0, most), method="bounded", options=how).x)


class _Changes(NamedTuple):
    """CTRL as it acts [V], share of time that is cut, places [mm]; samples soon after a change,
    and for each the sample of the change."""

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
    """The lag by which a voltage follows the laser's place.

    Through a first-order lag of the right length the laser says the voltage best, by one smooth
    curve for all ways.

    Parameters
    ----------
    records : Sequence[Recording]
        Columns laser and hall_voltage, of one period.

    Returns
    -------
    float
        s.
    """
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
    """A first-order lag of a course that is straight between its samples."""
    from scipy.signal import lfilter, lfilter_zi

    if lag < 1e-6:
        return x
    a = math.exp(-dt / lag)
    # Exact for straight pieces (first-order hold).
    one = lag / dt * (1.0 - a)
    b = np.array([1.0 - one, one - a])
    state = lfilter_zi(b, [1.0, -a]) * x[0]
    return np.asarray(lfilter(b, [1.0, -a], x, zi=state)[0])
