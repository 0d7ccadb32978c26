"""Covariance and standard errors of estimated parameters, including coloured residuals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.identify import _slow_levels
from macromicro.identify._restored import restored, takes

MAX_ORDER = 30
_MOST_OF = 0.999  # of the power of a noise: by what drove it so much before
_FLAT = 1e-12  # of the largest: variances that rounding has made
_LAGS = 0.75  # neighbours taken together: this times the cube root of the stretches


def robust_covariance(
    psi: Array,
    residual: Array,
    ends: npt.ArrayLike,
    weights: Array | None = None,
    regressors: Array | None = None,
) -> Array:
    """R^-1 S R^-T with R = psi' W phi and S = psi' W E W psi, E the covariance of residuals.

    Residuals are an autoregression D(z) e = w of Akaike's order (at most 30), so S = var(w) |F' W
    psi|^2, F' the filter 1 / D backwards; var(e) (psi' psi)^-1 for white ones (Ljung, System
    Identification, section 9.4). Corrected by `restored` and, for slow noise, `slow_levels`.
    """
    cuts = np.asarray(ends)[:-1]
    scale = np.sqrt(np.einsum("ij,ij->j", psi, psi))
    scale[scale == 0.0] = 1.0
    # Long records: no copy of the regressors that is not needed; scales go onto small matrices.
    heavy = psi if weights is None else psi * weights[:, None]
    guided = psi if regressors is None else regressors
    inverse = np.linalg.pinv(heavy.T @ guided / np.outer(scale, scale)) / np.outer(scale, scale)
    parts = np.split(heavy, cuts)
    left = np.split(residual, cuts)
    noise = autoregression(list(filter(len, left)))  # of a record that stands nothing is left
    n, p = psi.shape
    is_slow = n > p and _slow_levels.is_slow(n, noise)
    if is_slow:
        full = noise[0], noise[1] * n / (n - p)
    else:
        taken = np.split(guided if weights is None else guided * weights[:, None], cuts)
        full = noise[0], noise[1] * n / max(n - p, 1)
        if takes(noise, n, p):
            full = restored(noise, taken, [inverse @ part.T for part in parts])
    found = inverse @ driven(parts, full) @ inverse.T
    if is_slow:
        # What is quick of it the autoregression knows better.
        may = _slow_levels.levels(left, guided)
        slow = _slow_levels.covariance(inverse @ heavy.T, [len(e) for e in left], may)
        found = covering(found, slow)
    return np.asarray(found)


def driven(parts: Sequence[Array], noise: tuple[Array, float]) -> Array:
    """Covariance of sums of a noise, by its autoregression D(z) e = w."""
    from scipy.signal import lfilter

    d, power = noise
    top, p = np.concatenate([[1.0], d]), parts[0].shape[1]
    s = np.zeros((p, p))
    for part in filter(len, parts):
        answer = np.cumsum(lfilter([1.0], top, np.r_[1.0, np.zeros(len(part) - 1)]) ** 2)
        before = int(np.searchsorted(answer, _MOST_OF * answer[-1]))
        back = np.empty((p, len(part) + before))
        for column, row in zip(part.T, back, strict=True):  # one by one: records may be long
            row[:] = lfilter([1.0], top, np.r_[column[::-1], np.zeros(before)])
        s += back @ back.T
    return np.asarray(power * s)


def autoregression(residuals: list[Array]) -> tuple[Array, float]:
    """Coefficients of D(z) e = w by Burg's method (1967), always stable."""
    # Levinson's recursion on autocovariances is biased where a root is near the unit circle, as for
    # a slow disturbance. A record as short as the order contributes no more.
    n = sum(len(e) for e in residuals)
    last = max(min(MAX_ORDER, n // 10, max(len(e) for e in residuals) - 1), 0)
    d, power = np.zeros(0), sum(float(e @ e) for e in residuals) / n
    ahead, back = [e[1:] for e in residuals], [e[:-1] for e in residuals]
    best, least = (d, power), np.inf
    for order in range(last + 1):
        if order:
            shared = sum(float(f @ b) for f, b in zip(ahead, back, strict=True))
            each = sum(float(f @ f + b @ b) for f, b in zip(ahead, back, strict=True))
            if not each > 0.0:
                break
            k = -2.0 * shared / each
            d = np.concatenate([d + k * d[::-1], [k]])
            power *= 1.0 - k * k
            for i, (f, b) in enumerate(zip(ahead, back, strict=True)):
                ahead[i], back[i] = (f + k * b)[1:], (b + k * f)[:-1]
        if not power > 0.0:
            break
        score = n * np.log(power) + 2.0 * order
        if score < least:
            best, least = (d, power), score
    return best


def larger(one: Array, other: Array) -> Array:
    """A covariance with each standard error the larger of two."""
    size, bound = np.sqrt(np.diag(one)), np.sqrt(np.diag(other))
    wide = bound > size
    base = other if wide.sum() > len(size) // 2 else one
    scale = np.maximum(size, bound) / np.sqrt(np.diag(base))
    return np.asarray(base * np.outer(scale, scale))


def covering(one: Array, other: Array) -> Array:
    """A covariance that bounds two others in every combination of parameters."""
    size = np.sqrt(np.diag(one))
    size = np.where(size > 0.0, size, 1.0)
    power, turned = np.linalg.eigh(one / np.outer(size, size))
    root = turned * np.sqrt(np.maximum(power, _FLAT * power.max(initial=0.0)))
    back = np.linalg.pinv(root)
    ratio, across = np.linalg.eigh(back @ (other / np.outer(size, size)) @ back.T)
    wide = root @ across * np.sqrt(np.maximum(ratio, 1.0))
    return np.asarray(wide @ wide.T * np.outer(size, size))


def clustered(slopes: Array, residual: Array, starts: npt.ArrayLike) -> Array:
    """Covariance of least squares by the scatter of stretches of the data.

    B^-1 S B^-1 with B = J'J, and S the sum of products of the stretches' J'e (Liang and Zeger
    1986), those of neighbours with falling weights (Newey and West 1987).
    """
    at = np.asarray(starts)
    count, p = len(at), slopes.shape[1]
    scores = np.add.reduceat(slopes * residual[:, None], at, axis=0)
    s = scores.T @ scores
    for lag, weight in enumerate(_neighbours(count), 1):
        cross = scores[lag:].T @ scores[:-lag]
        s += weight * (cross + cross.T)
    inverse = np.linalg.pinv(slopes.T @ slopes)
    return np.asarray(inverse @ s @ inverse * (count / max(count - p, 1)))


def _neighbours(count: int) -> Array:
    """Weights of the products of neighbours by their distance."""
    last = int(_LAGS * np.cbrt(count))
    return np.asarray(1.0 - np.arange(1, last + 1) / (last + 1.0))


def standard_errors(slopes: Array) -> Array:
    """Standard errors for residuals of variance 1; columns are scaled."""
    size = np.linalg.norm(slopes, axis=0)
    moves = size > 0.0
    inverse = np.linalg.pinv(slopes[:, moves] / size[moves])
    found = np.full(len(size), np.inf)
    found[moves] = np.linalg.norm(inverse, axis=1) / size[moves]
    return found
