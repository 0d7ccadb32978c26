"""Noise corrected for the part that fitted parameters absorb.

    e = (I - A B) n,  E n n' = V

The autocovariance of e is that of V less the sums along the diagonals of

    A B V + V B' A' - A B V B' A'

(to first order, as in restricted likelihood, H. Patterson, R. Thompson, Biometrika 58, 1971, p.
545).
"""

# Slow regressors absorb most of slow noise, so a noise model fitted to e is too weak there. The
# spectrum found is raised at each frequency by the ratio expected from V and the regressors.

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from macromicro.arrays import Array
from macromicro.identify._slow_levels import together

_LEAST = 0.01  # of what is known of a part of the spectrum: less taken is not worth the work
_POINTS = 1 << 13  # of a spectrum, at least


def restored(
    noise: tuple[Array, float], taken: Sequence[Array], solve: Sequence[Array]
) -> tuple[Array, float]:
    """An autoregression D(z) n = w of the noise, from that of the residual."""
    # k coefficients resolve k parts of a spectrum, and a noise correlated over m values has a part
    # of width 1/m at rest: n / k or n / m values determine one part. If the parameters are less
    # than a hundredth of these, the correction is nil.
    d, power = noise
    n, p = sum(map(len, taken)), taken[0].shape[1]
    k = len(d)
    if not takes(noise, n, p):
        return d, power * n / max(n - p, 1)
    size = max(_POINTS, 1 << (2 * max(map(len, taken)) - 1).bit_length())
    spectrum = _spectrum(noise, size)
    gamma = np.fft.irfft(spectrum)
    whole = gamma[: k + 1] * (1.0 - np.arange(k + 1) / n)
    left = whole - _gone(gamma, spectrum, taken, solve, k)
    if not left[0] > 0.0:
        return d, power * n / (n - p)
    more = _spectrum(_levinson(whole), size) / _spectrum(_levinson(left), size)
    d, power = _levinson(np.fft.irfft(spectrum * more)[: k + 1])
    return d, power * n / (n - k)


def takes(noise: tuple[Array, float], n: int, p: int) -> bool:
    """Whether parameters absorb a relevant part of a noise."""
    k = len(noise[0])
    return noise[1] > 0.0 and n > p + k and p * max(k, together(noise)) >= _LEAST * n


def _gone(
    gamma: Array, spectrum: Array, taken: Sequence[Array], solve: Sequence[Array], k: int
) -> Array:
    """Expected deficit of the residuals' autocovariance, k lags and zero."""
    n, size = sum(map(len, taken)), len(gamma)
    passed = [
        np.fft.irfft(np.fft.rfft(b, size, axis=1) * spectrum, axis=1)[:, : b.shape[1]].T
        for b in solve
    ]
    spread = np.sum([b @ v for b, v in zip(solve, passed, strict=True)], axis=0)
    found = np.zeros(k + 1)
    for a, v in zip(taken, passed, strict=True):
        other = 2.0 * v - a @ spread
        for lag in range(min(k + 1, len(a))):
            end = len(a) - lag
            both = np.sum(a[:end] * other[lag:]) + np.sum(other[:end] * a[lag:])
            found[lag] += 0.5 * both / n
    return found


def _spectrum(noise: tuple[Array, float], size: int) -> Array:
    """Power at frequencies from 0 to half the sampling frequency."""
    d, power = noise
    return np.asarray(power / np.abs(np.fft.rfft(np.r_[1.0, d], size)) ** 2)


def _levinson(gamma: Array) -> tuple[Array, float]:
    """Autoregression of an autocovariance, by Levinson's recursion."""
    d, power = np.zeros(0), float(gamma[0])
    for order in range(1, len(gamma)):
        if not power > 0.0:
            break
        last = -float(gamma[order] + d @ gamma[order - 1 : 0 : -1]) / power
        d = np.r_[d + last * d[::-1], last]
        power *= 1.0 - last * last
    return d, power
