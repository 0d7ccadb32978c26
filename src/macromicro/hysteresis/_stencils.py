"""Sparse matrices on the table's grid: values, density, slopes.

Unknowns are the values below the diagonal, row by row; the rest is 0.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array

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
