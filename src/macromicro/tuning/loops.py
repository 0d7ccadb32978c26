"""Open loops of the macro-stage's laws with its linear model (4.4), and their margins.

The dead-zone inverse is taken to cancel the friction, as the thesis' design does, and the
limit is never reached. There is no linear model of the micro-stage, whose actuator has
hysteresis: `ripple_margin` measures what its bench bears instead.
"""

from __future__ import annotations

import math

import numpy as np

from macromicro.arrays import Array
from macromicro.control import stability
from macromicro.control.settings import Control
from macromicro.design.margins import Margins, margins
from macromicro.design.response import smoothed
from macromicro.models.macro import Linear
from macromicro.runs.programmed import on_twin
from macromicro.runs.sequence import BAND_UM, MEAN, micro_steps
from macromicro.settings import Settings
from macromicro.tuning import laws
from macromicro.tuning.laws import Law

_LEVEL, _HOLD, _LATE = 2e-3, 8.0, 4.0  # m, s, s
MOST = 64.0
LEAST = 2.0
_PER_DOUBLING = 4


def macro_loop(control: Control, linear: Linear = Linear()) -> tuple[Array, Array]:  # noqa: B008
    """Give the open loop of the chosen macro law with the linear model (4.4).

    Parameters
    ----------
    control : Control
        With the law.
    linear : Linear
        The model's (4.3).

    Returns
    -------
    num, den : ndarray
        Of D(z) times (4.4), in z, highest power first.
    """
    if control.macro_law == "pid":
        return stability.macro_loop(control.pid, linear)
    taps = control.pd_initial if control.macro_law == "pd-initial" else control.pd_tuned
    return stability.macro_loop(taps, linear)


def macro_margins(control: Control) -> Margins:
    """Give the margins of that loop.

    Parameters
    ----------
    control : Control
        With the law.

    Returns
    -------
    Margins
        With (4.4) as identified.
    """
    return margins(*macro_loop(control), Linear().dt)


def ripple(settings: Settings, seed: int = 0) -> float:
    """Measure how much a hold of the micro-stage wanders.

    Parameters
    ----------
    settings : Settings
        The bench and its law.
    seed : int
        Of the noise.

    Returns
    -------
    float
        Peak to peak [um] of the laser's centred mean over the last 4 s of a hold of 8 s at 2 mm,
        less a straight line; inf where the stage reached its stop in that time, or the guard ended
        the run.
    """
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
    """Tell whether a micro law keeps still.

    Parameters
    ----------
    settings : Settings
        The bench and its law.
    law : Law
        The micro law.
    seed : int
        Of the noise.

    Returns
    -------
    bool
        Whether its `ripple_margin` is at least `LEAST`.
    """
    return ripple_margin(settings, law, seed, LEAST) >= LEAST


def _quiet(settings: Settings, law: Law, gains: Array, seed: int) -> bool:
    control = laws.with_gains(settings.controller, law, gains)
    return ripple(settings._replace(controller=control), seed) <= BAND_UM


def ripple_margin(settings: Settings, law: Law, seed: int = 0, most: float = MOST) -> float:
    """Measure the largest factor on all gains of a micro law at which a hold still is quiet.

    Quiet: its ripple stays within the 10 um band. Measured on the bench, in steps of a quarter of
    an octave.

    Parameters
    ----------
    settings : Settings
        The bench and its law.
    law : Law
        The micro law.
    seed : int
        Of the noise.
    most : float
        The last factor tried.

    Returns
    -------
    float
        NaN where the hold is not quiet with the gains as they are.
    """
    gains = laws.gains_of(settings.controller, law)
    quiet = math.nan
    for k in range(round(math.log2(most)) * _PER_DOUBLING + 1):
        factor = 2.0 ** (k / _PER_DOUBLING)
        if not _quiet(settings, law, factor * gains, seed):
            break
        quiet = factor
    return quiet
