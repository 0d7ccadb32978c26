"""The Everett table: weight of the relays that a falling input releases.

``E(alpha, beta)`` is the weight of the triangle T(alpha, beta) of (2.8): relays that switch up at
or below `alpha` and down at or above `beta`; the whole plane weighs 1. For the first-order
descending curves of Section 2.4.1, outputs from 0 to 1,

    f_M = E(M, lo)    and    f_{M,m} = f_M - E(M, m).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.kernel import kernel


class Everett(NamedTuple):
    """A table of E on the uniform grid ``u_i = lo + i * step``, ``i = 0 .. n - 1``.

    ``values[i, j]`` is ``E(u_i, u_j)``, shape (n, n), float64, C order: 0 where i <= j, not
    decreasing in i, not increasing in j, 1 at ``[n - 1, 0]``. The relay density is constant in each
    square cell; diagonal cells are relays of zero width.

    Examples
    --------
    >>> from macromicro.hysteresis import from_density
    >>> table = from_density([[1.0, 0.0], [1.0, 1.0]], lo=0.0, step=5.0, n=3)
    >>> table.values[2].round(3).tolist()  # E(10, 0), E(10, 5), E(10, 10)
    [1.0, 0.333, 0.0]
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
        Of an input's range, as `from_density` makes it.
    alpha, beta : float
        Up and down threshold, unit of the input; clamped to the grid.

    Returns
    -------
    float
        Weight, 0 to 1; 0 where ``alpha <= beta`` or one is NaN.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.hysteresis import from_density, lookup
    >>> table = from_density(lambda alpha, beta: np.ones_like(alpha), lo=0.0, step=1.0, n=11)
    >>> round(lookup(table, 8.0, 2.0), 6)  # of a uniform density: (8 - 2)^2 / 10^2
    0.36
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
        Lowest input of the grid, unit of the input.
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
        A grid of no extent, a wrong shape, or no weight at all.
    ProblemError
        A negative or non-finite weight, or one above the diagonal.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.hysteresis import Preisach, from_density
    >>> table = from_density(lambda alpha, beta: np.ones_like(alpha), lo=0.0, step=1.0, n=11)
    >>> Preisach(table).run([8.0, 2.0]).round(6).tolist()
    [0.64, 0.28]
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
            remedy = "Set it to 0 where row < column."
            raise ProblemError("cell weights", "there is weight at alpha < beta", remedy)
    if not np.all(np.isfinite(weights)) or np.any(weights < 0.0):
        remedy = "Give finite weights of at least 0."
        raise ProblemError("relay density", "a weight is negative or not finite", remedy)
    values = np.zeros((n, n))
    # Summed over the rows below alpha, then over the columns above beta.
    values[1:, :-1] = np.cumsum(np.cumsum(weights, axis=0)[:, ::-1], axis=1)[:, ::-1]
    total = float(values[-1, 0])
    if not (total > 0.0 and math.isfinite(total)):
        raise InputError("relay density, total weight", total, "finite and above 0")
    return Everett(float(lo), float(step), int(n), values / total)
