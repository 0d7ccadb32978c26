"""Sparse matrices of a table on its grid, and the laws that a table may have to obey.

Unknowns are the values below the diagonal, row by row; the rest is 0.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array

ROUNDS = 800
ROUGH = 200  # these do to tell which of several tables predicts curves best
_WEIGHED = (20, 60, 150)  # after these rounds the weight is adjusted
Index = npt.NDArray[np.int64]


class Grid(NamedTuple):
    """The table's grid: ``lo + i * step``, ``i = 0 .. n - 1``."""

    lo: float
    step: float
    n: int

    @property
    def nodes(self) -> Array:
        return self.lo + self.step * np.arange(self.n, dtype=np.float64)


def numbered(n: int) -> Index:
    ids = np.full((n, n), -1, dtype=np.int64)
    below = np.tri(n, k=-1, dtype=bool)
    ids[below] = np.arange(int(below.sum()))
    return ids


def readings(grid: Grid, ids: Index, alpha: Array, beta: Array) -> Any:
    """Rows that read E(alpha, beta), as `lookup`."""
    top = grid.n - 1.0
    x = np.clip((alpha - grid.lo) / grid.step, 0.0, top)
    y = np.clip((np.minimum(alpha, beta) - grid.lo) / grid.step, 0.0, top)
    i = np.minimum(x.astype(np.int64), grid.n - 2)
    j = np.minimum(y.astype(np.int64), grid.n - 2)
    diagonal = i == j
    p, q = x - i, y - j
    shares = []
    for di, dj, share in (
        (0, 0, (1.0 - p) * (1.0 - q)),
        (1, 0, np.where(diagonal, x - y, p * (1.0 - q))),
        (0, 1, (1.0 - p) * q),
        (1, 1, p * q),
    ):
        used = ~diagonal if (di, dj) != (1, 0) else np.ones_like(diagonal)
        shares.append((ids[i + di, j + dj], np.where(used, share, 0.0)))
    return _sparse(shares, alpha.size, int(ids.max()) + 1)


def densities(n: int, ids: Index) -> Any:
    """Rows that give the weights of the cells, row by row, c <= r."""
    r, c = np.nonzero(np.tri(n - 1, dtype=bool))
    shares = [(ids[r + di, c + dj], np.full(r.size, s)) for di, dj, s in _CORNERS]
    return _sparse(shares, r.size, int(ids.max()) + 1)


_CORNERS = ((1, 0, 1.0), (0, 0, -1.0), (1, 1, -1.0), (0, 1, 1.0))


def roughness(n: int) -> Any:
    """Differences between neighbouring cells off the diagonal, and along it."""
    r, c = np.nonzero(np.tri(n - 1, dtype=bool))
    ids = np.full((n, n), -1, dtype=np.int64)
    ids[r, c] = np.arange(r.size)
    pairs = []
    for dr, dc in ((1, 0), (0, 1), (1, 1)):
        on = (r == c) if dr == dc else (r > c) & (r + dr > c + dc)
        ok = on & (r + dr < n - 1)  # and c is at most r
        pairs.append((ids[r[ok], c[ok]], ids[r[ok] + dr, c[ok] + dc]))
    first, second = (np.concatenate(side) for side in zip(*pairs, strict=True))
    ones = np.ones(first.size)
    return _sparse([(first, -ones), (second, ones)], first.size, r.size)


def slopes(n: int, ids: Index) -> Any:
    """Differences that are at least 0 in a monotone table: along alpha, then against beta."""
    r, c = np.nonzero(np.tri(n, k=-1, dtype=bool))
    upper, right = ids[r - 1, c], ids[r, c + 1]  # on the diagonal -1: the table is 0 there
    here = np.concatenate([ids[r, c], ids[r, c]])
    ones = np.ones(here.size)
    return _sparse([(here, ones), (np.concatenate([upper, right]), -ones)], here.size, r.size)


def _sparse(shares: list[tuple[Index, Array]], rows: int, columns: int) -> Any:
    """Sum of sparse matrices, each with one column number (-1: none) and value per row."""
    import scipy.sparse as sp

    line = np.tile(np.arange(rows), len(shares))
    column = np.concatenate([c for c, _ in shares])
    value = np.concatenate([v for _, v in shares])
    used = column >= 0
    return sp.csr_array((value[used], (line[used], column[used])), shape=(rows, columns))


def solver(matrix: Any) -> Any:
    from scipy.sparse.linalg import splu

    options = {"SymmetricMode": True}
    factors = splu(
        matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options
    )
    return factors.solve


def bounded(
    matrix: Any,
    right: Array,
    bound: Any,
    offset: Array,
    scale: float,
    rho: float,
    rounds: int = ROUNDS,
) -> Array:
    """Minimiser of x'Hx/2 - r'x under Bx + b >= 0, by alternating directions (ADMM)."""
    # From the solution without bounds: what the bounds do not touch is right at once.
    z = np.maximum(bound @ solver(matrix)(right) + offset, 0.0)
    solve = solver(matrix + rho * (bound.T @ bound))
    dual = np.zeros(offset.size)
    x = np.zeros(right.size)
    for turn in range(rounds):
        x = solve(right + rho * (bound.T @ (z - dual - offset)))
        reached = bound @ x + offset
        old, eased = z, 1.6 * reached - 0.6 * z
        z = np.maximum(eased + dual, 0.0)
        dual = dual + eased - z
        primal = float(np.max(np.abs(reached - z)))
        change = float(np.max(np.abs(z - old)))
        if max(primal, change) < 1e-4 * scale:
            break
        if turn in _WEIGHED:
            factor = _factor(primal, change)
            rho, dual = rho * factor, dual / factor
            solve = solver(matrix + rho * (bound.T @ bound))
    return np.asarray(x, dtype=np.float64)


def _factor(primal: float, change: float) -> float:
    """Change of the weight that balances both errors."""
    ratio = primal / change if change > 0.0 else np.inf
    return 1.0 if 0.1 < ratio < 10.0 else float(min(max(ratio**0.5, 0.1), 10.0))


def monotone_hull(values: Array) -> Array:
    """The least monotone table above another, with its first column and last row."""
    column, row = values[:, :1].copy(), values[-1:, :].copy()
    hull = np.maximum.accumulate(np.maximum(values, 0.0), axis=0)
    hull = np.maximum.accumulate(hull[:, ::-1], axis=1)[:, ::-1]
    return np.tril(np.minimum(np.minimum(hull, column), row), -1)


def nonnegative_hull(values: Array) -> Array:
    """A table without negative cells, with the first column and last row of another."""
    # Negative cells are emptied; rows and columns are then scaled in turn until they match the
    # major loop.
    weights = np.maximum(cells(values), 0.0)
    rows, columns = np.diff(values[:, 0]), -np.diff(values[-1])
    # No row or column that must weigh something is left without any cell to scale.
    weights += 1e-12 * np.tril(np.outer(rows, columns))
    for _ in range(2000):
        weights *= _ratio(rows, weights.sum(axis=1))[:, None]
        sums = weights.sum(axis=0)
        weights *= _ratio(columns, sums)[None, :]
        if float(np.max(np.abs(sums - columns))) < 1e-15:
            break
    hull = np.zeros_like(values)
    hull[1:, :-1] = np.cumsum(np.cumsum(weights, axis=0)[:, ::-1], axis=1)[:, ::-1]
    return np.tril(hull, -1)


def _ratio(target: Array, found: Array) -> Array:
    return np.divide(target, found, out=np.zeros_like(target), where=found > 0.0)


def cells(values: Array) -> Array:
    """Weights of the cells; the inverse of the double sum."""
    return np.tril(values[1:, :-1] - values[:-1, :-1] - values[1:, 1:] + values[:-1, 1:])
