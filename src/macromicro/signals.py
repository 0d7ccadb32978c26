"""Reference signals, sampled: pure functions of a time axis.

Every function takes `t` float64[n] in seconds and returns float64[n] in the unit of the
levels it is given (counts, metres, volts). An edge counts as reached one nanosecond
early, so that the rounding of k*dt never moves it by a sample.
"""

from __future__ import annotations

import math

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError

_EARLY = 1e-9


def times(duration: float, dt: float) -> Array:
    """The time axis 0, dt, 2 dt, ... before `duration`.

    Parameters
    ----------
    duration : float
        Length of the axis, s.
    dt : float
        Sample time, s.

    Returns
    -------
    ndarray, shape (n,)
        s.

    Raises
    ------
    InputError
        `duration` or `dt` is not a finite number above zero.
    """
    _positive("times: duration", duration)
    _positive("times: dt", dt)
    n = math.ceil(duration / dt - 1e-6)
    return np.arange(n, dtype=np.float64) * dt


def step(t: Array, size: float, at: float = 0.0) -> Array:
    """A step.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Time axis, s.
    size : float
        Level from `at` on; 0 before.
    at : float, optional
        Time of the step, s.

    Returns
    -------
    ndarray, shape (n,)
        In the unit of `size`.
    """
    return np.where(t + _EARLY >= at, float(size), 0.0)


def square(t: Array, amplitude: float, period: float, offset: float = 0.0) -> Array:
    """A square wave: `offset` + `amplitude` in the first half of every period, - in the second.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Time axis, s.
    amplitude : float
        Half the distance between the two levels.
    period : float
        Period of the wave, s.
    offset : float, optional
        Mean value.

    Returns
    -------
    ndarray, shape (n,)
        In the unit of `amplitude` and `offset`.

    Raises
    ------
    InputError
        `period` is not a finite number above zero.
    """
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

    Parameters
    ----------
    t : ndarray, shape (n,)
        Time axis, s.
    amplitude : float
        Amplitude of the first period; its sign is that of the first half.
    period : float
        Period of the wave, s.
    loss : float
        What the amplitude loses per period, zero or more.
    offset : float, optional
        Mean value.

    Returns
    -------
    ndarray, shape (n,)
        In the unit of `amplitude`, `loss` and `offset`.

    Raises
    ------
    InputError
        `period` is not a finite number above zero, or `loss` is negative.
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
    """A sine: `offset` + `amplitude` sin(2 pi `frequency` t + `phase`).

    Parameters
    ----------
    t : ndarray, shape (n,)
        Time axis, s.
    amplitude : float
        Peak value.
    frequency : float
        Frequency, Hz.
    offset : float, optional
        Mean value.
    phase : float, optional
        Phase at t = 0, rad.

    Returns
    -------
    ndarray, shape (n,)
        In the unit of `amplitude` and `offset`.

    Raises
    ------
    InputError
        `frequency` is not a finite number above zero.
    """
    _positive("sine: frequency", frequency)
    return offset + amplitude * np.sin(2 * np.pi * frequency * t + phase)


def pulse_train(
    t: Array, peak: float, period: float, duty: float = 0.5, base: float = 0.0
) -> Array:
    """Pulses: `peak` in the first part of every period, `base` for the rest.

    Appendix D cycles the actuator so: 150 encoder steps, 4 s, duty 0.5.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Time axis, s.
    peak : float
        Level within a pulse.
    period : float
        From pulse to pulse, s.
    duty : float, optional
        Share of a period that is a pulse, between 0 and 1.
    base : float, optional
        Level between pulses.

    Returns
    -------
    ndarray, shape (n,)
        In the unit of `peak` and `base`.

    Raises
    ------
    InputError
        `period` is not a finite number above zero, or `duty` is not between 0 and 1.
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
