"""Disturbances of a record: a force that is periodic in the position, and coloured noise.

Cogging of a motor, teeth of a belt or a gear: w = A sin(k x + phi). Noise as an autoregression,
D(z) e = w.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array

_LEAST, _MOST = 2.0, 2000.0  # periods in the range of places
_BINS = 16 * int(_MOST)  # of the range, in which forces are summed to be tried
_FINE = 6  # tried in a period more of that range
_SHARE = 0.3  # of the force's power: less may be chance
_ENOUGH = 20_000  # samples that are tried
_SAME = 1e-6  # a wave that the parameters can take
_EXACT = 1e-4  # of a step of what is tried
_CHANCE = 0.01  # at most, that a noise has such a share by chance


class Ripple(NamedTuple):
    turn: float  # k, rad per unit of place
    size: float  # A, unit of force
    # sine, cosine: A cos phi and A sin phi
    sine: float
    cosine: float

    def at(self, place: Array, shift: float | Array = 0.0) -> Array:
        angle = self.turn * place + shift
        return np.asarray(self.sine * np.sin(angle) + self.cosine * np.cos(angle))

    def turned(self, shift: float, times: float = 1.0) -> Ripple:
        cos, sin = times * float(np.cos(shift)), times * float(np.sin(shift))
        sine, cosine = self.sine * cos - self.cosine * sin, self.cosine * cos + self.sine * sin
        return Ripple(self.turn, self.size * abs(times), sine, cosine)


def ripple(force: list[Array], place: list[Array], taken: list[Array]) -> Ripple | None:
    """The periodic force that explains a large part of a residual."""
    from scipy.optimize import minimize_scalar

    every = max(sum(map(len, force)) // _ENOUGH, 1)
    x = np.concatenate([p[::every] for p in place])
    extent = float(np.ptp(x))
    if not extent > 0.0:
        return None
    basis = np.linalg.qr(_unit_columns(np.concatenate([t[::every] for t in taken])))[0]
    left = np.concatenate([f[::every] for f in force])
    left = left - basis @ (basis.T @ left)
    tried = np.arange(round(_LEAST * _FINE), round(_MOST * _FINE))
    at = int(np.argmax(_powers(tried, (x - x.min()) / extent, left, basis)))
    if at == 0:  # no period, but what varies along the travel more slowly than any
        return None
    step = 2.0 * np.pi / _FINE / extent
    # The best of a period more or less is next to the best of some; a peak is two steps wide.
    nearby = step * (tried[at] + np.linspace(-1.0, 1.0, 2 * _FINE + 1))
    near = float(max(nearby, key=lambda turn: _explained_power(turn, x, left, basis)[0]))
    far = nearby[1] - nearby[0]

    def missed(turn: float) -> float:
        return -_explained_power(float(turn), x, left, basis)[0]

    bounds, how = (near - far, near + far), {"xatol": _EXACT * step}
    best = float(minimize_scalar(missed, bounds=bounds, method="bounded", options=how).x)
    power, (sine, cosine) = _explained_power(best, x, left, basis)
    parts = np.split(left, np.cumsum([len(f[::every]) for f in force])[:-1])
    gone = sum(float(np.abs(np.diff(p)).sum()) for p in place)
    rare = _by_chance(parts, len(tried), best * gone / (2.0 * np.pi))
    if not power > max(_SHARE, rare) * float(left @ left):
        return None
    return Ripple(best, float(np.hypot(sine, cosine)), float(sine), float(cosine))


def _by_chance(left: list[Array], tried: int, passed: float) -> float:
    """The share of a noise's power that the best of several periods rarely exceeds.

    Of n independent values a sine and a cosine explain more than a share s with probability (1 -
    s)^(n/2 - 1).
    """
    # Slow noise has few independent values, but is no wave of which more periods were passed.
    many = max(sum(map(len, left)) / max(correlation_length(autoregression(left)), 1.0), passed)
    return float(1.0 - (_CHANCE / tried) ** (1.0 / max(0.5 * many - 1.0, 1.0)))


def _unit_columns(table: Array) -> Array:
    size = np.linalg.norm(table, axis=0)
    return table / np.where(size > 0.0, size, 1.0)


def _powers(tried: npt.NDArray[np.intp], part: Array, left: Array, basis: Array) -> Array:
    """Power explained by each period beside the parameters, by sums over bins of the range."""
    bins = np.minimum((part * _BINS).astype(np.intp), _BINS - 1)

    def waves(values: Array | None) -> Array:
        return np.asarray(np.fft.rfft(np.bincount(bins, values, _BINS), _FINE * _BINS))

    force = waves(left)[tried]
    taken = np.array([waves(column)[tried] for column in basis.T])
    twice = waves(None)[2 * tried]
    # Products of cosines and sines beside the parameters; waves are cosine - i sine.
    cosines = 0.5 * (len(part) + twice.real) - np.sum(taken.real**2, axis=0)
    sines = 0.5 * (len(part) - twice.real) - np.sum(taken.imag**2, axis=0)
    both = -0.5 * twice.imag + np.sum(taken.real * taken.imag, axis=0)
    c, s = force.real, -force.imag
    size = np.maximum(cosines * sines - both**2, _SAME * len(part) ** 2)
    return np.asarray((sines * c**2 + cosines * s**2 - 2.0 * both * c * s) / size)


def _explained_power(turn: float, x: Array, left: Array, basis: Array) -> tuple[float, Array]:
    """Power explained by a period beside the parameters, and its sine and cosine."""
    pair = np.stack([np.sin(turn * x), np.cos(turn * x)], axis=1)
    own = pair - basis @ (basis.T @ pair)
    found = np.linalg.lstsq(own, left, rcond=1e-6)[0]
    return float(left @ own @ found), found


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
