"""Fit of a table to measured curves on its grid, and the laws that it may have to obey.

Unknowns are the values E[i, j] below the diagonal, row by row; the rest is 0. A measured point
(alpha, beta, f) gives F(alpha) - E(alpha, beta) = f, interpolated as in the model.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.hysteresis.curves import Curve, averaged

ROUNDS = 800
ROUGH = 200  # these do to tell which of several tables predicts curves best
_WEIGHED = (20, 60, 150)  # after these rounds the weight is adjusted
Index = npt.NDArray[np.int64]
_CORNERS = ((1, 0, 1.0), (0, 0, -1.0), (1, 1, -1.0), (0, 1, 1.0))
# A roughness of the density must be paid for at all, or nothing fills the gaps.
LEAST_SMOOTH = 0.3
_GUESSED = 0.1  # weight of a curve that nobody measured
_BETWEEN = 3  # curves between two neighbours
_LEVELS = 120
_LEAN = 1e-6
_LEAST = 0.02  # of the loop's height: a curve that falls by less has no levels


class Grid(NamedTuple):
    """The table's grid: ``lo + i * step``, ``i = 0 .. n - 1``."""

    lo: float
    step: float
    n: int

    @property
    def nodes(self) -> Array:
        return self.lo + self.step * np.arange(self.n, dtype=np.float64)


def number_nodes(n: int) -> Index:
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


def minimise(
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


def branches(curves: list[Curve], grid: Grid, monotone: bool) -> tuple[Array, Array, float]:
    """The rising and the falling branch at the nodes, and their mismatch."""
    # The rising branch passes through the curves' starts and follows the lowest curve below them;
    # the falling branch is the highest curve. A curve that ends early continues in parallel to the
    # next one that reaches further. Both end in negative saturation, the mean of all curves in the
    # lowest cell. A mismatch within the scatter moves the end alone; a larger one is drift,
    # distributed linearly.
    width = 0.5 * grid.step
    starts = np.array([curve.u[0] for curve in curves])
    lowest = _main_curve(curves, grid)
    below = grid.nodes < starts[0]
    u = np.concatenate([grid.nodes[below], starts])
    f = np.concatenate([lowest[below], [_edge(curve.u, curve.f, grid.step) for curve in curves]])
    rising = _interpolate(*averaged(u, f, width), grid.nodes, monotone)
    falling = _main_curve(curves[::-1], grid)
    falling += rising[-1] - falling[-1]
    gap = float(rising[0] - falling[0])
    lowest_input = min(float(curve.u[-1]) for curve in curves)
    reach = [curve for curve in curves if curve.u[-1] <= lowest_input + grid.step]
    low = float(np.mean([_edge(curve.u[::-1], curve.f[::-1], grid.step) for curve in reach]))
    rising, falling = (
        _corrected_end(rising, low, curves[0]),
        _corrected_end(falling, low, curves[-1]),
    )
    if monotone:
        rising, falling = _isotonic(rising), _isotonic(falling)
        falling = np.minimum(np.maximum(falling, rising), rising[-1])
        falling[0] = rising[0]
    return rising, falling, gap


def _main_curve(curves: list[Curve], grid: Grid) -> Array:
    """The first curve at the nodes, continued in parallel to the next that reaches further."""
    nodes = grid.nodes
    slack = 1e-9 * grid.step
    steps = np.full(grid.n - 1, np.nan)
    levels = []
    for curve in curves:
        u, f = averaged(curve.u, curve.f, 0.5 * grid.step)
        f[-1] = _edge(curve.u, curve.f, grid.step)
        f[0] = _edge(curve.u[::-1], curve.f[::-1], grid.step)
        at = _interpolate(u, f, nodes, False)
        covered = (nodes[:-1] >= u[0] - slack) & (nodes[1:] <= u[-1] + slack)
        steps = np.where(np.isnan(steps) & covered, np.diff(at), steps)
        levels.append(at)
    path = np.concatenate([[0.0], np.cumsum(np.nan_to_num(steps))])
    first = curves[0].u
    anchor = int(np.argmin(np.abs(nodes - 0.5 * (first[0] + first[-1]))))
    return np.asarray(levels[0][anchor] + path - path[anchor], dtype=np.float64)


def _edge(u: Array, f: Array, width: float) -> float:
    """Output at the first point, by a line through dense points near it."""
    near = np.abs(u - u[0]) <= width
    if np.unique(u[near]).size < 8:
        return float(np.mean(f[u == u[0]]))
    return float(np.polyfit(u[near] - u[0], f[near], 1)[1])


def _corrected_end(branch: Array, low: float, curve: Curve) -> Array:
    """The branch corrected to end at `low`; `curve` is its source there."""
    miss = low - branch[0]
    if abs(miss) > 4.0 * _scatter(curve):
        branch = branch + miss * (1.0 - np.arange(branch.size) / (branch.size - 1))
    return np.asarray(np.concatenate([[low], branch[1:]]), dtype=np.float64)


def _scatter(curve: Curve) -> float:
    """Standard deviation of the outputs' noise, from each point against its neighbours."""
    u, f = averaged(curve.u, curve.f, 1e-9 * float(np.ptp(curve.u)))
    if u.size < 8:
        return 0.0
    share = (u[1:-1] - u[:-2]) / (u[2:] - u[:-2])
    aside = f[1:-1] - (1.0 - share) * f[:-2] - share * f[2:]
    sizes = np.abs(aside) / np.sqrt(1.0 + share**2 + (1.0 - share) ** 2)
    return 1.4826 * float(np.median(sizes))


def _interpolate(u: Array, f: Array, at: Array, monotone: bool) -> Array:
    """Shape-preserving cubic through (u, f), constant beyond its ends."""
    from scipy.interpolate import PchipInterpolator

    if u.size < 2:
        return np.full(at.shape, f[0])
    f = _isotonic(f) if monotone else f
    return np.asarray(PchipInterpolator(u, f)(np.clip(at, u[0], u[-1])), dtype=np.float64)


def _isotonic(f: Array) -> Array:
    from scipy.optimize import isotonic_regression

    return np.asarray(isotonic_regression(f).x, dtype=np.float64)


# The major loop is found first and fixed. Differences between neighbouring cells' weights are kept
# small; diagonal cells, relays of zero width, are compared among themselves.
def fit_everett(
    curves: list[Curve],
    grid: Grid,
    loop: tuple[Array, Array],
    shape: str,
    smooth: float,
    between: Sequence[Curve] = (),
    rounds: int = ROUNDS,
) -> Array:
    """E at the grid points, for outputs scaled so that the major loop is 0 to 1."""
    import scipy.sparse as sp

    n = grid.n
    rising, falling = loop
    ids = number_nodes(n)
    below = ids >= 0
    held = np.full((n, n), np.nan)
    held[n - 1, :-1] = falling[-1] - falling[:-1]
    held[1:, 0] = rising[1:] - rising[0]
    # Below the lowest reversal nothing is known of any hysteresis, so there is none.
    single = grid.nodes[:-1] <= min(curve.u[0] for curve in curves)
    held[:-1][single] = (rising[:-1, None] - rising[None, :])[single]
    known = held[below]
    free = np.isnan(known)

    every = [*curves, *between]
    alpha = np.concatenate([np.full(c.u.size, c.u[0]) for c in every])
    beta = np.concatenate([c.u for c in every])
    f = np.concatenate([c.f for c in every])
    rows = readings(grid, ids, alpha, beta)
    weight = _even_weights(every, grid)
    weight[sum(c.u.size for c in curves) :] *= _GUESSED
    branch = np.interp(alpha, grid.nodes, rising)
    density = densities(n, ids)
    rough = roughness(n) @ density
    price = max(smooth, LEAST_SMOOTH) ** 6
    normal = rows.T @ sp.diags_array(weight) @ rows
    normal = (normal + price * (rough.T @ rough) + 1e-3 * price * (density.T @ density)).tocsr()
    known = np.where(free, 0.0, known)
    right = (rows.T @ (weight * (branch - f)) - normal @ known)[free]
    matrix = normal[free][:, free]

    values = np.zeros((n, n))
    if shape == "free":
        known[free] = solver(matrix)(right)
        values[below] = known
        return values
    if shape == "nonnegative":
        bound, scale, rho = density, 1.0 / n**2, 0.05 * n**2
    else:
        bound, scale, rho = slopes(n, ids), 1.0 / n, 1.0
    known[free] = minimise(matrix, right, bound[:, free], bound @ known, scale, rho, rounds)
    values[below] = known
    if shape == "monotone":
        return monotone_hull(values)
    return nonnegative_hull(values)


def _even_weights(curves: list[Curve], grid: Grid) -> Array:
    """Weights so that each curve counts once per cell."""
    weights = []
    for curve in curves:
        cell = np.floor((curve.u - grid.lo) / grid.step).astype(np.int64)
        _, index, counts = np.unique(cell, return_inverse=True, return_counts=True)
        weights.append(1.0 / counts[index])
    return np.concatenate(weights)


def along_output(curves: list[Curve], nodes: Array, rising: Array) -> list[Curve]:
    """Curves between neighbours, interpolated along the output: for steep branches."""
    # Smooth interpolation in the input would split a steep branch between two curves into two half
    # steps. Here the inputs at which both curves reach a share of their fall are interpolated.
    low, height = float(rising[0]), float(rising[-1] - rising[0])
    share = np.linspace(1.0, 0.0, _LEVELS)
    found = []
    for first, second in pairwise(curves):
        ways = [_inputs(curve, low, share) for curve in (first, second)]
        if min(float(c.f[0]) - low for c in (first, second)) < _LEAST * height:
            continue
        for k in range(1, _BETWEEN + 1):
            w = k / (_BETWEEN + 1)
            u = (1.0 - w) * ways[0] + w * ways[1]
            top = float(np.interp(u[0], nodes, rising))
            found.append(Curve(u, low + share * (top - low)))
    return found


def _inputs(curve: Curve, low: float, share: Array) -> Array:
    """Inputs at which given shares of a curve's fall remain."""
    left = (curve.f - low) / max(float(curve.f[0]) - low, 1e-300)
    # Noise makes a curve rise for a moment, or stand: it falls a little at every point.
    left = np.minimum.accumulate(left) - np.linspace(0.0, _LEAN, left.size)
    return np.asarray(np.interp(-share, -left, curve.u))
