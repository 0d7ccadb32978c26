"""Disturbances of a mass from residuals: a force, white or slow, and sensor noise.

The force that explains a residual e is w = M d2e/dt2 + Fv de/dt + k e, with the spectrum

    S(f) = |K(f)|^2 (a + b / (1 + (f / c)^2)) + |A(f)|^2 s^2

a, b, c and s by Whittle's likelihood (Arkiv for Matematik 2, 1953, p. 423), restricted to what the
parameters cannot absorb (H. Patterson, R. Thompson, Biometrika 58, 1971, p. 545).
"""

# A short record determines a slow force poorly, so levels are drawn from the likelihood, flat in
# their logarithms (Metropolis et al. 1953 with Haario's adaptive steps, Bernoulli 7, 2001, p. 223).

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array

_BINS = 24  # per decade of frequency
_HANN = 2.0 / 3.0  # independent values of a tapered periodogram, per frequency
_LOWEST = 1  # frequency of a record: the next lower one is its mean
_ALIKE = 1e-6  # of the largest: columns, or combinations of them, that ask for no force
_LEAST = 1e-12  # of the largest: what a combination of columns weighs
_NONE = 1e-6  # of the least that is seen: a level that is as good as none
_MOST = (10.0, 100.0, 0.25, 10.0)  # a, b and s of the most that is seen, c of the sample rate
_TOP = 3  # bins at the highest frequencies, where the sensor is what shows
_BLIND = 1e-3  # of |K|^2's largest: below, no force shows
_LONGEST = 1.0  # of a record: a force that is slower is an offset
_BEGINS, _BURN, _STEPS, _ADAPT = 400, 3000, 6000, 500
_PENALTY = 1.5  # of a, b and c, times the logarithm of how many values there are (Schwarz 1978)


class Level(NamedTuple):
    white: float  # a, spectral density of a white force, N^2 s
    slow: float  # b, that of a slow force at rest, N^2 s
    corner: float  # c, where the slow force has half of it, Hz
    sensor: float  # s^2, variance of the sensor's noise


class Shown(NamedTuple):
    values: Array  # independent values in each bin
    f: Array  # frequency, Hz
    force: Array  # |K|^2
    sensor: Array  # |A|^2, times the sample time
    # periodograms and cross-periodograms of what each fitted parameter takes; the record's own is
    # last
    fitted: Array

    @property
    def power(self) -> Array:
        """Periodogram of the record, mean of each bin, N^2 s, shape (m,)."""
        return self.fitted[:, -1, -1]


def binned(w: Array, dt: float, force: Array, sensor: Array, taken: Array) -> Shown:
    """A record's periodogram in bins that widen with frequency."""
    n = len(w)
    taper = np.hanning(n + 2)[1:-1]
    # No mean is taken off: the ends of differentiated noise would be in it, and in the lowest bin.
    seen = np.fft.rfft(np.column_stack([taken, w]) * taper[:, None], axis=0)
    seen *= np.sqrt(dt / np.sum(taper**2))
    rows = np.arange(_LOWEST, len(seen) - 1)
    bins = np.floor(np.log10(rows) * _BINS)
    cuts = np.flatnonzero(np.diff(bins, prepend=-1.0))
    size = np.diff(np.append(cuts, len(rows)))
    f = np.arange(len(seen)) / (n * dt)
    f, force, sensor = (np.add.reduceat(a[rows], cuts) / size for a in (f, force, sensor * dt))
    products = np.einsum("ki,kj->kij", seen[rows].conj(), seen[rows]).real
    both = np.add.reduceat(products, cuts, axis=0) / size[:, None, None]
    return Shown(_HANN * size, f, force, sensor, both)


def levels(shown: Sequence[Shown], draws: int, longest: float, dt: float) -> list[Level]:
    """Drawn levels of the disturbance; no force if Schwarz's criterion is against one."""
    from scipy.optimize import minimize

    every = Shown(*(np.concatenate(each) for each in zip(*shown, strict=True)))
    low, high = _bounds(every, longest, dt)
    likely = _likelihood(every)
    random = np.random.default_rng(0)  # the same data give the same levels
    begin = max(random.uniform(low, high, (_BEGINS, len(low))), key=likely)
    best = minimize(lambda at: -likely(at), begin, method="Nelder-Mead").x.clip(low, high)
    alone = low.copy()
    alone[3] = np.log(np.average(every.power / every.sensor, weights=every.values))
    if likely(best) - likely(alone) < _PENALTY * np.log(every.values.sum()):
        return [Level(0.0, 0.0, 1.0 / dt, float(np.exp(alone[3])))] * draws
    kept = _wandered(likely, best, (low, high), random)
    picked = np.exp(kept[np.linspace(0, len(kept) - 1, draws).astype(int)])
    return [Level(*row) for row in picked.tolist()]


def _bounds(every: Shown, longest: float, dt: float) -> tuple[Array, Array]:
    """Logarithms of the least and largest levels."""
    force = every.power / np.maximum(every.force, _BLIND * every.force.max())
    sensor = every.power / every.sensor
    top = np.array([force.max(), force.max(), 1.0 / dt, sensor[-_TOP:].mean()])
    corner = 1.0 / (2.0 * np.pi * _LONGEST * longest)
    least = np.array([_NONE * force.min(), _NONE * force.min(), corner, _NONE * sensor.min()])
    return np.log(least), np.log(_MOST * top)


def _likelihood(every: Shown) -> Callable[[Array], float]:
    """Whittle's restricted likelihood by the logarithms of a, b, c and s^2."""
    values, f, force, sensor, fitted = every
    power = every.power
    floor = np.finfo(float).eps * power.max()
    basis = _told_apart(np.einsum("k,kij->ij", values, fitted[:, :-1, :-1]))
    taken = basis.T @ fitted[:, :-1, :-1] @ basis
    shared = fitted[:, :-1, -1] @ basis

    def likely(at: Array) -> float:
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            a, b, c, s = np.exp(at)
            spectrum = force * (a + b / (1.0 + (f / c) ** 2)) + sensor * s + floor
        if not np.isfinite(spectrum).all():  # a search knows no bounds
            return -np.inf
        weights = values / spectrum
        whole = -float(values @ np.log(spectrum) + weights @ power)
        size, turned = np.linalg.eigh(np.tensordot(weights, taken, 1))
        # Under a spectrum of a great range, columns that were told apart may be alike.
        size = np.maximum(size, _LEAST * size.max(initial=0.0))
        found = (weights @ shared) @ turned
        lost = float(np.sum(found**2 / size) - 0.5 * _HANN * np.log(size).sum())
        return whole + lost

    return likely


def _told_apart(products: Array) -> Array:
    """Independent unit combinations of columns, (p, q)."""
    size = np.sqrt(np.diag(products))
    used = np.flatnonzero(size > _ALIKE * size.max(initial=0.0))
    part = products[np.ix_(used, used)] / np.outer(size[used], size[used])
    power, turned = np.linalg.eigh(part)
    kept = power > _ALIKE * power.max(initial=0.0)
    basis = np.zeros((len(size), int(kept.sum())))
    basis[used] = turned[:, kept] / np.sqrt(power[kept]) / size[used, None]
    return basis


def _wandered(
    likely: Callable[[Array], float],
    begin: Array,
    bounds: tuple[Array, Array],
    random: np.random.Generator,
) -> Array:
    """A Metropolis random walk, shape (steps, p)."""
    p = len(begin)
    at, now = begin, likely(begin)
    kept: list[Array] = []
    root: Array = 0.1 * np.eye(p)
    for k in range(_BURN + _STEPS):
        if k and k % _ADAPT == 0 and k <= _BURN:
            seen = np.cov(np.array(kept[k // 2 :]).T)
            root = np.asarray(np.linalg.cholesky(2.38**2 / p * (seen + 1e-4 * np.eye(p))))
        new = at + root @ random.standard_normal(p)
        if (new >= bounds[0]).all() and (new <= bounds[1]).all():
            there = likely(new)
            if np.log(random.uniform()) < there - now:
                at, now = new, there
        kept.append(at)
    return np.array(kept[_BURN:])


def drawn(level: Level, n: int, dt: float, random: np.random.Generator) -> Array:
    from scipy.signal import lfilter

    keep = np.exp(-2.0 * np.pi * level.corner * dt)
    push = np.sqrt(level.slow / dt) * (1.0 - keep)
    start = push / np.sqrt(1.0 - keep * keep) * random.standard_normal()
    slow = lfilter([push], [1.0, -keep], random.standard_normal(n), zi=[keep * start])[0]
    return np.asarray(np.sqrt(level.white / dt) * random.standard_normal(n) + slow)
