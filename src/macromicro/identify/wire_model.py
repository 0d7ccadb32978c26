"""Shape-memory wires: relays, heat and contraction, with a thermometer's table or without one.

Without a table the thresholds of contraction a and extension b < a scatter by two bell curves:

    mu(a, b) ~ p(a) q(b),    P(u) = (1 + exp(-(u - centre) / spread))^-skew

(factorised Preisach density: Bertotti and Mayergoyz, The Science of Hysteresis, vol. 1, 2006,
Section 1.3); generalised logistic of type I, whose median is `centre` only for skew 1.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.hysteresis.table import FodTable
from macromicro.kernel import compiled, kernel
from macromicro.models import stressed
from macromicro.models.actuator import Hysteresis
from macromicro.models.stressed import Stressed

_POINTS = 61  # of the table's grid
_FAR = 1e-3  # of a distribution is left out at either end
_PART = 0.15  # of the wire's time constant: the longest step


class Wire(NamedTuple):
    wires: Stressed  # heat, ladder and relays; contraction before thermal expansion
    expansion: float = 0.0  # thermal, mm/K
    # by which part the heat changes until full contraction, as their resistance does
    resistance: float = 0.0
    growth: float = 0.0  # relative increase of the heat loss above ambient, 1/K


def simulate(p: Wire, u: npt.ArrayLike, dt: float) -> Array:
    """Contraction from cold, mm; the drive acts without a lag and nothing cuts it."""
    sent = np.asarray(u, np.float64)
    most = _PART * p.wires.ladder.c1 * p.wires.ladder.r1
    parts = max(math.ceil(dt / most), 1)
    out = np.empty((2, len(sent)))
    compiled(_rollout)(p, stressed.cold(p.wires), np.ascontiguousarray(sent), parts, dt, out)
    return np.asarray(out[0] - p.expansion * out[1])


@kernel
def _rollout(
    p: Wire, s: stressed.StressedState, drive: Array, parts: int, dt: float, out: Array
) -> None:
    """Contraction [mm] and temperature rise [K] into `out` (2, n), in `parts` substeps."""
    table = p.wires.hysteresis
    for k in range(len(drive)):
        out[0, k] = s.x
        out[1, k] = s.wire
        given = stressed.static_heat(p.wires, drive[k])
        for _ in range(parts):
            heat = given * (1.0 + p.resistance * (s.x - table.low) / table.span)
            s = stressed.exchanged(p.wires, s, heat, heat, 0.0, p.growth, dt / parts)


def hysteresis(table: FodTable) -> Hysteresis:
    """The table in the form that the kernels take, mm."""
    return Hysteresis(table.everett(), table.f_low, table.span)


class Branch(NamedTuple):
    centre: float  # deg C
    spread: float  # K
    skew: float = 1.0  # 1 for a symmetric one; less has a longer tail below, more above


def median_at(centre: float, spread: float, skew: float) -> Branch:
    """The branch with its median, not its centre, at a temperature."""
    branch = Branch(centre, spread, skew)
    return branch._replace(centre=2.0 * centre - quantile(branch, 0.5))


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
