"""Margins of a loop from its polynomials in z: gain, phase, delay, disk; PD design by margin.

Everything is evaluated on the unit circle with numpy. Polynomials: coefficients from the
highest power of z down.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError

Complex = npt.NDArray[np.complex128]

_GRID = 4000


class Crossover(NamedTuple):
    """A frequency where the open loop's gain is 1."""

    frequency: float  #: rad/s
    phase_margin: float  #: deg


class PdTaps(NamedTuple):
    """D(z) = (now z + before) / z [V/count].

    Examples
    --------
    >>> from macromicro.design.margins import PdTaps
    >>> taps = PdTaps(now=3.0, before=-2.0)
    >>> taps.proportional, taps.derivative_time(dt=0.001)
    (1.0, 0.002)
    """

    now: float
    before: float

    @property
    def proportional(self) -> float:
        """Static gain [V/count]."""
        return self.now + self.before

    def derivative_time(self, dt: float) -> float:
        """T_d of D(z) = K (1 + T_d (z - 1) / (z dt)).

        Parameters
        ----------
        dt : float
            Sample time, s.

        Returns
        -------
        float
            s; below 0 where D lags.
        """
        return -self.before * dt / self.proportional


def damping_margin(ratio: float) -> float:
    """Phase margin of a second-order loop with a damping ratio (Section 4.3.2).

    atan(2 r / sqrt(sqrt(1 + 4 r^4) - 2 r^2)): 76.35 deg for 1.

    Parameters
    ----------
    ratio : float
        Damping ratio r, 1 for critical damping.

    Returns
    -------
    float
        deg.

    Raises
    ------
    InputError
        `ratio` is not a finite number above 0.

    Examples
    --------
    >>> from macromicro.design.margins import damping_margin
    >>> round(damping_margin(1.0), 2), round(damping_margin(0.5), 2)  # deg
    (76.35, 51.83)
    """
    if not (ratio > 0.0 and math.isfinite(ratio)):
        raise InputError("damping ratio", ratio, "a finite number above 0")
    square = 2.0 * ratio**2
    # sqrt(1 + x^2) - x = 1 / (sqrt(1 + x^2) + x), without the loss of digits
    return math.degrees(math.atan(2.0 * ratio * math.sqrt(math.hypot(1.0, square) + square)))


def response(num: npt.ArrayLike, den: npt.ArrayLike, frequency: float, dt: float) -> complex:
    """num(z) / den(z) at z = exp(j frequency dt).

    Parameters
    ----------
    num, den : array_like, shapes (m,) and (n,)
        Coefficients, highest power of z first.
    frequency : float
        Frequency, rad/s.
    dt : float
        Sample time, s.

    Returns
    -------
    complex
        Complex gain.

    Examples
    --------
    >>> from macromicro.design.margins import response
    >>> gain = response([0.05], [1.0, -1.0], frequency=5.0, dt=0.01)  # an integrator, 5 per s
    >>> round(abs(gain), 3)
    1.0
    """
    z = np.exp(1j * frequency * dt)
    return complex(np.polyval(np.asarray(num), z) / np.polyval(np.asarray(den), z))


def crossovers(num: npt.ArrayLike, den: npt.ArrayLike, dt: float) -> list[Crossover]:
    """Every gain crossover of an open loop num/den.

    The search covers 1e-5 of the Nyquist frequency up to it, with roots to 1e-12. It can miss two
    crossovers within 0.3 % in frequency.

    Parameters
    ----------
    num, den : array_like, shapes (m,) and (n,)
        Coefficients, highest power of z first.
    dt : float
        Sample time, s.

    Returns
    -------
    list[Crossover]
        Slowest first.

    Raises
    ------
    InputError
        `dt` is not above 0.

    Examples
    --------
    >>> from macromicro.design.margins import crossovers
    >>> (found,) = crossovers([0.05], [1.0, -1.0], dt=0.01)  # an integrator, 5 per s
    >>> round(found.frequency, 2), round(found.phase_margin, 1)  # rad/s, deg
    (5.0, 88.6)
    """
    from scipy.optimize import brentq

    if not (dt > 0.0 and math.isfinite(dt)):
        raise InputError("crossovers: dt", dt, "above 0")
    grid = frequencies(dt)

    def level(frequency: float) -> float:
        return math.log(max(abs(response(num, den, frequency, dt)), 1e-300))

    gains = np.abs(responses(num, den, grid, dt))
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
    """The slowest gain crossover of an open loop num/den.

    Parameters
    ----------
    num, den : array_like, shapes (m,) and (n,)
        Coefficients, highest power of z first.
    dt : float
        Sample time, s.

    Returns
    -------
    Crossover
        Frequency and phase margin.

    Raises
    ------
    ProblemError
        The gain never crosses 1.

    Examples
    --------
    >>> from macromicro.design.margins import first_crossover
    >>> round(first_crossover([0.05], [1.0, -1.0], dt=0.01).frequency, 2)  # rad/s
    5.0
    """
    found = crossovers(num, den, dt)
    if not found:
        raise ProblemError("open loop", "the gain never crosses 1")
    return found[0]


def open_loop(taps: PdTaps, num: npt.ArrayLike, den: npt.ArrayLike) -> tuple[Array, Array]:
    """D(z) of the taps times a plant num/den.

    Parameters
    ----------
    taps : PdTaps
        The controller, V/count.
    num, den : array_like, shapes (m,) and (n,)
        Coefficients, highest power of z first.

    Returns
    -------
    num : ndarray, shape (m + 1,)
        Numerator of the loop.
    den : ndarray, shape (n + 1,)
        Denominator of the loop.

    Examples
    --------
    >>> from macromicro.design.margins import PdTaps, open_loop
    >>> num, den = open_loop(PdTaps(3.0, -2.0), [0.05], [1.0, -1.0])
    >>> num.round(6).tolist(), den.tolist()
    ([0.15, -0.1], [1.0, -1.0, 0.0])
    """
    return (
        np.convolve([taps.now, taps.before], np.asarray(num, np.float64)),
        np.convolve([1.0, 0.0], np.asarray(den, np.float64)),
    )


def pd_by_margin(
    num: npt.ArrayLike, den: npt.ArrayLike, dt: float, frequency: float, margin: float
) -> PdTaps:
    """PD taps for an exact crossover and phase margin of a plant num/den (Section 4.3.2).

    Below `lowest_frequency` the controller has to lag, which takes two taps of opposite sign.

    Parameters
    ----------
    num, den : array_like, shapes (m,) and (n,)
        Coefficients, highest power of z first.
    dt : float
        Sample time, s.
    frequency : float
        Frequency of the crossover, rad/s.
    margin : float
        Phase margin, deg.

    Returns
    -------
    PdTaps
        V/count.

    Raises
    ------
    InputError
        `frequency` is not below the Nyquist frequency.

    Examples
    --------
    >>> from macromicro.design.margins import first_crossover, open_loop, pd_by_margin
    >>> num, den, dt = [5e-7, 5e-7], [1.0, -2.0, 1.0], 0.001  # a mass of 1 kg, held over 1 ms
    >>> taps = pd_by_margin(num, den, dt, frequency=100.0, margin=60.0)
    >>> round(first_crossover(*open_loop(taps, num, den), dt).phase_margin, 6)  # deg
    60.0
    """
    _below_nyquist(frequency, dt)
    needed = np.exp(1j * math.radians(margin - 180.0)) / response(num, den, frequency, dt)
    late = np.exp(-1j * frequency * dt)
    before = float(needed.imag / late.imag)
    return PdTaps(float(needed.real) - before * float(late.real), before)


def pd_by_time(
    num: npt.ArrayLike, den: npt.ArrayLike, dt: float, frequency: float, derivative_time: float
) -> PdTaps:
    """PD taps for a crossover of a plant num/den at a given derivative time.

    Parameters
    ----------
    num, den : array_like, shapes (m,) and (n,)
        Coefficients, highest power of z first.
    dt : float
        Sample time, s.
    frequency : float
        Frequency of the crossover, rad/s.
    derivative_time : float
        Derivative time, s.

    Returns
    -------
    PdTaps
        V/count.

    Raises
    ------
    InputError
        `frequency` is not below the Nyquist frequency.

    Examples
    --------
    >>> from macromicro.design.margins import first_crossover, open_loop, pd_by_time
    >>> num, den, dt = [5e-7, 5e-7], [1.0, -2.0, 1.0], 0.001  # a mass of 1 kg, held over 1 ms
    >>> taps = pd_by_time(num, den, dt, frequency=100.0, derivative_time=0.02)
    >>> round(first_crossover(*open_loop(taps, num, den), dt).frequency, 6)  # rad/s
    100.0
    """
    _below_nyquist(frequency, dt)
    share = derivative_time / dt
    shape = response([1.0 + share, -share], [1.0, 0.0], frequency, dt)
    gain = 1.0 / abs(shape * response(num, den, frequency, dt))
    return PdTaps(gain * (1.0 + share), -gain * share)


def lowest_frequency(num: npt.ArrayLike, den: npt.ArrayLike, dt: float, margin: float) -> float:
    """The frequency at which a plant num/den alone has a phase margin.

    It is the lowest at which a PD without lag can give it; the plant's phase must fall with the
    frequency.

    Parameters
    ----------
    num, den : array_like, shapes (m,) and (n,)
        Coefficients, highest power of z first.
    dt : float
        Sample time, s.
    margin : float
        Phase margin, deg.

    Returns
    -------
    float
        rad/s.

    Raises
    ------
    InputError
        The plant does not pass through the margin.

    Examples
    --------
    >>> from macromicro.design.margins import lowest_frequency
    >>> round(lowest_frequency([0.05], [1.0, -1.0], dt=0.01, margin=80.0), 2)  # rad/s
    34.91
    """
    from scipy.optimize import brentq

    def excess(frequency: float) -> float:
        return math.degrees(np.angle(-response(num, den, frequency, dt))) - margin

    low, high = 1e-5 * math.pi / dt, 0.2 * math.pi / dt
    if not excess(low) > 0.0 > excess(high):
        raise InputError("phase margin", margin, "a margin that the plant passes through")
    return float(brentq(excess, low, high, xtol=1e-12))


def _below_nyquist(frequency: float, dt: float) -> None:
    if not 0.0 < frequency * dt < math.pi:
        raise InputError("crossover frequency", frequency, "above 0, below the Nyquist frequency")


class Margins(NamedTuple):
    """Margins of a stable closed loop, possibly `math.inf`; NaN for an unstable one."""

    stable: bool  #: whether the closed loop is
    gain: float  #: factor above 1 by which the loop's gain may change
    gain_down: float  #: factor below 1; 0: down to nothing
    phase: float  #: phase margin of the smallest magnitude, deg
    crossover: float  #: its frequency, rad/s
    delay: float  #: that may be added, s
    disk: float  #: symmetric disk margin alpha
    disk_gain: float  #: factor that it grants, gain and phase changing together
    disk_phase: float  #: phase that it grants, deg
    peak_s: float  #: largest |S|
    peak_t: float  #: largest |T|


def is_stable(num: npt.ArrayLike, den: npt.ArrayLike) -> bool:
    """Whether unity feedback around num/den has all its poles within the unit circle.

    Parameters
    ----------
    num, den : array_like, shapes (m,) and (n,)
        Coefficients, highest power of z first.

    Returns
    -------
    bool
        True for a stable loop.

    Examples
    --------
    >>> from macromicro.design.margins import is_stable
    >>> is_stable([0.05], [1.0, -1.0]), is_stable([2.5], [1.0, -1.0])
    (True, False)
    """
    poles = np.roots(np.polyadd(np.asarray(num, np.float64), np.asarray(den, np.float64)))
    return bool(np.all(np.abs(poles) < 1.0))


def margins(num: npt.ArrayLike, den: npt.ArrayLike, dt: float) -> Margins:
    """Every margin of a loop num/den, closed by unity feedback.

    With S = 1 / (1 + L) and T = L / (1 + L), the symmetric disk margin is alpha = 1 / max |(S - T)
    / 2|: the loop stays stable for every factor (1 + d/2) / (1 - d/2) with |d| < alpha, which
    contains the gains from (2 - alpha) / (2 + alpha) to its inverse and the phases within +-2
    atan(alpha / 2) (Seiler, Packard and Gahinet, An introduction to disk margins, 2020, skew 0).
    Frequencies from 1e-5 of the Nyquist frequency up to it.

    Parameters
    ----------
    num, den : array_like, shapes (m,) and (n,)
        Coefficients, highest power of z first.
    dt : float
        Sample time, s.

    Returns
    -------
    Margins
        All of them.

    Raises
    ------
    InputError
        `dt` is not above 0.

    Examples
    --------
    >>> from macromicro.design.margins import margins
    >>> found = margins([0.05], [1.0, -1.0], dt=0.01)  # an integrator, 5 per s
    >>> round(found.gain, 2), round(found.phase, 1), round(found.delay, 3)  # 1, deg, s
    (40.0, 88.6, 0.309)
    """
    found = crossovers(num, den, dt)
    if not is_stable(num, den):
        return Margins(False, *[math.nan] * 10)
    nearest = min(found, key=lambda c: abs(c.phase_margin), default=Crossover(math.nan, math.inf))
    delay = min(
        (math.radians(c.phase_margin % 360.0) / c.frequency for c in found), default=math.inf
    )
    factors = _critical_gains(num, den, dt)
    skew = _peak(num, den, dt, lambda at: 0.5 * (1.0 - at) / (1.0 + at))
    disk = math.inf if skew == 0.0 else 1.0 / skew
    return Margins(
        True,
        min((f for f in factors if f > 1.0), default=math.inf),
        max((f for f in factors if f < 1.0), default=0.0),
        nearest.phase_margin,
        nearest.frequency,
        delay,
        disk,
        math.inf if disk >= 2.0 else (2.0 + disk) / (2.0 - disk),
        math.degrees(2.0 * math.atan(0.5 * disk)),
        _peak(num, den, dt, lambda at: 1.0 / (1.0 + at)),
        _peak(num, den, dt, lambda at: at / (1.0 + at)),
    )


def frequencies(dt: float, count: int = _GRID) -> Array:
    """Frequencies, geometric from 1e-5 of the Nyquist frequency up to it.

    Parameters
    ----------
    dt : float
        Sample time, s.
    count : int, optional
        Number of frequencies.

    Returns
    -------
    ndarray, shape (count,)
        rad/s.

    Examples
    --------
    >>> from macromicro.design.margins import frequencies
    >>> frequencies(dt=0.001, count=6).round(3).tolist()
    [0.031, 0.314, 3.142, 31.416, 314.159, 3141.593]
    """
    nyquist = math.pi / dt
    return np.geomspace(1e-5 * nyquist, nyquist * (1.0 - 1e-9), count)


def responses(num: npt.ArrayLike, den: npt.ArrayLike, frequency: Array, dt: float) -> Complex:
    """num(z) / den(z) at z = exp(j frequency dt).

    Parameters
    ----------
    num, den : array_like, shapes (m,) and (n,)
        Coefficients, highest power of z first.
    frequency : ndarray, shape (n,)
        Frequency, rad/s.
    dt : float
        Sample time, s.

    Returns
    -------
    ndarray of complex, shape (n,)
        Gains.

    Examples
    --------
    >>> from macromicro.design.margins import frequencies, responses
    >>> gains = responses([0.05], [1.0, -1.0], frequencies(0.01, count=3), dt=0.01)
    >>> abs(gains).round(3).tolist()
    [1591.549, 5.033, 0.025]
    """
    z = np.exp(1j * frequency * dt)
    over, under = (np.polyval(np.asarray(p, np.complex128), z) for p in (num, den))
    return np.asarray(over / under, np.complex128)


def _critical_gains(num: npt.ArrayLike, den: npt.ArrayLike, dt: float) -> list[float]:
    """Factors k > 0 that put a pole of the closed loop on the unit circle: -1 / L, L < 0."""
    from scipy.optimize import brentq

    grid = frequencies(dt)
    at = responses(num, den, grid, dt)
    rows = np.flatnonzero((at.imag[:-1] * at.imag[1:] < 0.0) & (at.real[:-1] < 0.0))
    found = []
    for k in rows:
        w = brentq(
            lambda f: response(num, den, f, dt).imag,
            float(grid[k]),
            float(grid[k + 1]),
            xtol=1e-12,
            rtol=1e-12,
        )
        found.append(-1.0 / response(num, den, float(w), dt).real)
    # At both ends of the grid the loop is real, and no sign changes; at z = 1 an integrator
    # has no value.
    for z in (1.0, -1.0):
        over, under = float(np.polyval(np.asarray(num), z)), float(np.polyval(np.asarray(den), z))
        if over * under < 0.0 and abs(under) > 1e-9 * float(np.abs(den).sum()):
            found.append(-under / over)
    return [f for f in found if f > 0.0]


def _peak(
    num: npt.ArrayLike, den: npt.ArrayLike, dt: float, of: Callable[[Complex], Complex]
) -> float:
    """The largest |of(L)| over all frequencies: on the grid, then refined around its peak."""
    grid = frequencies(dt)
    size = np.abs(of(responses(num, den, grid, dt)))
    best = int(np.argmax(size))
    for _ in range(3):
        low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
        grid = np.linspace(low, high, 101)
        size = np.abs(of(responses(num, den, grid, dt)))
        best = int(np.argmax(size))
    return float(size[best])
