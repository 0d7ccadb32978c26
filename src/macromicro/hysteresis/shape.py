"""Tables that obey a law: monotone ones, and ones without negative relays."""

from __future__ import annotations

from typing import Any

import numpy as np

from macromicro.arrays import Array

ROUNDS = 800
ROUGH = 200  # these do to tell which of several tables predicts curves best
_WEIGHED = (20, 60, 150)  # after these rounds the weight is adjusted


def solver(matrix: Any) -> Any:
    """A factorised matrix.

    Parameters
    ----------
    matrix : Any
        Sparse, symmetric, positive definite, shape (m, m).

    Returns
    -------
    Any
        A function that solves ``matrix @ x = b`` for b of shape (m,).
    """
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
    """Minimiser of x'Hx/2 - r'x under Bx + b >= 0, by alternating directions (ADMM).

    x solves the problem with a copy z of Bx + b held near it, z is the copy without its negative
    part, and the multipliers add up what they differ by.

    Parameters
    ----------
    matrix : Any
        H, sparse, symmetric, positive definite, shape (m, m).
    right : ndarray, shape (m,)
        r.
    bound : Any
        B, sparse, shape (k, m).
    offset : ndarray, shape (k,)
        b.
    scale : float
        Usual size of Bx + b; the bound is met to a ten-thousandth of it, or as far as `rounds` go.
    rho : float
        Weight that holds z to Bx + b at first; it is adjusted, only the speed depends on it.
    rounds : int, optional
        Of the iteration, at most.

    Returns
    -------
    ndarray, shape (m,)
        x.
    """
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
    """By how much the weight should rise: both errors are to shrink alike, roughly."""
    ratio = primal / change if change > 0.0 else np.inf
    return 1.0 if 0.1 < ratio < 10.0 else float(min(max(ratio**0.5, 0.1), 10.0))


def monotone_hull(values: Array) -> Array:
    """The least table above another that is monotone, cut to its first column and last row.

    Parameters
    ----------
    values : ndarray, shape (n, n)
        E, 0 on and above the diagonal.

    Returns
    -------
    ndarray, shape (n, n)
        Not decreasing in the row, not increasing in the column.
    """
    column, row = values[:, :1].copy(), values[-1:, :].copy()
    hull = np.maximum.accumulate(np.maximum(values, 0.0), axis=0)
    hull = np.maximum.accumulate(hull[:, ::-1], axis=1)[:, ::-1]
    return np.tril(np.minimum(np.minimum(hull, column), row), -1)


def nonnegative_hull(values: Array) -> Array:
    """A table without negative cells, with the first column and last row of another.

    Negative cells are emptied; rows and columns are then scaled in turn until they weigh what the
    two branches of the major loop say, to rounding where such a table exists.

    Parameters
    ----------
    values : ndarray, shape (n, n)
        E, 0 on and above the diagonal.

    Returns
    -------
    ndarray, shape (n, n)
        All cells weigh 0 or more.
    """
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
    """Weights of the cells; the inverse of the double sum.

    Parameters
    ----------
    values : ndarray, shape (n, n)
        E, 0 on and above the diagonal.

    Returns
    -------
    ndarray, shape (n - 1, n - 1)
        Row by alpha, column by beta; 0 above the diagonal.
    """
    return np.tril(values[1:, :-1] - values[:-1, :-1] - values[1:, 1:] + values[:-1, 1:])
