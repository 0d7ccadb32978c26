"""Gain crossover and phase margin from polynomials in z; PD design by phase margin.

Everything is evaluated on the unit circle with numpy. Polynomials: coefficients from the
highest power of z down.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.errors import InputError

Array = npt.NDArray[np.float64]

_GRID = 4000


class Crossover(NamedTuple):
    """A frequency [rad/s] where the open loop's gain is 1, and the phase margin [deg] there."""

    frequency: float
    phase_margin: float


class PdTaps(NamedTuple):
    """D(z) = (now z + before) / z [V/count]."""

    now: float
    before: float

    @property
    def proportional(self) -> float:
        """Static gain [V/count]."""
        return self.now + self.before

    def derivative_time(self, dt: float) -> float:
        """T_d [s] of D(z) = K (1 + T_d (z - 1) / (z dt)); below 0 where D lags."""
        return -self.before * dt / self.proportional


def damping_margin(ratio: float) -> float:
    """Phase margin [deg] of a second-order loop with this damping ratio (Section 4.3.2).

    atan(2 r / sqrt(sqrt(1 + 4 r^4) - 2 r^2)): 76.35 deg for 1. Raises InputError at 0 or less.
    """
    if not (ratio > 0.0 and math.isfinite(ratio)):
        raise InputError("damping ratio", ratio, "a finite number above 0")
    square = 2.0 * ratio**2
    # sqrt(1 + x^2) - x = 1 / (sqrt(1 + x^2) + x), without the loss of digits
    return math.degrees(math.atan(2.0 * ratio * math.sqrt(math.hypot(1.0, square) + square)))


def response(num: npt.ArrayLike, den: npt.ArrayLike, frequency: float, dt: float) -> complex:
    """num(z) / den(z) at z = exp(j frequency dt), frequency in rad/s."""
    z = np.exp(1j * frequency * dt)
    return complex(np.polyval(np.asarray(num), z) / np.polyval(np.asarray(den), z))


def crossovers(num: npt.ArrayLike, den: npt.ArrayLike, dt: float) -> list[Crossover]:
    """Every gain crossover of an open loop num/den, slowest first.

    Sought from 1e-5 of the Nyquist frequency up to it; roots to 1e-12. Two crossovers
    closer together than 0.3 % in frequency can be missed.
    """
    from scipy.optimize import brentq

    if not (dt > 0.0 and math.isfinite(dt)):
        raise InputError("crossovers: dt", dt, "above 0")
    nyquist = math.pi / dt
    grid = np.geomspace(1e-5 * nyquist, nyquist * (1.0 - 1e-9), _GRID)

    def level(frequency: float) -> float:
        return math.log(max(abs(response(num, den, frequency, dt)), 1e-300))

    z = np.exp(1j * grid * dt)
    gains = np.abs(np.polyval(np.asarray(num), z) / np.polyval(np.asarray(den), z))
    values = np.log(np.maximum(gains, 1e-300))
    found = []
    for k in range(_GRID - 1):
        if values[k] * values[k + 1] < 0.0:
            w = float(brentq(level, float(grid[k]), float(grid[k + 1]), xtol=1e-12, rtol=1e-12))
            at = response(num, den, w, dt)
            margin = (180.0 + math.degrees(np.angle(at)) + 180.0) % 360.0 - 180.0
            found.append(Crossover(w, margin))
    return found


def first_crossover(num: npt.ArrayLike, den: npt.ArrayLike, dt: float) -> Crossover:
    """The slowest gain crossover; InputError where the gain never is 1."""
    found = crossovers(num, den, dt)
    if not found:
        raise InputError("open loop", "gain never 1", "a gain that crosses 1")
    return found[0]


def open_loop(taps: PdTaps, num: npt.ArrayLike, den: npt.ArrayLike) -> tuple[Array, Array]:
    """D(z) of the taps times a plant num/den."""
    return (
        np.convolve([taps.now, taps.before], np.asarray(num, np.float64)),
        np.convolve([1.0, 0.0], np.asarray(den, np.float64)),
    )


def pd_by_margin(
    num: npt.ArrayLike, den: npt.ArrayLike, dt: float, frequency: float, margin: float
) -> PdTaps:
    """The taps that give a plant this crossover [rad/s] and phase margin [deg] exactly.

    Below the frequency where the plant alone has the margin, the controller must lag, and
    two taps do that only with opposed gains: see `lowest_frequency`.
    """
    _below_nyquist(frequency, dt)
    wanted = np.exp(1j * math.radians(margin - 180.0)) / response(num, den, frequency, dt)
    late = np.exp(-1j * frequency * dt)
    before = float(wanted.imag / late.imag)
    return PdTaps(float(wanted.real) - before * float(late.real), before)


def pd_by_time(
    num: npt.ArrayLike, den: npt.ArrayLike, dt: float, frequency: float, derivative_time: float
) -> PdTaps:
    """The taps with this crossover [rad/s] and derivative time [s]."""
    _below_nyquist(frequency, dt)
    share = derivative_time / dt
    shape = response([1.0 + share, -share], [1.0, 0.0], frequency, dt)
    gain = 1.0 / abs(shape * response(num, den, frequency, dt))
    return PdTaps(gain * (1.0 + share), -gain * share)


def lowest_frequency(num: npt.ArrayLike, den: npt.ArrayLike, dt: float, margin: float) -> float:
    """The frequency [rad/s] at which the plant alone has the margin [deg].

    It is the lowest at which a PD that leads, or does nothing, can give it; the plant's
    phase must fall with the frequency.
    """
    from scipy.optimize import brentq

    def excess(frequency: float) -> float:
        return math.degrees(np.angle(-response(num, den, frequency, dt))) - margin

    low, high = 1e-5 * math.pi / dt, 0.2 * math.pi / dt
    if not excess(low) > 0.0 > excess(high):
        raise InputError("phase margin", margin, "one that the plant passes through")
    return float(brentq(excess, low, high, xtol=1e-12))


def _below_nyquist(frequency: float, dt: float) -> None:
    if not 0.0 < frequency * dt < math.pi:
        raise InputError("crossover frequency", frequency, "above 0, below the Nyquist one")
