"""Reference signals, sampled over a time axis `t` float64[n].

An edge counts as reached one nanosecond early, so that rounding of k*dt never shifts it.
"""

from __future__ import annotations

import math

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError

_EARLY = 1e-9


def times(duration: float, dt: float) -> Array:
    """The time axis 0, dt, 2 dt, ... before `duration`."""
    _positive("times: duration", duration)
    _positive("times: dt", dt)
    n = math.ceil(duration / dt - 1e-6)
    return np.arange(n, dtype=np.float64) * dt


def step(t: Array, size: float, at: float = 0.0) -> Array:
    return np.where(t + _EARLY >= at, float(size), 0.0)


def square(t: Array, amplitude: float, period: float, offset: float = 0.0) -> Array:
    """A square wave: `offset` + `amplitude` in the first half of every period, - in the second."""
    _positive("square: period", period)
    half = np.floor((t + _EARLY) / (period / 2))
    return offset + amplitude * _sign(half)


def decaying_square(
    t: Array, amplitude: float, period: float, loss: float, offset: float = 0.0
) -> Array:
    """A square wave about `offset` whose amplitude falls by `loss` after every period."""
    _positive("decaying_square: period", period)
    if not loss >= 0.0:
        raise InputError("decaying_square: loss", loss, "zero or more")
    half = np.floor((t + _EARLY) / (period / 2))
    size = np.maximum(abs(amplitude) - loss * np.floor(half / 2), 0.0)
    return offset + math.copysign(1.0, amplitude) * size * _sign(half)


def sine(
    t: Array, amplitude: float, frequency: float, offset: float = 0.0, phase: float = 0.0
) -> Array:
    """A sine: `offset` + `amplitude` sin(2 pi `frequency` t + `phase`)."""
    _positive("sine: frequency", frequency)
    return offset + amplitude * np.sin(2 * np.pi * frequency * t + phase)


def pulse_train(
    t: Array, peak: float, period: float, duty: float = 0.5, base: float = 0.0
) -> Array:
    """Pulses: `peak` in the first part of every period, `base` for the rest."""
    _positive("pulse_train: period", period)
    if not 0.0 < duty < 1.0:
        raise InputError("pulse_train: duty", duty, "between 0 and 1")
    early = t + _EARLY
    inside = early - np.floor(early / period) * period
    return np.where(inside < duty * period, float(peak), float(base))


def _sign(half: Array) -> Array:
    """+1 in even half periods, -1 in odd ones."""
    return 1.0 - 2.0 * np.mod(half, 2.0)


def _positive(where: str, value: float) -> None:
    if not (value > 0.0 and math.isfinite(value)):
        raise InputError(where, value, "a finite number above zero")
