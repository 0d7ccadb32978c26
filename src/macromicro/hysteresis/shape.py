"""Constrained tables: monotone ones, and ones without negative relays."""

from __future__ import annotations

from typing import Any

import numpy as np

from macromicro.arrays import Array

ROUNDS = 800
ROUGH = 200  # these do to tell which of several tables predicts curves best
_WEIGHED = (20, 60, 150)  # after these rounds the weight is adjusted


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
