"""The linear loop of an axis: its cascade over the frequency, whether it is stable, how robust."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.control.cascade import Cascade
from macromicro.control.notch import Notch

Complex = npt.NDArray[np.complex128]

NO_NOTCH = Notch()
MODULUS = 0.5  # least distance of a good loop from -1
_POINTS = 3000


def law(p: Cascade, frequency: Array, dt: float) -> Complex:
    """Effort per position error of the cascade, without its limits and feed-forward.

    Parameters
    ----------
    p : Cascade
        Gains.
    frequency : ndarray, shape (n,)
        Hz.
    dt : float
        Control period, s.

    Returns
    -------
    ndarray of complex, shape (n,)
        V/m.
    """
    z = np.exp(2j * math.pi * np.asarray(frequency) * dt)
    back = 1.0 - 1.0 / z
    pole = math.exp(-p.observer * dt)
    place, rate = 1.0 - pole * pole, (1.0 - pole) ** 2 / dt
    # The observer's corrected speed per position, from its two difference equations.
    seen = rate / back / (1.0 + (place + dt * rate / back) / (z - 1.0))
    found: Complex = p.velocity * (1.0 + p.integral * dt / back) * (p.position + seen)
    return found * notched(p.notch, frequency, dt)


def stepped(s: Complex, timing: Any) -> Complex:
    """An effort's way through a D/A that holds it for a period, and its delay.

    Parameters
    ----------
    s : ndarray of complex, shape (n,)
        2j pi times the frequency, rad/s.
    timing : Any
        With `period` and `delay`, s.

    Returns
    -------
    ndarray of complex, shape (n,)
        1 at low frequencies.
    """
    turn = s * timing.period
    found: Complex = (1.0 - np.exp(-turn)) / turn * np.exp(-s * timing.delay)
    return found


def notched(p: Notch, frequency: Array, dt: float) -> Complex:
    """What a notch lets pass.

    Parameters
    ----------
    p : Notch
        The filter.
    frequency : ndarray, shape (n,)
        Hz.
    dt : float
        Control period, s.

    Returns
    -------
    ndarray of complex, shape (n,)
        1 without a notch, or with one that `notch.step` leaves out.
    """
    f = np.asarray(frequency, dtype=np.float64)
    if p.frequency <= 0.0 or 2.0 * p.frequency * dt >= 1.0:
        return np.ones(len(f), np.complex128)
    # The bilinear transform's frequencies, that of the middle being 1.
    w: Array = np.tan(math.pi * f * dt) / math.tan(math.pi * p.frequency * dt)
    deep, wide = 2j * p.depth * p.width * w, 2j * p.width * w
    passed: Complex = np.asarray((1.0 - w * w + deep) / (1.0 - w * w + wide), np.complex128)
    return passed


def modulus(loop: Complex, poles: int = 2) -> float:
    """Least distance of a loop from -1, with its sign below 0 where the closed loop is unstable.

    By Nyquist: of a loop with poles at 0 and none in the right half, 1 + L turns by a quarter of a
    turn for each of them from the lowest frequency to the highest.

    Parameters
    ----------
    loop : ndarray of complex, shape (n,)
        Over frequencies that rise from far below all poles but those at 0 to half the loop's.
    poles : int, optional
        How many there are at 0.

    Returns
    -------
    float
        Above 0: stable.
    """
    turned = np.unwrap(np.angle(1.0 + loop))
    least = float(np.min(np.abs(1.0 + loop)))
    off = turned[-1] - turned[0] - 0.5 * math.pi * poles
    return least if abs(off) < 0.5 * math.pi else -least


@lru_cache(maxsize=1024)
def grid(dt: float, slowest: float) -> Array:
    """Frequencies for `modulus`.

    Parameters
    ----------
    dt : float
        Control period, s.
    slowest : float
        Frequency far below all poles but those at 0, Hz.

    Returns
    -------
    ndarray, shape (n,)
        Hz.
    """
    return np.geomspace(slowest, 0.499 / dt, _POINTS)


def gains(
    w: float, per_speed: float, outer: float, observer: float, notch: Notch = NO_NOTCH
) -> Any:
    """The cascade of a velocity loop's bandwidth.

    Parameters
    ----------
    w : float
        Bandwidth, rad/s.
    per_speed : float
        Effort per change of speed, V s/m: that of a mass.
    outer, observer : float
        Bandwidths of position loop and observer, to the velocity loop's.
    notch : Notch, optional
        Of the effort; none, if nothing else is said.

    Returns
    -------
    Any
        A `Cascade`.
    """
    return Cascade(
        position=outer * w,
        velocity=per_speed * w,
        integral=outer * w,
        observer=observer * w,
        notch=notch,
    )


class Margins(NamedTuple):
    """Margins of a loop that is known at some frequencies; NaN: not within them.

    Attributes
    ----------
    crossover : float
        Lowest frequency where the gain falls through 1, Hz.
    phase : float
        Phase margin there, deg.
    gain : float
        Factor by which the gain may grow.
    modulus : float
        Least distance from -1: the inverse of the largest sensitivity.
    """

    crossover: float
    phase: float
    gain: float
    modulus: float


def margins(frequency: Array, loop: Complex) -> Margins:
    """Margins, between the frequencies by straight lines over the logarithm of the frequency.

    Parameters
    ----------
    frequency : ndarray, shape (n,)
        Hz, rising.
    loop : ndarray of complex, shape (n,)
        Open loop.

    Returns
    -------
    Margins
        Of it.
    """
    x, gain = np.log(frequency), np.log(np.abs(loop))
    phase = np.unwrap(np.angle(loop))
    phase -= 2.0 * math.pi * math.ceil(phase[0] / (2.0 * math.pi))  # a loop lags at first
    crossover = margin = grow = math.nan
    falls = (gain[:-1] >= 0.0) & (gain[1:] < 0.0)
    if falls.any():
        k = int(np.argmax(falls))
        share = gain[k] / (gain[k] - gain[k + 1])
        crossover = math.exp(x[k] + share * (x[k + 1] - x[k]))
        margin = 180.0 + math.degrees(phase[k] + share * (phase[k + 1] - phase[k]))
    turns = (phase[:-1] > -math.pi) & (phase[1:] <= -math.pi) & (gain[1:] < 0.0)
    if turns.any():
        k = int(np.argmax(turns))
        share = (phase[k] + math.pi) / (phase[k] - phase[k + 1])
        grow = math.exp(-(gain[k] + share * (gain[k + 1] - gain[k])))
    return Margins(crossover, margin, grow, float(np.min(np.abs(1.0 + loop))))
