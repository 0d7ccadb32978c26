"""Stability limits of the micro-stage's laws on a linear model of the stage as it heats.

While the wires transform, the stage contracts at a speed in proportion to the heat,

    dx/dt = c q / c1,    lag dq/dt = slope u - q,    sensor ds/dt = x - s

with c the contraction per kelvin of heat content and `slope` the driver's, K/V, which varies with
u. A gain is refused if the loop is unstable at every slope of the identified driver.
"""

# A linear model cannot say more: hysteresis lets a loop with much integral action hunt earlier, and
# lets one with a high proportional gain stand still although its effort swings (P law of 64 times
# its gain: 1.4 um at rest).

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.control import pid_heat
from macromicro.control.inverse.model import Inverse, everett
from macromicro.control.pi import PiAntiWindup
from macromicro.control.stability import refusal
from macromicro.hysteresis.everett import lookup
from macromicro.nominal import PERIOD

_INNER = (0.1, 0.9)  # of the contraction: between them a temperature's rise counts
_ROUNDING = 1e-9

_GAINS = {"p": ("kp",), "pi": ("kp", "ki"), "pi_antiwindup": ("kp", "ki")}


class _Linear(NamedTuple):
    """A law from the position s to the effort u in V: z+ = a z + b s, u = c z + d s."""

    a: Array
    b: Array
    c: Array
    d: float


def problems(control: Any) -> list[tuple[str, Any, str]]:
    """The gain of each micro law that makes its loop unstable."""
    every = [(name, getattr(control, name), names) for name, names in _GAINS.items()]
    if isinstance(control.fine, pid_heat.Gains):
        every.append(("fine", control.fine, ("kp", "ki", "lead", "observer")))
    found = (_problem(path, gains, names) for path, gains, names in every)
    return [each for each in found if each is not None]


def _problem(path: str, gains: Any, names: tuple[str, ...]) -> tuple[str, Any, str] | None:
    if _stable(gains):
        return None
    plain = type(gains)()
    usual = {name: float(getattr(plain, name)) for name in names}
    return refusal(path, gains, usual, _stable)


@lru_cache(maxsize=1024)
def _stable(gains: Any) -> bool:
    """Whether the closed loop is stable at a slope of the driver."""
    linear = _heat(gains) if isinstance(gains, pid_heat.Gains) else _pi(gains)
    return any(_radius(linear, slope) <= 1.0 + _ROUNDING for slope in _slopes())


def _radius(law: _Linear, slope: float) -> float:
    """Largest eigenvalue of the closed loop at the sampling instants."""
    plant, drive = _plant(slope)
    sensed = np.array([0.0, 0.0, 1.0])
    above = np.hstack([plant + np.outer(drive, law.d * sensed), np.outer(drive, law.c)])
    below = np.hstack([np.outer(law.b, sensed), law.a])
    with np.errstate(all="ignore"):
        closed = np.vstack([above, below])
    if not np.isfinite(closed).all():
        return np.inf
    return float(np.abs(np.linalg.eigvals(closed)).max())


def _pi(p: PiAntiWindup) -> _Linear:
    """Control.pi: the integral acts one period later."""
    return _Linear(np.eye(1), np.array([-PERIOD * p.ki]), np.ones(1), -p.kp)


def _heat(p: pid_heat.Gains) -> _Linear:
    """control.pid_heat within its range: observed place and speed, and the integral share."""
    time = max(p.observer, 2.0 * PERIOD)
    gain = np.array([2.0 * PERIOD / time, PERIOD / time**2])  # of the sample beyond the place
    ahead = np.array([[1.0, PERIOD], [0.0, 1.0]])
    observer = ahead - np.outer(gain, ahead[0])
    error = -np.array([1.0, p.lead])  # of place and speed
    span = p.high - p.low
    a = np.zeros((3, 3))
    a[:2, :2] = observer
    a[2] = [*(PERIOD * p.ki * (error @ observer)), 1.0]
    b = np.array([*gain, PERIOD * p.ki * (error @ gain)])
    c = span * np.array([*(p.kp * (error @ observer)), 1.0])
    return _Linear(a, b, c, float(span * p.kp * (error @ gain)))


@lru_cache(maxsize=64)
def _plant(slope: float) -> tuple[Array, Array]:
    """Position, heat and sensor a period later, and what a volt adds to each."""
    from scipy.linalg import expm  # settings are read without scipy

    p = Inverse()
    rates = np.zeros((4, 4))  # the last row: the effort is held over a period
    rates[0, 1] = _contraction() / p.c1
    rates[1] = [0.0, -1.0 / p.lag, 0.0, slope / p.lag]
    rates[2] = [1.0 / p.sensor, 0.0, -1.0 / p.sensor, 0.0]
    whole = expm(PERIOD * rates)
    return whole[:3, :3], whole[:3, 3]


@lru_cache(maxsize=1)
def _slopes() -> tuple[float, ...]:
    """Slopes of the driver's heat map, K/V, where it heats."""
    p = Inverse()
    slopes = np.diff(p.heat) / np.diff(p.volts)
    return tuple(float(each) for each in slopes if each > 0.0)


@lru_cache(maxsize=1)
def _contraction() -> float:
    """Contraction per kelvin of heat content while the wires transform, m/K."""
    p = Inverse()
    table = everett(p)
    at = table.lo + table.step * np.arange(table.n)
    share = np.array([lookup(table, float(hot), table.lo) for hot in at])
    low, high = _INNER
    rise = float(np.interp(high, share, at) - np.interp(low, share, at))
    part = high - low
    way = part * p.span
    return way / (rise + p.stiffening * way + part * p.latent)
