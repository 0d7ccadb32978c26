"""What the law finds out on its way: base temperature, heat, loss and lag, as far as they are off.

A room that is warmer than told, or transformation temperatures that have aged, shift the model's
place along its branch; heat and loss that are other than told let it run ahead; longer lags hold it
back by speed times lag. All of it shows in what the sensor shows beyond the model while the stage
moves, and hardly in a hold. It is a Kalman filter of the four, by the sensitivities of the wires'
heat content; what is known before are the doubts of the settings. The model's own errors are many
periods of one kind, so one reading is worth little.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.kernel import kernel
from macromicro.models.heating import Ladder
from macromicro.models.stressed import Stressed, StressedState

BASE, HEAT, LOSS, LAG = 0, 1, 2, 3
COUNT = 4
ERROR = 0.02  # mm: what the model's place errs by at the best
ALIKE = 0.03  # s: for which it errs alike
MOVES = 20.0  # K/s: the relays' input moves, and tells something
SHARE = 0.5  # of its rate, by which it is corrected at most: no correction makes a reversal
FARTHEST = 3.0  # doubts from what the settings say


class Learned(NamedTuple):
    """What was found. The arrays are changed in place.

    Attributes
    ----------
    values : ndarray, shape (4,)
        Base (K), heat and loss (shares), lag (s), beyond the model's.
    spread : ndarray, shape (4, 4)
        Their covariance.
    heat, loss : float
        Heat content per share of heat and loss, K.
    """

    values: Array
    spread: Array
    heat: float
    loss: float


def nothing(doubts: Array) -> Learned:
    """Before any motion.

    Parameters
    ----------
    doubts : ndarray, shape (4,)
        Standard deviations.

    Returns
    -------
    Learned
        As the settings say.
    """
    return Learned(np.zeros(COUNT), np.diag(doubts * doubts), 0.0, 0.0)


@kernel
def corrected(p: Stressed, s: Learned) -> Stressed:
    """The model with what was found; half of the lag is the driver's.

    Parameters
    ----------
    p : Stressed
        As identified.
    s : Learned
        What was found.

    Returns
    -------
    Stressed
        Tables are the same: more heat by the same map is less capacity and more resistance.
    """
    n, more = p.ladder, 1.0 + s.values[HEAT]
    ladder = Ladder(
        n.c1 / more, n.r1 * more / (1.0 + s.values[LOSS]), n.c2 / more, n.r2 * more,
        n.c3 / more, n.r3 * more,
    )  # fmt: skip
    return Stressed(
        p.volts, p.heat, max(p.lag + 0.5 * s.values[LAG], 0.0), ladder, p.latent, p.shift,
        p.stiffening, p.cut_on, p.cut_off, p.ambient + s.values[BASE], p.hysteresis,
    )  # fmt: skip


@kernel
def learn(
    p: Stressed, before: StressedState, after: StressedState, s: Learned, doubts: Array,
    forget: float, beyond: float, dt: float,
) -> tuple[Learned, float]:  # fmt: skip
    """From what the sensor shows beyond the model's place.

    Parameters
    ----------
    p : Stressed
        Model as corrected.
    before, after : StressedState
        At the ends of this period.
    s : Learned
        So far; its arrays are changed.
    doubts : ndarray, shape (4,)
        Standard deviations before any motion.
    forget : float
        Time of motion in which what was found is as doubtful again, s.
    beyond : float
        mm; NaN tells nothing.
    dt : float
        Control period, s.

    Returns
    -------
    Learned
        Better known.
    float
        What the heat content was wrong by, K.
    """
    way, turn = after.x - before.x, after.memory.u - before.memory.u
    slope = 0.0
    if way * turn > 0.0:
        slope = way / turn
    latent = p.latent / p.hysteresis.span
    loose = 1.0 / (1.0 + (latent + p.stiffening) * slope)  # input per content
    fall = 1.0 - (1.0 - latent * slope * loose) * dt / (p.ladder.c1 * p.ladder.r1)
    out = (after.wire - after.plates) / p.ladder.r1
    sh = fall * s.heat + after.heat * dt / p.ladder.c1
    sl = fall * s.loss - out * dt / p.ladder.c1
    now = Learned(s.values, s.spread, sh, sl)
    if math.isnan(beyond) or abs(turn) < MOVES * dt or slope <= 0.0 or after.cut > 0.0:
        return now, 0.0
    h0 = slope * loose
    h1, h2, h3 = h0 * sh, h0 * sl, -way / dt
    scatter = ERROR * ERROR * ALIKE / dt
    for i in range(COUNT):
        most = doubts[i] * doubts[i]
        s.spread[i, i] = min(s.spread[i, i] + most * dt / forget, most)
    g0, g1, g2, g3 = 0.0, 0.0, 0.0, 0.0
    g0 = s.spread[0, 0] * h0 + s.spread[0, 1] * h1 + s.spread[0, 2] * h2 + s.spread[0, 3] * h3
    g1 = s.spread[1, 0] * h0 + s.spread[1, 1] * h1 + s.spread[1, 2] * h2 + s.spread[1, 3] * h3
    g2 = s.spread[2, 0] * h0 + s.spread[2, 1] * h1 + s.spread[2, 2] * h2 + s.spread[2, 3] * h3
    g3 = s.spread[3, 0] * h0 + s.spread[3, 1] * h1 + s.spread[3, 2] * h2 + s.spread[3, 3] * h3
    scatter += h0 * g0 + h1 * g1 + h2 * g2 + h3 * g3
    by = beyond / scatter
    turned = g0 * by + sh * g1 * by + sl * g2 * by
    most = SHARE * abs(turn)
    if abs(turned) > most:
        by *= most / abs(turned)
    gains = (g0, g1, g2, g3)
    for i in range(COUNT):
        far = FARTHEST * doubts[i]
        s.values[i] = min(max(s.values[i] + gains[i] * by, -far), far)
        for j in range(COUNT):
            s.spread[i, j] -= gains[i] * gains[j] / scatter
    return now, sh * g1 * by + sl * g2 * by
