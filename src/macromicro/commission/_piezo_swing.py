"""Resonance, damping, lag and slew rate of a piezo stage from steps of its effort."""

# After a step effort and hysteresis are constant, so the stage rings freely, with its frequency and
# damping. Phase and amplitude show the delay, first-order lag and slew rate of amplifier and stack
# before it.

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.commission._piezo_loops import SIMULATED, Loops
from macromicro.commission.stand import CommissionError, Record
from macromicro.hysteresis.prandtl_fit import moved
from macromicro.identify import clusters
from macromicro.identify.search import least_squares

_SMALL = 0.045  # of the range: such steps hardly meet the limit of the rate
_FINE = 8  # steps of the simulation per period
_PERIODS = 4.0  # of the ringing that a record must hold
_SEEN = 8.0  # noises that the ringing must be
_SLEWS = (0.03, 0.1, 0.3, 1.0, 3.0)  # to begin with, steps per period of the resonance
# Standard deviation of what this leaves out (a loop that widens with the rate), as a part of the
# value, by simulation: seen on 12 random stages of docs/commissioning_piezo.py, checked on others.
MODEL_ERRORS = {"resonance": 1e-5, "damping": 1e-3, "lag": 0.2, "slew": 0.03}
_DELAY, _DELAYS = 0.5, 2.0  # control periods that an effort acts late: to begin with, and at most
_FEW, _BEST = 6, 2  # rounds of every search, and how many go on
_LIMITED = 0.8  # a limit of the rate must lower the squares to that part


class Swing(NamedTuple):
    frequency: float  # of the undamped resonance, Hz
    damping: float  # ratio
    lag: float  # from an effort to the stack's voltage, s: delay and time constant together
    slew: float  # greatest rate of the effort that the stack follows, V/s
    limited: bool  # a step reached that rate; else it is the greatest one seen
    spread: tuple[float, ...]  # standard deviations of frequency, damping, lag and slew
    half: tuple[float, ...]  # halves of their 95 % intervals


def fitted(
    steps: Sequence[Record], dt: float, before: Sequence[float], noise: float, loops: Loops
) -> Swing:
    steps = [s._replace(x=s.x / noise) for s in steps]  # least squares have absolute tolerances
    extent = abs(before[1] - before[0])
    small = [s for s in steps if abs(_size(s)) <= _SMALL * extent]
    first = _frequency(small[-1], dt)
    scale = np.array([2.0 * math.pi * first, 0.02])

    def ringing(p: Array) -> Array:
        return np.concatenate([_ringing(s, p * scale, dt, first) for s in small])

    found = least_squares(ringing, np.ones(2), bounds=([0.5, 1e-3], [2.0, 45.0]))
    omega, damping = (found.x * scale).tolist()
    rows = _edges([_ringing(s, found.x * scale, dt, first) for s in small])
    free = clusters.spread(found.jac / scale, found.fun, rows)

    parts = [_cut(s, omega, dt) for s in steps]
    thresholds = np.array(loops.thresholds)
    levels = np.array([*before, *(s.u[-1] for s in steps)])
    plays = moved(levels, thresholds)[len(before) - 1 : -1]

    weights = np.array(loops.weights)

    def missed(p: Array) -> Array:
        lag, slew, delay = p[0] * dt, math.exp(p[1]), p[2] * dt
        missing = []
        for s, y in zip(parts, plays, strict=True):
            volts = s.u[0] + _lagged(len(s.x), _size(s), lag, slew, dt / _FINE, delay)
            # A play's part of the position, after Kuhnen (2003).
            stood = np.maximum(
                volts[:, None] - thresholds, np.minimum(volts[:, None] + thresholds, y)
            )
            missing.append(_step(s.x, (stood - y) @ weights, omega, damping, dt))
        return np.concatenate(missing)

    def unlimited(p: Array) -> Array:
        return missed(np.array([p[0], 60.0, p[1]]))

    largest = max(abs(_size(s)) for s in steps)
    late, low = (0.3, 1.0, max(0.1 / (first * dt), 1.5)), 0.01  # of the lag, control periods
    bounds = ([low, 0.0], [np.inf, _DELAYS])
    every = [least_squares(unlimited, [lag, _DELAY], bounds=bounds) for lag in late]
    plain = min(every, key=lambda one: float(one.cost))
    bounds = ([low, -np.inf, 0.0], [np.inf, np.inf, _DELAYS])
    starts = [
        [lag, math.log(part * largest * omega), _DELAY] for part, lag in product(_SLEWS, late)
    ]
    tries = [least_squares(missed, p, bounds=bounds, max_nfev=_FEW) for p in starts]
    tries.sort(key=lambda one: float(one.cost))
    tried = [least_squares(missed, one.x, bounds=bounds, max_nfev=30) for one in tries[:_BEST]]
    best = min(tried, key=lambda one: float(one.cost))
    limited = bool(best.cost < _LIMITED * plain.cost)
    chosen = best if limited else plain
    driven = clusters.spread(chosen.jac, chosen.fun, _edges([s.x for s in parts]))
    lag = float(chosen.x[0] + chosen.x[-1]) * dt
    slew = math.exp(best.x[1]) if limited else largest / max(lag, dt)
    late_slope = np.array([dt, *[0.0] * (len(chosen.x) - 2), dt])
    slew_slope = np.array([0.0, slew, 0.0])[: len(chosen.x)] * limited
    slopes = (np.diag([0.5 / math.pi, 1.0]), np.stack([late_slope, slew_slope]))
    values = np.array([omega / (2.0 * math.pi), damping, lag, slew])
    hidden = np.array(list(MODEL_ERRORS.values())) * values
    every = list(zip((free, driven), slopes, np.split(hidden, 2), strict=True))
    half = np.concatenate([clusters.half_widths(one, by, more, SIMULATED) for one, by, more in every])
    own = np.concatenate([clusters.errors(one.covariance, by) for one, by, _ in every])
    spread = np.hypot(own, hidden)
    return Swing(*values.tolist(), limited, tuple(spread.tolist()), tuple(half.tolist()))


def _size(step: Record) -> float:
    return float(step.u[-1] - step.u[0])


def _cut(step: Record, omega: float, dt: float) -> Record:
    """Six periods of the resonance after the step, where the lag shows."""
    n = min(len(step.t), max(round(12.0 * math.pi / (omega * dt)), 40))
    return Record(step.t[:n], step.u[:n], step.x[:n])


def _frequency(step: Record, dt: float) -> float:
    """Peak frequency after a step, Hz, by differences of readings, which suppress creep."""
    x = np.diff(step.x[4:])
    # It rings at first: a window that only falls.
    rest = (x - x.mean()) * np.hanning(2 * len(x))[len(x) :]
    spectrum = np.abs(np.fft.rfft(rest, 8 * len(x)))
    k = int(np.argmax(spectrum))
    if spectrum[k] < _SEEN * math.sqrt(len(x)):
        raise CommissionError(
            "no resonance shows after a step. Check for strong damping or a sensor filter"
        )
    found = k / (8 * len(x) * dt)
    if found * len(x) * dt < _PERIODS:
        raise CommissionError(
            f"the resonance is at {found:.3g} Hz or below, if any: too slow for {len(x) * dt:.2g} s"
        )
    if found > 0.25 / dt:
        raise CommissionError(
            f"the resonance at {found:.3g} Hz is too fast for a control period of {dt * 1e3:.3g} ms"
        )
    return float(found)


def _ringing(step: Record, p: Array, dt: float, about: float) -> Array:
    """Residual of ringing at a frequency and damping, beside a slow drift."""
    omega, damping = p
    begin = max(round(1.0 / (about * dt)), 5)
    t = (np.arange(len(step.x)) * dt)[begin:]
    x = step.x[begin:]
    fall = np.exp(-damping * omega * t)
    swung = omega * math.sqrt(max(1.0 - damping**2, 1e-6)) * t
    u = t / t[-1]
    basis = np.stack([np.ones_like(t), u, u * u, fall * np.cos(swung), fall * np.sin(swung)], 1)
    return _left(x, basis)


def _step(x: Array, goal: Array, omega: float, damping: float, dt: float) -> Array:
    """Residual of the oscillator's response to a moving equilibrium, beside gain and drift."""
    u = np.linspace(0.0, 1.0, len(x))
    shape = _swung(goal / np.abs(goal).max(), omega, damping, dt / _FINE)[::_FINE]
    return _left(x, np.stack([np.ones_like(u), u, shape], axis=1))


def _left(x: Array, basis: Array) -> Array:
    q = np.linalg.qr(basis)[0]
    return np.asarray(x - q @ (q.T @ x))


def _lagged(n: int, size: float, lag: float, slew: float, h: float, delay: float) -> Array:
    """A delayed step behind a rate-limited first-order lag, V, at the middles of substeps."""
    t = np.maximum((np.arange(n * _FINE) + 0.5) * h - delay, 0.0)
    # Rate-limited while more than slew lag is left, then first order.
    until = max(abs(size) - slew * lag, 0.0) / slew
    left = abs(size) - slew * until
    later = np.exp(-np.maximum(t - until, 0.0) / lag)
    return np.asarray(np.sign(size) * np.where(t < until, slew * t, abs(size) - left * later))


def _swung(goal: Array, omega: float, damping: float, h: float) -> Array:
    """A damped oscillator from rest, exact for a stepwise equilibrium."""
    from scipy.signal import lfilter

    sigma, swing = damping * omega, omega * math.sqrt(max(1.0 - damping**2, 1e-6))
    e, c, s = math.exp(-sigma * h), math.cos(swing * h), math.sin(swing * h)
    p = e * (c + sigma / swing * s)
    a1, a2 = -2.0 * e * c, e * e
    return np.asarray(lfilter([0.0, 1.0 - p, a2 + p + a1], [1.0, a1, a2], goal))


def _edges(parts: Sequence[Array]) -> Array:
    """Edges of parts in a row, each of them a cluster."""
    return np.cumsum([0, *(len(part) for part in parts)])
