"""Relays of an alloy with unknown thresholds: two bell curves in place of a kiln's table.

    mu(a, b) ~ p(a) q(b),    P(u) = (1 + exp(-(u - centre) / spread))^-skew

for contraction at a and extension at b < a (factorised Preisach density: Bertotti and Mayergoyz,
The Science of Hysteresis, vol. 1, 2006, Section 1.3); generalised logistic of type I, whose median
is `centre` only for skew 1.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.hysteresis.table import FodTable

_POINTS = 61  # of the table's grid
_FAR = 1e-3  # of a distribution is left out at either end


class Branch(NamedTuple):
    centre: float  # deg C
    spread: float  # K
    skew: float = 1.0  # 1 for a symmetric one; less has a longer tail below, more above


def below(p: Branch, u: npt.ArrayLike) -> Array:
    z = (np.asarray(u, np.float64) - p.centre) / p.spread
    return np.asarray(np.exp(-p.skew * np.logaddexp(0.0, -z)))


def quantile(p: Branch, share: float) -> float:
    """Temperature below which a share of the thresholds lies, deg C."""
    return float(p.centre - p.spread * np.log(np.expm1(-np.log(share) / p.skew)))


def relays(up: Branch, down: Branch, low: float, stroke: float) -> FodTable:
    """The table of first-order curves of the density above; `low`, `stroke` in mm."""
    ends = [quantile(one, s) for one in (up, down) for s in (_FAR, 1.0 - _FAR)]
    grid, step = np.linspace(min(ends), max(ends), _POINTS, retstep=True)
    p, q = np.diff(below(up, grid)), np.diff(below(down, grid))
    cells = np.tril(np.outer(p, q))
    at = np.arange(len(p))
    cells[at, at] *= 0.5  # only b < a
    # E[i, j]: relays with both thresholds between u_j and u_i.
    total = np.zeros((_POINTS, _POINTS))
    total[1:, :-1] = np.cumsum(np.cumsum(cells, axis=0)[:, ::-1], axis=1)[:, ::-1]
    values = np.tril(total, -1)
    return FodTable(float(grid[0]), float(step), stroke * values / values[-1, 0], low)
