"""Open loops of the macro-stage's laws with its linear model (4.4), and their margins.

The dead-zone inverse is assumed to cancel the friction, without saturation, as in the
thesis. The micro-stage has hysteresis and no linear model; `ripple_margin` measures instead.
"""

from __future__ import annotations

import math

import numpy as np

from macromicro.arrays import Array
from macromicro.control import stability
from macromicro.control.settings import Control
from macromicro.design.margins import Complex, Margins, margins, responses
from macromicro.design.response import smoothed
from macromicro.models.macro import Linear
from macromicro.runs.programmed import on_twin
from macromicro.runs.sequence import BAND_UM, MEAN, micro_steps
from macromicro.settings import Settings
from macromicro.tuning.gains import Law

_LEVEL, _HOLD, _LATE = 2e-3, 8.0, 4.0  # m, s, s
MOST = 64.0
LEAST = 2.0
_PER_DOUBLING = 4


def macro_loop(control: Control, linear: Linear = Linear()) -> tuple[Array, Array]:  # noqa: B008
    if control.macro_law == "pid":
        return stability.macro_loop(control.pid, linear)
    taps = control.pd_initial if control.macro_law == "pd-initial" else control.pd_tuned
    return stability.macro_loop(taps, linear)


def macro_margins(control: Control) -> Margins:
    return margins(*macro_loop(control), Linear().dt)


def macro_response(control: Control, frequency: Array) -> Complex:
    """The open loop at frequencies [Hz]."""
    return responses(*macro_loop(control), 2.0 * math.pi * frequency, Linear().dt)


def ripple(settings: Settings, seed: int = 0) -> float:
    recording = on_twin(micro_steps([_LEVEL], _HOLD), settings, seed)
    if not recording.attributes.get("finished", 1):
        return math.inf
    rows = slice(-round(_LATE / recording.dt) - MEAN, -MEAN)
    if recording["contract"][rows].any():
        return math.inf
    late = smoothed(recording["laser"], MEAN)[rows]
    at = np.arange(len(late))
    return float(np.ptp(late - np.polyval(np.polyfit(at, late, 1), at)))


def holds(settings: Settings, law: Law, seed: int = 0) -> bool:
    return ripple_margin(settings, law, seed, LEAST) >= LEAST


def ripple_margin(settings: Settings, law: Law, seed: int = 0, most: float = MOST) -> float:
    """Largest factor on all gains of a micro law whose hold stays within the 10 um band.

    It is measured on the bench, in steps of a quarter of an octave.
    """
    quiet = math.nan
    for k in range(round(math.log2(most)) * _PER_DOUBLING + 1):
        factor = 2.0 ** (k / _PER_DOUBLING)
        control = law.scaled(settings.controller, factor)
        if not ripple(settings._replace(controller=control), seed) <= BAND_UM:
            break
        quiet = factor
    return quiet
