"""Reference signals, sampled: pure functions of a time axis.

Every function takes `t` float64[n] in seconds and returns float64[n] in the unit of the
levels it is given (counts, metres, volts). An edge counts as reached one nanosecond
early, so that the rounding of k*dt never moves it by a sample.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from macromicro.errors import InputError

Array = NDArray[np.float64]

_EARLY = 1e-9


def times(duration: float, dt: float) -> Array:
    """The time axis 0, dt, 2 dt, ... before `duration`, float64[n], s."""
    _positive("times: duration", duration)
    _positive("times: dt", dt)
    n = math.ceil(duration / dt - 1e-6)
    return np.arange(n, dtype=np.float64) * dt


def step(t: Array, size: float, at: float = 0.0) -> Array:
    """0 before the time `at` [s], `size` from then on."""
    return np.where(t + _EARLY >= at, float(size), 0.0)


def square(t: Array, amplitude: float, period: float, offset: float = 0.0) -> Array:
    """`offset` + `amplitude` in the first half of every `period` [s], - in the second."""
    _positive("square: period", period)
    half = np.floor((t + _EARLY) / (period / 2))
    return offset + amplitude * _sign(half)


def decaying_square(
    t: Array, amplitude: float, period: float, loss: float, offset: float = 0.0
) -> Array:
    """A square wave about `offset` whose amplitude falls by `loss` after every period.

    It keeps its sign and ends at `offset` when the amplitude is used up. With amplitude
    90 mm, loss 20 mm and offset 100 mm: 190, 10, 170, 30, 150, 50, ... as the
    macro-stage's test input of Chapter 6.
    """
    _positive("decaying_square: period", period)
    if not loss >= 0.0:
        raise InputError("decaying_square: loss", loss, "zero or more")
    half = np.floor((t + _EARLY) / (period / 2))
    size = np.maximum(abs(amplitude) - loss * np.floor(half / 2), 0.0)
    return offset + math.copysign(1.0, amplitude) * size * _sign(half)


def sine(
    t: Array, amplitude: float, frequency: float, offset: float = 0.0, phase: float = 0.0
) -> Array:
    """`offset` + `amplitude` sin(2 pi `frequency` t + `phase`); frequency in Hz, phase in rad."""
    _positive("sine: frequency", frequency)
    return offset + amplitude * np.sin(2 * np.pi * frequency * t + phase)


def pulse_train(
    t: Array, peak: float, period: float, duty: float = 0.5, base: float = 0.0
) -> Array:
    """`peak` for the first `duty` (0..1) of every `period` [s], `base` for the rest.

    Appendix D cycles the actuator so: 150 encoder steps, 4 s, duty 0.5.
    """
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
