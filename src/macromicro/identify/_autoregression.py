"""A noise as an autoregression, D(z) e = w, and how long its values go together."""

from __future__ import annotations

import numpy as np

from macromicro.arrays import Array

MAX_ORDER = 30
_POINTS = 1 << 14  # of a spectrum


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


def correlation_length(noise: tuple[Array, float]) -> float:
    """Samples whose values go together: the spectrum at rest over its mean."""
    response = np.abs(np.fft.rfft(np.r_[1.0, noise[0]], _POINTS)) ** 2
    if not response.min() > 0.0:
        return float(np.inf)
    # Every frequency but rest and the highest stands for its negative, too.
    mean = (2.0 * np.sum(1.0 / response[1:-1]) + 1.0 / response[0] + 1.0 / response[-1]) / _POINTS
    return float(1.0 / (response[0] * mean))
