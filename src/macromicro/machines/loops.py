"""The linear cascade loop of an axis: frequency response, stability, margins."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.control.cascade import Cascade
from macromicro.control.notch import Notch
from macromicro.control.stage_pi import StagePi

Complex = npt.NDArray[np.complex128]

NO_NOTCH = Notch()
MODULUS = 0.5  # least distance of a good loop from -1
_POINTS = 3000


def law(p: Cascade, frequency: Array, dt: float) -> Complex:
    """Effort per position error, without limits and feed-forward."""
    z = np.exp(2j * math.pi * np.asarray(frequency) * dt)
    back = 1.0 - 1.0 / z
    pole = math.exp(-p.observer * dt)
    place, rate = 1.0 - pole * pole, (1.0 - pole) ** 2 / dt
    # The observer's corrected speed per position, from its two difference equations.
    seen = rate / back / (1.0 + (place + dt * rate / back) / (z - 1.0))
    found: Complex = p.velocity * (1.0 + p.integral * dt / back) * (p.position + seen)
    return found * notch_response(p.notch, frequency, dt)


def pi(p: StagePi, frequency: Array, dt: float) -> Complex:
    """Effort per position error of a PI, without limits; the integral acts one period later."""
    z = np.exp(2j * math.pi * np.asarray(frequency) * dt)
    found: Complex = p.kp + p.ki * dt / (z - 1.0)
    return found


def hold_and_delay(s: Complex, timing: Any) -> Complex:
    """Response of D/A hold and delay."""
    turn = s * timing.period
    found: Complex = (1.0 - np.exp(-turn)) / turn * np.exp(-s * timing.delay)
    return found


def notch_response(p: Notch, frequency: Array, dt: float) -> Complex:
    f = np.asarray(frequency, dtype=np.float64)
    if p.frequency <= 0.0 or 2.0 * p.frequency * dt >= 1.0:
        return np.ones(len(f), np.complex128)
    # The bilinear transform's frequencies, that of the middle being 1.
    w: Array = np.tan(math.pi * f * dt) / math.tan(math.pi * p.frequency * dt)
    deep, wide = 2j * p.depth * p.width * w, 2j * p.width * w
    passed: Complex = np.asarray((1.0 - w * w + deep) / (1.0 - w * w + wide), np.complex128)
    return passed


def modulus(loop: Complex, poles: int = 2) -> float:
    """Modulus margin of a loop, negative where the closed loop is unstable (Nyquist)."""
    turned = np.unwrap(np.angle(1.0 + loop))
    least = float(np.min(np.abs(1.0 + loop)))
    off = turned[-1] - turned[0] - 0.5 * math.pi * poles
    return least if abs(off) < 0.5 * math.pi else -least


@lru_cache(maxsize=1024)
def grid(dt: float, slowest: float) -> Array:
    return np.geomspace(slowest, 0.499 / dt, _POINTS)


def gains(
    w: float, per_speed: float, outer: float, observer: float, notch: Notch = NO_NOTCH
) -> Any:
    """Cascade gains for a bandwidth of the velocity loop."""
    return Cascade(
        position=outer * w,
        velocity=per_speed * w,
        integral=outer * w,
        observer=observer * w,
        notch=notch,
    )


class Margins(NamedTuple):
    """Stability margins; NaN: not within the frequencies."""

    crossover: float  # lowest frequency where the gain falls through 1, Hz
    phase: float  # phase margin there, above -180 and at most 180 deg
    gain: float  # factor by which the gain may grow, of the lowest frequency that has one
    modulus: float  # least distance from -1: the inverse of the largest sensitivity
    # whether the closed loop is, by Nyquist between the frequencies; the open one has no pole in
    # the right half
    stable: bool


def margins(frequency: Array, loop: Complex) -> Margins:
    """Margins, interpolated linearly over the logarithm of the frequency."""
    x, gain = np.log(frequency), np.log(np.abs(loop))
    phase = np.unwrap(np.angle(loop))
    if phase[0] > 0.5 * math.pi:  # a loop lags at first, by less than 270 deg
        phase -= 2.0 * math.pi
    crossover = margin = math.nan
    falls = (gain[:-1] >= 0.0) & (gain[1:] < 0.0)
    if falls.any():
        k = int(np.argmax(falls))
        share = gain[k] / (gain[k] - gain[k + 1])
        crossover = math.exp(x[k] + share * (x[k + 1] - x[k]))
        lag = -math.degrees(phase[k] + share * (phase[k + 1] - phase[k]))
        margin = 180.0 - lag % 360.0
    way, at, late = _turns(gain, phase)
    beyond = int(gain[0] > 0.0 and phase[0] < -math.pi)  # it has turned below the first frequency
    stable = beyond + int(way[at > 0.0].sum()) == 0
    small = at[(way > 0.0) & (late < 0.0)]
    grow = math.exp(-small[0]) if len(small) else math.nan
    return Margins(crossover, margin, grow, float(np.min(np.abs(1.0 + loop))), stable)


def _turns(gain: Array, phase: Array) -> tuple[Array, Array, Array]:
    """Crossings of the negative real axis: direction, log gain, log gain of the next frequency."""
    rounds = np.floor((phase + math.pi) / (2.0 * math.pi))
    k = np.flatnonzero(np.diff(rounds))
    edge = 2.0 * math.pi * np.maximum(rounds[k], rounds[k + 1]) - math.pi
    share = (edge - phase[k]) / (phase[k + 1] - phase[k])
    at = gain[k] + share * (gain[k + 1] - gain[k])
    return rounds[k] - rounds[k + 1], at, gain[k + 1]
