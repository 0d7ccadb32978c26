"""The Everett table: how much of the relays' weight a falling input releases.

``E(alpha, beta)`` is the weight of the triangle T(alpha, beta) of (2.8): of all relays
that switch up at or below `alpha` and down at or above `beta`. The whole plane weighs 1.
In terms of the first-order descending curves of Section 2.4.1, with the output counted
from 0 (all relays down) to 1 (all up),

    f_M = E(M, lo)    and    f_{M,m} = f_M - E(M, m).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.kernel import kernel


class Everett(NamedTuple):
    """A table of E on the uniform grid ``u_i = lo + i * step``, ``i = 0 .. n - 1``.

    ``values[i, j]`` is ``E(u_i, u_j)``, shape (n, n), float64, C order: 0 where i <= j,
    not decreasing in i, not increasing in j, 1 at ``[n - 1, 0]``. `lo` and `step` have
    the unit of the input. Between grid lines `lookup` takes a relay density that is
    constant in each square cell; the weight of a cell on the diagonal lies on the
    diagonal itself, as relays of zero width.
    """

    lo: float
    step: float
    n: int
    values: Array


@kernel
def lookup(table: Everett, alpha: float, beta: float) -> float:
    """E(alpha, beta): bilinear off the diagonal, linear in ``alpha - beta`` on it.

    Parameters
    ----------
    table : Everett
        The table.
    alpha, beta : float
        Up and down threshold, unit of the input; clamped to the grid.

    Returns
    -------
    float
        Weight, 0 to 1; 0 where ``alpha <= beta`` or one is NaN.
    """
    if not alpha > beta:
        return 0.0
    # The reciprocal leaves a loop over one table; a division by the step would not.
    scale = 1.0 / table.step
    top = table.n - 1.0
    x = min(max((alpha - table.lo) * scale, 0.0), top)
    y = min(max((beta - table.lo) * scale, 0.0), top)
    i = min(int(x), table.n - 2)
    j = min(int(y), table.n - 2)
    if i == j:
        return float(table.values[i + 1, i]) * (x - y)
    x -= i
    y -= j
    near = float(table.values[i, j]) * (1.0 - x) + float(table.values[i + 1, j]) * x
    far = float(table.values[i, j + 1]) * (1.0 - x) + float(table.values[i + 1, j + 1]) * x
    return near * (1.0 - y) + far * y


def from_density(
    density: Callable[[Array, Array], Array] | Array, lo: float, step: float, n: int
) -> Everett:
    """The table of a relay density mu(alpha, beta), or of ready cell weights.

    Parameters
    ----------
    density : Callable[[Array, Array], Array] | Array
        A function receives alpha and beta (unit of the input) of the cells' centres of mass as two
        (n - 1, n - 1) arrays, alpha by row and beta by column, and returns the density there; what
        it says where alpha < beta is ignored. An array of that shape holds in ``[r, c]`` the weight
        of the relays whose up threshold lies in ``(u_r, u_(r+1))`` and down threshold in ``(u_c,
        u_(c+1))``: zero where r < c. Either is scaled to a total weight of 1.
    lo : float
        Lowest input of the grid.
    step : float
        From grid line to grid line, unit of the input.
    n : int
        Number of grid lines, at least 2.

    Returns
    -------
    Everett
        Normalised: the whole plane weighs 1.

    Raises
    ------
    InputError
        A grid of no extent, a wrong shape, a negative or non-finite weight, a weight above the
        diagonal, or no weight at all.
    """
    if n < 2:
        raise InputError("relay density, n", n, "at least 2 grid points")
    if not (math.isfinite(lo) and math.isfinite(step) and step > 0.0):
        raise InputError("relay density, grid", (lo, step), "a finite lo and a step above 0")
    cells = n - 1
    if callable(density):
        # A diagonal cell is half a square: its centre of mass lies a sixth off the middle.
        middle = lo + step * (np.arange(cells) + 0.5)
        aside = np.eye(cells) * (step / 6.0)
        found = np.asarray(density(middle[:, None] + aside, middle - aside), dtype=np.float64)
        if found.shape != aside.shape:
            raise InputError("relay density, shape", found.shape, f"{aside.shape}")
        weights = np.tril(found) * (1.0 - 0.5 * np.eye(cells))
    else:
        weights = np.asarray(density, dtype=np.float64)
        if weights.shape != (cells, cells):
            raise InputError("cell weights, shape", weights.shape, f"{(cells, cells)}")
        if np.any(np.triu(weights, 1) != 0.0):
            raise InputError("cell weights", "weight at alpha < beta", "zero where row < column")
    if not np.all(np.isfinite(weights)) or np.any(weights < 0.0):
        raise InputError("relay density", "negative or not finite", "finite weights of at least 0")
    values = np.zeros((n, n))
    # Summed over the rows below alpha, then over the columns above beta.
    values[1:, :-1] = np.cumsum(np.cumsum(weights, axis=0)[:, ::-1], axis=1)[:, ::-1]
    total = float(values[-1, 0])
    if not (total > 0.0 and math.isfinite(total)):
        raise InputError("relay density, total weight", total, "finite and above 0")
    return Everett(float(lo), float(step), int(n), values / total)
