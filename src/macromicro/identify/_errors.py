"""Covariance of a fit by clusters of its residuals, and its intervals."""

# Correlations of residuals within a piece of a record are unknown; those of different pieces are
# nearly independent. Each piece therefore counts once (`witnesses`).

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.identify import coverage, witnesses
from macromicro.identify.notices import DataWarning, notice

_TOGETHER = 0.98  # correlation of errors
_KNOWN = 0.02  # of a parameter: an error that does no harm, whatever it goes with
_BLIND = 1e-6  # of the largest singular value of the slopes: this way nothing moves
_MIXED = 0.1  # of the largest weight in what nothing shows


class Spread(NamedTuple):
    """Uncertainty of p parameters by k clusters."""

    covariance: Array  # (p, p), NaN for parameters that the records do not show
    shares: Array  # (k, p, p): each cluster's information within the covariance of white noise

    def factors(self, slopes: Array | None = None) -> Array:
        """Coverage factors of functions of the parameters, shape (2, q)."""
        table = np.eye(len(self.covariance)) if slopes is None else slopes
        weights = np.einsum("qi,kij,qj->kq", table, self.shares, table) ** 2
        total, spread = weights.sum(axis=0) ** 2, (weights**2).sum(axis=0)
        degrees = np.divide(total, spread, out=np.full(len(table), np.inf), where=spread > 0.0)
        return factors(degrees)


def factors(degrees: Array) -> Array:
    """Student's factors of intervals with the usual probabilities, shape (2, q)."""
    from scipy.stats import t

    within = [0.5 + 0.5 * share for share in coverage.SHARES]
    return np.array([t.ppf(p, np.maximum(degrees, 1.0)) for p in within])


def unknown(count: int) -> Spread:
    return Spread(np.full((count, count), np.nan), np.zeros((1, count, count)))


def spread(slopes: Array, residual: Array, edges: npt.ArrayLike) -> Spread:
    """Bias-reduced covariance by clusters of rows."""
    cuts = np.asarray(edges)
    size = np.linalg.norm(slopes, axis=0)
    seen = np.flatnonzero(size > 0.0)
    if not len(seen):
        return unknown(len(size))
    even = slopes[:, seen] / size[seen]
    parts = list(pairwise(cuts))
    information = np.stack([even[a:b].T @ even[a:b] for a, b in parts])
    scores = np.stack([even[a:b].T @ residual[a:b] for a, b in parts])
    told = witnesses.told(information, scores)
    inverse = np.linalg.pinv(information.sum(axis=0), hermitian=True)
    shares = inverse @ information @ inverse
    found = unknown(len(size))
    own, at = np.outer(size[seen], size[seen]), np.ix_(seen, seen)
    found.covariance[at] = told.covariance / own
    full = np.zeros((len(parts), len(size), len(size)))
    full[:, at[0], at[1]] = shares / own
    return Spread(found.covariance, full)


def blocks(count: int, many: int) -> npt.NDArray[np.intp]:
    """Edges of about equal parts of rows."""
    return np.unique(np.linspace(0, count, many + 1).round().astype(np.intp))


def unseen(slopes: Array, names: Sequence[str]) -> list[str]:
    """Parameters of which only a combination shows, also in words."""
    size = np.linalg.norm(slopes, axis=0)
    shown = [name for name, moves in zip(names, size > 0.0, strict=True) if moves]
    if not shown:
        return []
    lost: list[str] = []
    even = slopes[:, size > 0.0] / size[size > 0.0]
    values, ways = np.linalg.svd(even, full_matrices=False)[1:]
    for way in ways[values <= _BLIND * values[0]]:
        weight = np.abs(way)
        mixed = [n for n, w in zip(shown, weight, strict=True) if w > _MIXED * weight.max()]
        notice(
            DataWarning,
            f"{' and '.join(mixed)} cannot be separated in this record: only their "
            "combined effect shows, and they have no standard errors",
        )
        lost += mixed
    return lost


def mixed(found: Spread, names: Sequence[str], values: Array) -> None:
    """Warn of parameters that the records cannot separate."""
    known = np.sqrt(np.diag(found.covariance)) < _KNOWN * np.abs(values)
    # Of a few clusters two errors may go together by chance; by the slopes they do not.
    white = found.shares.sum(axis=0)
    size = np.sqrt(np.diag(white))
    with np.errstate(invalid="ignore", divide="ignore"):
        together = white / np.outer(size, size)
    for i in range(len(names)):
        for k in range(i):
            if abs(together[i, k]) > _TOGETHER and not (known[i] and known[k]):
                notice(
                    DataWarning,
                    f"{names[k]} and {names[i]} cannot be separated in this record "
                    f"(correlation {together[i, k]:.3f}); the printed errors hold for both "
                    "jointly",
                )
