"""Claims S5a, S5b, S7 to S10 on the electro-thermal and the full actuator model."""

from __future__ import annotations

import warnings

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.hysteresis.table import FodTable
from macromicro.identify.heating import AMBIENT, cooling
from macromicro.identify.notices import ConvergenceWarning
from macromicro.models import heating
from macromicro.models.heating import from_transfer, step_response, transfer
from macromicro.models.weighted_gain import Weighted, exponential, weighted
from macromicro.thesis.chapter5 import _electrothermal_runs, actuator_fits
from macromicro.thesis.chapter5._electrothermal_runs import CYCLES_BEFORE, WARM, StepData
from macromicro.thesis.chapter5.actuator_models import Models, Unfitted
from macromicro.thesis.claims import (
    Claim,
    NotMeasured,
    accepts,
    holds,
    judged,
    printed,
    stated,
    within,
)

PRINTED_A = printed("S5b")  # 1/V, (5.5)

VOLTS = (1.5, 1.6, 1.7, 1.8)


def against_5_6(modes: heating.Modes) -> float:
    """NRMSE [%] of a minute's step response against (5.6) as printed."""
    t = np.arange(0.0, 60.0, 0.01)
    printed = step_response(from_transfer(*heating.PRINTED), t)
    found = step_response(modes, t)
    return float(100.0 * np.sqrt(np.mean((found - printed) ** 2)) / np.ptp(printed))


def claims(models: Models | Unfitted) -> list[Claim]:
    """S5a, S5b, S7 and S8 from the fits, S9 from the printed equation, S10 from both."""
    if isinstance(models, Unfitted):
        return _without_models(models)
    return judged(
        [
            (("S5a", "S5b"), lambda: _gain(models)),
            ("S7", lambda: _dynamics(models)),
            ("S8", lambda: _cooling(models.table, models.data)),
            ("S9", printed_gain),
            ("S10", lambda: _whole(models)),
        ]
    )


def _without_models(seen: Unfitted) -> list[Claim]:
    """S8 and S9, which need no model, and why the others are not measured."""

    def lacking() -> Claim:
        raise NotMeasured(f"the thesis' procedure does not fit this bench's steps: {seen.why}")

    return judged(
        [
            (("S5a", "S5b", "S7"), lacking),
            ("S8", lambda: _cooling(seen.table, seen.data)),
            ("S9", printed_gain),
            ("S10", lacking),
        ]
    )


def _gain(models: Models) -> list[Claim]:
    fit, line = models.thesis.nonlinear, models.thesis.linearised
    low, high = (float(v) for v in fit.interval[1])
    a = line.model.a
    near = accepts("S5b", a) or low <= PRINTED_A <= high
    return [
        stated("S5a", fit.asymptote, within("S5a", fit.asymptote), fit=fit),
        stated("S5b", a, holds(near), fit=fit, low=low, high=high),
    ]


def _dynamics(models: Models) -> Claim:
    found = models.thesis.heating.modes
    num, den = transfer(found)
    error = against_5_6(found)
    return stated(
        "S7",
        [-found.rate1, -found.rate2, -found.rate3, float(num[-1] / den[-1])],
        within("S7", error),
        error=error,
        mls=_mls(models),
    )


def _mls(models: Models) -> str:
    """(5.6) by MLS, as Section 5.2.2 identifies it, in words."""
    try:
        record = models.traces[1.575].record
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ConvergenceWarning)  # the reason says so
            found = actuator_fits.heating_mls(record, models.thesis.steady[1.575])
        made = found.simulate(np.ones(round(60.0 / found.dt)))
    except InputError as error:
        return f"MLS, which Section 5.2.2 uses, finds no such model ({error})"
    t = np.arange(len(made)) * found.dt
    printed = step_response(from_transfer(*heating.PRINTED), t)
    apart = 100.0 * np.sqrt(np.mean((made - printed) ** 2)) / np.ptp(printed)
    left = "" if found.converged else " (its last values, it does not settle)"
    return f"by MLS of order three, as Section 5.2.2 has it, by {apart:.2f} %{left}"


def _cooling(table: FodTable, data: StepData) -> Claim:
    """S8 as in Section 5.2.2, for an actuator cycled a few times; also from cold."""
    warm = cooling(table, data.warm, AMBIENT)
    return stated(
        "S8",
        warm.time,
        within("S8", warm.time),
        cycles=CYCLES_BEFORE,
        cold=_cold(table, data),
        warm=warm,
    )


def _cold(table: FodTable, data: StepData) -> str:
    try:
        return f"{cooling(table, data.cooled[WARM], AMBIENT).time:.2f} s from cold"
    except InputError as error:
        return f"from cold it is not known ({error})"


def _whole(models: Models) -> Claim:
    steps = models.steps
    steady = 100.0 * max(abs(steps[v].steady) for v in _electrothermal_runs.BELOW_STOP)
    ratio = steps[1.8].dynamic / steps[1.575].dynamic
    return stated(
        "S10",
        [steady, ratio],
        within("S10", steady, ratio),
        steady=steady,
        ratio=ratio,
        high=100.0 * steps[1.8].dynamic,
        low=100.0 * steps[1.575].dynamic,
    )


def curve(low: float = 1.4, high: float = 1.9, points: int = 251) -> tuple[Array, Array]:
    """CTRL [V] and steady temperature [K above ambient], shape (points,) each."""
    volts = np.linspace(low, high, points)
    return volts, np.array([weighted(Weighted(), float(v)) for v in volts])


def exponentials(volts: Array) -> tuple[Array, Array]:
    """The lower (at least 0) and the upper exponential of (5.8) [K above ambient]."""
    p = Weighted()
    lower = [max(0.0, exponential(p.low, float(v))) for v in volts]
    return np.array(lower), p.scale * np.exp(p.rate * (volts - p.start)) + p.offset


def printed_gain() -> list[Claim]:
    found = [weighted(Weighted(), v) for v in VOLTS]
    _, everywhere = curve(0.0, 5.0, 5001)
    volts, rise = curve(1.3, 1.6, 3001)
    good = accepts("S9", *found) and bool((everywhere >= 0.0).all())
    silent = float(volts[rise < 0.05][-1])
    high = weighted(Weighted(), 1.9)
    return [stated("S9", found, holds(good), silent=silent, high=high)]
