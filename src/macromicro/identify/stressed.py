"""Fit of the better actuator model (`models.stressed`) to open-loop recordings.

Everything is fitted at once, to positions only: the free runs of the model against the
laser, by non-linear least squares. The hysteresis table comes from the kiln and stays.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.hysteresis.table import FodTable
from macromicro.identify.actuator import AMBIENT, Judgement, hysteresis, judged
from macromicro.identify.notices import ConvergenceWarning, DataWarning, notice
from macromicro.identify.records import signal
from macromicro.identify.spread import standard_errors
from macromicro.models import stressed
from macromicro.models.actuator import Hysteresis
from macromicro.models.heating import Ladder
from macromicro.models.stressed import Stressed
from macromicro.models.weighted_gain import Weighted, weighted
from macromicro.recording import Recording

# Below this the actuator does not respond at all (Section 5.3.2).
SILENT = 1.25
NAMES = ("c1", "r1", "c2", "r2", "c3", "latent", "shift", "stiffening")
# In the order of NAMES: as an engineer would guess, and what is still believable.
_GUESS = (0.8, 0.75, 40.0, 0.2, 1500.0, 20.0, 0.5, 0.5)
_LOW = (0.3, 0.4, 5.0, 0.02, 200.0, 0.0, -10.0, 0.0)
_HIGH = (2.0, 0.95, 300.0, 0.5, 20000.0, 80.0, 20.0, 6.0)
# Measurement is believed to this [mm]: the kiln's encoder and the table, not the laser.
_TABLE_ERROR = 0.01
_MOST_HEAT = 600.0
_LEAST_R3 = 0.002
_POINTS = 150
_END = 1e-3  # of the range between the bounds: what is so near has reached one
MOST_VOLTAGES = 60


class StressedFit(NamedTuple):
    """The better actuator model as found.

    Attributes
    ----------
    model : Stressed
        Model with the fitted values.
    values : dict[str, float]
        By name, heats as "heat 1.5 V" (K).
    std : dict[str, float]
        Standard errors, likewise.
    rms : float
        Over the samples fitted to, mm.
    iterations : int
        Iterations of the search.
    """

    model: Stressed
    values: dict[str, float]
    std: dict[str, float]
    rms: float
    iterations: int


class _Known(NamedTuple):
    """What of a `Stressed` is known before the search."""

    volts: Array
    lag: float
    cut_on: float
    cut_off: float
    ambient: float
    hysteresis: Hysteresis


class _Run(NamedTuple):
    """A recording on the model's time grid: ctrl [V], share of time cut, dt [s]; at which
    grid points to compare with which positions x [mm]."""

    ctrl: Array
    cut: Array
    dt: Array
    at: npt.NDArray[np.int64]
    x: Array


def _grid(recording: Recording) -> _Run:
    """A time grid that is fine where CTRL has just changed, and the positions to meet.

    2 ms for two seconds after each change, then 10 ms up to ten seconds, then 50 ms.
    Comparisons are spread evenly over this grid, so that the fast parts count most.
    """
    t, sent = signal(recording["t"], "t"), signal(recording["ctrl"], "ctrl")
    x = signal(recording["laser"], "laser") * 1e-3
    edges = [0, *(np.flatnonzero(np.diff(sent)) + 1), len(t) - 1]
    places = []
    for a, b in pairwise(edges):
        for begin, end, step in ((0.0, 2.0, 0.002), (2.0, 10.0, 0.01), (10.0, np.inf, 0.05)):
            first = a + round(begin / recording.dt)
            last = b if np.isinf(end) else min(b, a + round(end / recording.dt))
            places.append(
                np.arange(first, last, max(round(step / recording.dt), 1), dtype=np.int64)
            )
    grid = np.concatenate(places)
    ends = np.append(grid[1:], len(t) - 1)
    contract = recording["contract"] if "contract" in recording else np.zeros(len(t))
    total = np.r_[0.0, np.cumsum(signal(contract, "contract"))]
    cut = (total[ends] - total[grid]) / (ends - grid)
    at = np.unique(np.linspace(1, len(grid) - 1, _POINTS).astype(np.int64))
    return _Run(sent[grid], cut, t[ends] - t[grid], at, x[grid[at]])


def _cut(recordings: Sequence[Recording], end: float) -> tuple[float, float]:
    """Positions [mm] at which CONTRACT closed and opened, moved down to what the table reaches."""
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
    gain: Weighted | None = None,
    ambient: float = AMBIENT,
    lag: float = 0.0,
) -> StressedFit:
    """The better model from open-loop recordings.

    The map from CTRL to heat gets a point at every voltage that is held in one of them. The sum of
    the resistances is 1: heat is counted as the warming that it leads to. Where `contract` was
    recorded it is followed, since when it acts to the millisecond cannot be predicted. Warns where
    the search does not settle, or ends at a bound of a parameter.

    Parameters
    ----------
    table : FodTable
        From the kiln, deg C to mm.
    recordings : Sequence[Recording]
        Recordings with the columns t, ctrl, laser, and contract perhaps; two or more. Each must
        start cold and fully extended.
    gain : Weighted | None, optional
        A first guess for the heats.
    ambient : float, optional
        Room temperature, deg C.
    lag : float, optional
        Lag of the driver, s: too short to be found from such records, and taken as given.

    Returns
    -------
    StressedFit
        Values with standard errors.

    Raises
    ------
    InputError
        Fewer than two recordings, or no voltage above 1.25 V.
    """
    from scipy.optimize import least_squares

    if len(recordings) < 2:
        raise InputError("recordings", len(recordings), "2 open-loop recordings or more")
    volts = sorted({float(v) for r in recordings for v in np.unique(r["ctrl"]) if v > SILENT})
    if not 1 <= len(volts) <= MOST_VOLTAGES:
        found = f"{len(volts)} different voltages above {SILENT} V"
        accepted = f"1 to {MOST_VOLTAGES} levels that are held for a while"
        raise InputError("recordings, ctrl", found, accepted)
    runs = [_grid(r) for r in recordings]
    places = _cut(recordings, table.f_low + table.span)
    known = _Known(np.array([SILENT, *volts]), lag, *places, ambient, hysteresis(table))

    def residual(theta: Array) -> Array:
        p = _with(known, theta)
        made = [stressed.simulate(p, r.ctrl, r.dt, r.cut)[0][r.at] for r in runs]
        return np.concatenate([(m - r.x) / _TABLE_ERROR for m, r in zip(made, runs, strict=True)])

    start = np.r_[_GUESS, _first_heats(volts, gain or Weighted())]
    low = np.r_[_LOW, np.zeros(len(volts))]
    high = np.r_[_HIGH, np.full(len(volts), _MOST_HEAT)]
    found = least_squares(
        residual,
        start,
        bounds=(low, high),
        x_scale="jac",
        diff_step=1e-3,
        max_nfev=40,
        xtol=1e-5,
        ftol=2e-3,
    )
    if found.status <= 0:
        notice(ConvergenceWarning, "actuator model: search stopped before it settled")
    variance = 2.0 * float(found.cost) / max(len(found.fun) - len(start), 1)
    std = standard_errors(found.jac) * variance**0.5
    names = [*NAMES, *(f"heat {v:g} V" for v in volts)]
    if ended := _ended(names, found.x, low, high):
        notice(
            DataWarning,
            f"actuator model: {', '.join(ended)}: at the end of what is believable; the records do "
            "not determine it, or ask for another model, and its standard error says little",
        )
    return StressedFit(
        _with(known, found.x),
        dict(zip(names, (float(v) for v in found.x), strict=True)),
        dict(zip(names, (float(v) for v in std), strict=True)),
        float(np.sqrt(np.mean(found.fun**2))) * _TABLE_ERROR,
        int(found.nfev),
    )


def _ended(names: Sequence[str], values: Array, low: Array, high: Array) -> list[str]:
    """The parameters that the search left at a bound, in words."""
    width = _END * (high - low)
    least, most = values <= low + width, values >= high - width
    return [
        f"{name} {'at least' if below else 'at most'} {low[k] if below else high[k]:g}"
        for k, (name, below, above) in enumerate(zip(names, least, most, strict=True))
        if below or above
    ]


def _with(known: _Known, theta: Array) -> Stressed:
    """The model with the fitted values: those of NAMES, then the heats."""
    c1, r1, c2, r2, c3, latent, shift, stiffening = (float(v) for v in theta[: len(NAMES)])
    return Stressed(
        **known._asdict(),
        heat=np.concatenate([[0.0], theta[len(NAMES) :]]),
        ladder=Ladder(c1, r1, c2, r2, c3, max(1.0 - r1 - r2, _LEAST_R3)),
        latent=latent,
        shift=shift,
        stiffening=stiffening,
    )


def _first_heats(volts: list[float], gain: Weighted) -> Array:
    """A first guess of the heats [K]: the static gain, tamed at both ends, and rising."""
    guess = [min(max(weighted(gain, v), 5.0), 0.5 * _MOST_HEAT) for v in volts]
    return np.maximum.accumulate(np.array(guess))


def against(model: Stressed, recording: Recording) -> Judgement:
    """The model's free run against a recording that starts cold.

    Parameters
    ----------
    model : Stressed
        The better model.
    recording : Recording
        Recording with the columns t, ctrl and laser.

    Returns
    -------
    Judgement
        Shares of the stroke.
    """
    t = signal(recording["t"], "t")
    x = signal(recording["laser"], "laser") * 1e-3
    made = stressed.simulate(model, recording["ctrl"], recording.dt)[0]
    return judged(t, x, made, model.hysteresis.span)
