"""Errors of a fit by clusters of its residuals, and their intervals.

Residuals within a piece, run, stroke, load or curve may be correlated in any way; those of
different ones are nearly independent, so each counts once. A sum of squares dominated by a few
clusters has few degrees of freedom (R. Bell, D. McCaffrey, Bias reduction in standard errors for
linear regression with multi-stage samples, Survey Methodology, 2002).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.identify.notices import DataWarning, notice

SHARES = (0.6827, 0.95)  # that the intervals are to hold
NORMAL = (1.0, 1.96)  # standard errors to each side, of normal errors
_AS_NORMAL = 0.1  # of a factor: less than that is alike
_LEAST = 1e-6  # of what a cluster leaves unfitted
_FLAT = 1e-12  # of the information on the best known combination
_TOGETHER = 0.98  # correlation of errors
_KNOWN = 0.02  # of a parameter: an error that does no harm, whatever it correlates with
_BLIND = 1e-6  # of the largest singular value of the slopes: this way nothing moves
_MIXED = 0.1  # of the largest weight in what nothing shows


Index = npt.NDArray[np.intp]


class Spread(NamedTuple):
    """Uncertainty of p parameters by k clusters."""

    covariance: Array  # (p, p), NaN for parameters that the records do not show
    shares: Array  # (k, p, p): each cluster's information within the covariance of white noise

    def of(self, slopes: Array) -> Spread:
        """Uncertainty of functions of the parameters by their slopes (q, p)."""
        unknown = np.isnan(np.diag(self.covariance))
        made = slopes @ np.nan_to_num(self.covariance) @ slopes.T
        lost = (slopes[:, unknown] != 0.0).any(axis=1)
        made[lost, :] = made[:, lost] = np.nan
        return Spread(made, slopes @ self.shares @ slopes.T)

    def some(self, kept: Index) -> Spread:
        """Uncertainty of some of the parameters."""
        at = np.ix_(kept, kept)
        return Spread(self.covariance[at], self.shares[:, at[0], at[1]])

    def among(self, places: Index, count: int) -> Spread:
        """Uncertainty of these as some of more parameters; the others are unknown."""
        made, at = unknown(count), np.ix_(places, places)
        made.covariance[at] = self.covariance
        shares = np.zeros((len(self.shares), count, count))
        shares[:, at[0], at[1]] = self.shares
        return made._replace(shares=shares)

    def degrees(self, slopes: Array | None = None) -> Array:
        """Degrees of freedom of functions of the parameters by their slopes (q, p)."""
        table = np.eye(len(self.covariance)) if slopes is None else slopes
        weights = np.einsum("qi,kij,qj->kq", table, self.shares, table) ** 2
        total, spread = weights.sum(axis=0) ** 2, (weights**2).sum(axis=0)
        whole = np.full(len(table), np.inf)
        return np.asarray(np.divide(total, spread, out=whole, where=spread > 0.0))

    def factors(self, slopes: Array | None = None) -> Array:
        """Coverage factors of these, shape (2, q)."""
        return factors(self.degrees(slopes))


def normal(count: int) -> Array:
    """Coverage factors of so many parameters with normal errors, shape (2, count)."""
    return np.repeat(np.array(NORMAL)[:, None], count, axis=1)


def factors(degrees: npt.ArrayLike) -> Array:
    """Student's factors of intervals with the usual probabilities, shape (2, q)."""
    from scipy.stats import t

    known = np.maximum(degrees, 1.0)
    each = zip(SHARES, NORMAL, strict=True)
    found = [np.where(np.isinf(known), own, t.ppf(0.5 + 0.5 * p, known)) for p, own in each]
    return np.array(found)


def within(degrees: float) -> float:
    """Half of a 95 % interval in standard errors."""
    return float(factors(degrees)[1])


def is_normal(factor: float) -> bool:
    """Whether a 95 % factor is about that of normal errors."""
    return math.isnan(factor) or abs(factor / NORMAL[1] - 1.0) <= _AS_NORMAL


def freedom(parts: Sequence[tuple[float, float]]) -> float:
    """Degrees of freedom of the root of a sum of squares (Welch 1947, Satterthwaite 1946)."""
    total = sum(error**2 for error, _ in parts) ** 2
    lost = sum(error**4 / degrees for error, degrees in parts)
    return total / lost if lost > 0.0 else math.inf


def errors(covariance: Array, slopes: Array) -> Array:
    """Standard errors of functions of the parameters, NaN where one of these has none."""
    found = []
    for row in slopes:
        at = np.flatnonzero(row)
        variance = float(row[at] @ covariance[np.ix_(at, at)] @ row[at])
        found.append(math.sqrt(variance) if variance >= 0.0 else math.nan)
    return np.array(found)


def half_widths(found: Spread, slopes: Array, hidden: Array, degrees: float) -> Array:
    """Halves of the 95 % intervals of functions of the parameters.

    Further standard errors, of so many degrees of freedom, add to those by the clusters.
    """
    own = errors(found.covariance, slopes)
    parts = zip(own.tolist(), found.degrees(slopes).tolist(), hidden.tolist(), strict=True)
    many = [freedom([(error, known), (more, degrees)]) for error, known, more in parts]
    return np.asarray(factors(many)[1] * np.hypot(own, hidden))


def normal_spread(covariance: Array, shares: Array | None = None) -> Spread:
    """The uncertainty by a covariance; of normal errors where no clusters are known."""
    return Spread(covariance, np.zeros((1, *covariance.shape)) if shares is None else shares)


def unknown(count: int) -> Spread:
    return Spread(np.full((count, count), np.nan), np.zeros((1, count, count)))


def by_scores(information: Array, scores: Array, prior: Array | None = None) -> Spread:
    """Bias-reduced covariance by each cluster's information (k, p, p) and score (k, p).

    A prior's information (p, p) adds to theirs.
    """
    total = information.sum(axis=0) + (0.0 if prior is None else prior)
    unit = np.sqrt(np.diag(total))
    unit = np.where(unit > 0.0, unit, 1.0)
    power, turned = np.linalg.eigh(total / np.outer(unit, unit))
    # What no cluster shows keeps an error that is large, but a number.
    back = (turned / np.sqrt(np.maximum(power, _FLAT * max(power[-1], _FLAT)))).T / unit
    shares = back @ information @ back.T
    sizes, turns = np.linalg.eigh(shares)
    grown = 1.0 / np.sqrt(np.maximum(1.0 - sizes, _LEAST))
    own = np.einsum(
        "kij,kj->ki", (turns * grown[:, None, :]) @ turns.transpose(0, 2, 1), scores @ back.T
    )
    parts = own @ back  # of each cluster in each parameter's error
    return Spread(np.asarray(parts.T @ parts), np.asarray(back.T @ shares @ back))


def spread(
    slopes: Array, residual: Array, edges: npt.ArrayLike, prior: Array | None = None
) -> Spread:
    """The same of a least-squares fit, by the edges of clusters of its rows."""
    size = np.linalg.norm(slopes, axis=0)
    seen = np.flatnonzero(size > 0.0)
    if not len(seen):
        return unknown(len(size))
    even = slopes[:, seen] / size[seen]
    parts = list(pairwise(np.asarray(edges)))
    found = by_scores(
        np.stack([even[a:b].T @ even[a:b] for a, b in parts]),
        np.stack([even[a:b].T @ residual[a:b] for a, b in parts]),
        None if prior is None else prior[np.ix_(seen, seen)] / np.outer(size[seen], size[seen]),
    )
    own = np.outer(size[seen], size[seen])
    return Spread(found.covariance / own, found.shares / own).among(seen, len(size))


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


def warn_of_mixture(found: Spread, names: Sequence[str], values: Array) -> None:
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
