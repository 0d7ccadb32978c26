"""A Kalman filter for the deviations of base temperature, heat, loss and lag from the model's."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.columns import Meaning
from macromicro.kernel import kernel
from macromicro.models.heating import Ladder
from macromicro.models.stressed import Stressed, StressedState

BASE, HEAT, LOSS, LAG = 0, 1, 2, 3
COUNT = 4
ERROR = 0.02  # mm: least error of the model's place
WRONG = 1.0  # and by this share of what it is off
ALIKE = 0.03  # s: for which it errs alike
MOVES = 3.0  # K/s: the relays' input moves, and tells something
STEEP = 0.004  # 1/K of the stroke: flatter branches, after a reversal, tell of the relays instead
FAR = 0.1  # mm beyond the model: the stage itself shows how steep its branch is
STEEPEST = 0.05  # 1/K of the stroke: no branch is steeper
SHARE = 0.5  # of its rate, by which it is corrected at most: no correction makes a reversal
FARTHEST = 3.0  # standard deviations from the settings


class Learned(NamedTuple):
    """The learned deviations; arrays change in place."""

    values: Annotated[
        Array, Meaning("base (K), heat and loss (shares), lag (s), beyond the model's")
    ]
    spread: Annotated[Array, Meaning("their covariance")]
    heat: Annotated[float, Meaning("heat content per share of heat and loss", "K")]
    loss: Annotated[float, Meaning("heat content per share of heat and loss", "K")]


class Four(NamedTuple):
    """One number for each learned deviation."""

    base: float
    heat: float
    loss: float
    lag: float


def nothing(doubts: Array) -> Learned:
    return Learned(np.zeros(COUNT), np.diag(doubts * doubts), 0.0, 0.0)


@kernel
def corrected(p: Stressed, s: Learned) -> Stressed:
    """The model with the learned deviations; half of the lag is the driver's."""
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
def _row(s: Learned, i: int, h: Four) -> float:
    """A row of the covariance times the sensitivities."""
    return float(
        s.spread[i, BASE] * h.base
        + s.spread[i, HEAT] * h.heat
        + s.spread[i, LOSS] * h.loss
        + s.spread[i, LAG] * h.lag
    )


@kernel
def _taken(
    s: Learned, i: int, gain: float, g: Four, by: float, scatter: float, far: float
) -> float:
    """One value and its row of the covariance, after a reading."""
    s.values[i] = min(max(s.values[i] + gain * by, -far), far)
    s.spread[i, BASE] -= gain * g.base / scatter
    s.spread[i, HEAT] -= gain * g.heat / scatter
    s.spread[i, LOSS] -= gain * g.loss / scatter
    s.spread[i, LAG] -= gain * g.lag / scatter
    return float(s.values[i])


@kernel
def learn(
    p: Stressed,
    before: StressedState,
    after: StressedState,
    s: Learned,
    doubts: Array,
    forget: float,
    beyond: float,
    gone: float,
    dt: float,
) -> tuple[
    Annotated[Learned, Meaning(name="Learned")],
    Annotated[float, Meaning("error of the heat content", "K", name="float")],
]:
    """Update by the sensor's deviation from the model (`beyond`, `gone` in mm)."""
    way, turn = after.x - before.x, after.memory.u - before.memory.u
    slope = 0.0
    if way * turn > 0.0:
        slope = way / turn
    if abs(beyond) > FAR and gone * turn > 0.0:
        slope = max(slope, min(gone / turn, STEEPEST * p.hysteresis.span))
    latent = p.latent / p.hysteresis.span
    loose = 1.0 / (1.0 + (latent + p.stiffening) * slope)  # input per content
    fall = 1.0 - (1.0 - latent * slope * loose) * dt / (p.ladder.c1 * p.ladder.r1)
    out = (after.wire - after.plates) / p.ladder.r1
    sh = fall * s.heat + after.heat * dt / p.ladder.c1
    sl = fall * s.loss - out * dt / p.ladder.c1
    now = Learned(s.values, s.spread, sh, sl)
    flat = slope < STEEP * p.hysteresis.span or abs(turn) < MOVES * dt
    if math.isnan(beyond) or flat or after.cut > 0.0:
        return now, 0.0
    by_heat = slope * loose  # place per content
    h = Four(by_heat, by_heat * sh, by_heat * sl, -way / dt)
    scatter = (ERROR * ERROR + WRONG * WRONG * beyond * beyond) * ALIKE / dt
    for i in range(COUNT):
        most = doubts[i] * doubts[i]
        s.spread[i, i] = min(s.spread[i, i] + most * dt / forget, most)
    g = Four(_row(s, BASE, h), _row(s, HEAT, h), _row(s, LOSS, h), _row(s, LAG, h))
    scatter += h.base * g.base + h.heat * g.heat + h.loss * g.loss + h.lag * g.lag
    by = beyond / scatter
    content = (sh * g.heat + sl * g.loss) * by
    turned, most = abs(g.base * by + content), SHARE * abs(turn)
    if turned > most:
        by, content = by * most / turned, content * most / turned
    _taken(s, BASE, g.base, g, by, scatter, FARTHEST * doubts[BASE])
    _taken(s, HEAT, g.heat, g, by, scatter, FARTHEST * doubts[HEAT])
    _taken(s, LOSS, g.loss, g, by, scatter, FARTHEST * doubts[LOSS])
    _taken(s, LAG, g.lag, g, by, scatter, FARTHEST * doubts[LAG])
    return now, content
