"""First-order reversal curves of a wire over its heat (Mayergoyz 1986)."""

# The wire cools to a share of its travel and is warmed again. The heat follows from effort and
# measured contraction by the heat balance (`wire_model`), without a hysteresis model.

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.commission.stand import Record
from macromicro.commission.wire_model import Heat, thinned

_BEGUN, _HALF = 0.03, 0.5  # of a curve's rise: between these its slope is taken
_LEVELS = (0.3, 0.5, 0.7)  # of the way, at which ways down are compared


class Curve(NamedTuple):
    """A cooling branch, and the curve back up."""

    # heat, x: V and m, from contracted on
    heat: Array
    x: Array
    turn: int  # row from which the effort rises again


class Curves(NamedTuple):
    # heat (V) and contraction (m) of the first warming, from extended to contracted
    first: tuple[Array, Array]
    every: list[Curve]  # in their order; the last one goes down only


def warmed(p: Heat, record: Record) -> Array:
    """Heat along a record that begins cold."""
    dt = float(record.t[1] - record.t[0])
    gone = np.diff(record.x, prepend=record.x[0]) / p.way
    behind, h, around = p.share / (1.0 - p.share), 0.0, 0.0
    made = np.empty_like(record.x)
    for k, (u, dz) in enumerate(zip(record.u.tolist(), gone.tolist(), strict=True)):
        # tau dh + latent dz = ((1 - share) u - (h - s)) dt
        h += (((1.0 - p.share) * u - h + around) * dt - p.latent * dz) / p.tau
        around += (behind * (h - around) - around) * dt / p.slow
        made[k] = h
    return made


def curves(record: Record, p: Heat, dt: float) -> Curves:
    thin = thinned(record, dt)
    h = warmed(p, thin)
    rising = np.diff(thin.u) > 0.0
    turns = [0, *(np.flatnonzero(rising[1:] != rising[:-1]) + 1).tolist(), len(thin.t) - 1]
    tops, lows = turns[1::2], turns[2::2]
    ends = [*tops[1:], len(thin.t)]
    every = [
        Curve(h[top:end], thin.x[top:end], low - top)
        for top, low, end in zip(tops, lows, ends, strict=False)
    ]
    return Curves((h[: tops[0] + 1], thin.x[: tops[0] + 1]), every)


def slower(found: Curves) -> list[float]:
    """Additional heat of each curve over the branch for the first half of its rise."""
    made = []
    for one in found.every[:-1]:
        least = int(np.argmin(one.x))  # it goes on for a while after the effort has turned
        back, heat = one.x[least:], one.heat[least:]
        low = float(back[0])
        levels = [low + part * (float(back.max()) - low) for part in (_BEGUN, _HALF)]
        own, branch = (_span(*pair, levels) for pair in ((heat, back), found.first))
        made.append(own / branch)
    return made


def answer(record: Record, p: Heat, dt: float) -> float:
    """Additional effort of a law between the branches."""
    every = slower(curves(record, p, dt))
    return max(sum(every) / len(every), 1.0) if every else 1.0


def spread(found: Curves) -> float:
    """Scatter of the heats at which cooling branches pass equal positions."""
    top = max(float(one.x.max()) for one in found.every)
    most = 0.0
    for level in _LEVELS:
        at = [
            one.heat[int(np.argmax(one.x <= level * top))]
            for one in found.every
            if float(one.x.min()) < level * top
        ]
        most = max(most, float(np.ptp(at)) if at else 0.0)
    return most


def _span(heat: Array, x: Array, levels: list[float]) -> float:
    """Heat between two levels of contraction, V."""
    first, second = (heat[int(np.argmax(x >= level))] for level in levels)
    return max(float(second - first), 1e-9)
