"""Noise as slow as the record, by an autoregression of what a fit leaves.

A record that is ten correlation times long holds ten independent values of its noise. What was
fitted has taken part of them, so that residuals show it quicker than it is. By how much is found by
drawing such noise anew and fitting each draw (a bootstrap: B. Efron, R. Tibshirani, An Introduction
to the Bootstrap, 1993, chapter 6). `slow_levels` needs no draws where errors follow from the noise
as a sum.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array

_SLOW = 0.01  # of the samples: noise whose correlation is longer is slow
_DRAWS, _FEWEST, _WORK = 80, 20, 4_000_000  # draws; fewer of long records, by samples in all
_BURN = 3  # correlations before a draw begins
_POINTS = 1 << 14  # of a spectrum

Noise = tuple[Array, float]  # D of D(z) e = w, and the variance of w
Model = Callable[[list[Array]], Noise]  # of the residuals of each record


class Fit(NamedTuple):
    """How parameters follow from noise.

    Attributes
    ----------
    lengths : list[int]
        Samples of each record.
    solve : ndarray, shape (p, n)
        From noise to errors of the parameters.
    guided : ndarray, shape (n, p)
        What these errors take off the noise.
    """

    lengths: list[int]
    solve: Array
    guided: Array


def is_slow(n: int, noise: Noise) -> bool:
    """Whether a noise is so slow that residuals show too little of it, and can be drawn anew.

    Parameters
    ----------
    n : int
        Samples in all.
    noise : tuple[ndarray, float]
        As the residuals show it.

    Returns
    -------
    bool
        False of records that are too long to try.
    """
    return _draws(n) >= _FEWEST and noise[1] > 0.0 and _SLOW * n < together(noise) < np.inf


def unshown(fit: Fit, noise: Noise, model: Model, random: np.random.Generator) -> list[Noise]:
    """Noises whose residuals may have shown the one that was seen.

    What residuals show of noise as slow as this one scatters, and is too quick on the whole. What
    was seen is taken to be off by as much as each of these is.

    Parameters
    ----------
    fit : Fit
        How parameters follow from noise.
    noise : tuple[ndarray, float]
        As the residuals show it; slow.
    model : Callable[[list[Array]], tuple[ndarray, float]]
        How it was found from residuals.
    random : np.random.Generator
        Draws.

    Returns
    -------
    list[tuple[ndarray, float]]
        Slower or quicker, at the same power of what drives it; none goes together for much longer
        than the records do, for that is a constant.
    """
    n = len(fit.guided)
    seen = together(noise)
    shown = [together(model(left)) for left, _ in _drawn(fit, [noise] * _draws(n), random)]
    return [_slowed(noise, min(seen / one, n / seen)) for one in shown]


def _draws(n: int) -> int:
    return min(_DRAWS, _WORK // max(n, 1))


def together(noise: Noise) -> float:
    """Samples of noise that go together: its spectrum at rest over the mean of it.

    Parameters
    ----------
    noise : tuple[ndarray, float]
        D, and the variance of what drives it.

    Returns
    -------
    float
        1 of white noise.
    """
    response = np.abs(np.fft.fft(np.r_[1.0, noise[0]], _POINTS)) ** 2
    return float(1.0 / (response[0] * np.mean(1.0 / response))) if response.min() > 0.0 else np.inf


def _slowed(noise: Noise, by: float) -> Noise:
    """The same with its slowest real root nearer to 1, by this factor; none beyond zero."""
    d, power = noise
    roots = np.roots(np.r_[1.0, d])
    real = np.flatnonzero((np.abs(roots.imag) < 1e-9) & (roots.real > 0.0))
    if not len(real):
        return noise
    at = real[np.argmax(roots[real].real)]
    roots[at] = max(1.0 - (1.0 - roots[at].real) / by, 0.0)
    return np.real(np.poly(roots))[1:], power


def _drawn(
    fit: Fit, noises: list[Noise], random: np.random.Generator
) -> Iterator[tuple[list[Array], Array]]:
    """Residuals of each record, and errors of the parameters, of a draw of each noise."""
    from scipy.signal import lfilter

    for d, power in noises:
        burn = int(min(_BURN * together((d, power)), 3 * len(fit.guided)))
        every = np.concatenate([
            lfilter([power**0.5], np.r_[1.0, d], random.standard_normal(m + burn))[burn:]
            for m in fit.lengths
        ])  # fmt: skip
        off = fit.solve @ every
        yield np.split(every - fit.guided @ off, np.cumsum(fit.lengths)[:-1]), off
