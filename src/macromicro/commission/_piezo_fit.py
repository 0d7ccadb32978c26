"""Model of a piezo stage: hysteresis and creep by slow swings, resonance and lag by steps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.commission.stand import CommissionError, Record
from macromicro.hysteresis.prandtl_fit import moved, spaced
from macromicro.identify import clusters
from macromicro.identify.search import least_squares
from macromicro.plant import creep

PLAYS = 16
_MOST_CREEP = 0.1  # per decade
_SCALE = 1e6  # of positions: least squares with bounds have absolute tolerances
# Standard deviation of what this leaves out (thresholds between those here, other lags of the
# creep, warmth), as a part of the value, by simulation: seen on 12 random stages of
# docs/commissioning_piezo.py, checked on others there.
SIMULATED = 12  # stages by which these are known
LOOP_ERRORS = {"creep": 0.025, "stroke": 0.002, "hysteresis": 0.005}
_ROWS = 3000  # samples of a record that are compared


class Loops(NamedTuple):
    # thresholds, weights: V, and m/V at the D/A
    thresholds: tuple[float, ...]
    weights: tuple[float, ...]
    creep: float  # per decade of time, of the displacement before
    stroke: float  # of a slow cycle over the whole range, without creep, m
    width: float  # of its loop in the middle, over the stroke
    spread: tuple[float, ...]  # standard deviations of creep, stroke and width
    half: tuple[float, ...]  # halves of their 95 % intervals
    rms: float  # residual, m


class _Part(NamedTuple):
    """A record for the fit, less its offset and past."""

    plays: Array  # (n, k)
    lagged: Array  # (n, k)
    x: Array
    branch: Array


def fitted_loops(swings: Sequence[Record], dt: float) -> Loops:
    from scipy.optimize import minimize_scalar, nnls

    every = np.concatenate([s.u for s in swings])
    span = float(np.ptp(every))
    thresholds = spaced(every, PLAYS)
    parts = [_part(s, thresholds, span, dt) for s in swings]
    plays, lagged, x, branch = (
        np.concatenate(c) for c in zip(*_number_branches(parts), strict=True)
    )
    # All products that any creep needs, so that a trial costs no row.
    r = np.linalg.qr(np.hstack([plays, lagged, x[:, None]]))[1]
    k = PLAYS

    def weights(c: float) -> tuple[Array, float]:
        found, rest = nnls(r[:, :k] + c * r[:, k : 2 * k], r[:, -1], maxiter=100 * k)
        return found, float(rest)

    best = minimize_scalar(
        lambda c: weights(c)[1], bounds=(0.0, _MOST_CREEP), method="bounded",
        options={"xatol": 1e-6},
    )  # fmt: skip
    c = float(best.x)
    w, _ = weights(c)
    if not w[0] > 0.0:
        raise CommissionError("the reading lags the effort throughout. Check for a sensor filter")
    error = x - (plays + c * lagged) @ w
    used = np.flatnonzero(w > 0.0)
    jacobian = np.column_stack([(plays + c * lagged)[:, used], lagged @ w])
    edges = np.searchsorted(branch, np.arange(branch[-1] + 2))
    sure = clusters.spread(jacobian, error, edges)
    left = 0.5 * span - thresholds
    to_stroke, to_width = 2.0 * left, 2.0 * np.minimum(thresholds, left)
    stroke = float(to_stroke @ w)
    width = float(to_width @ w) / stroke
    slopes = np.zeros((3, len(used) + 1))
    slopes[0, -1] = 1.0
    slopes[1, :-1] = to_stroke[used]
    slopes[2, :-1] = (to_width[used] - width * to_stroke[used]) / stroke
    hidden = np.array(list(LOOP_ERRORS.values())) * [c, stroke, width]
    spread, half = _sure(sure, slopes, hidden)
    metres = 1.0 / _SCALE
    units = np.array([1.0, metres, 1.0])
    return Loops(
        tuple(thresholds.tolist()), tuple((metres * w).tolist()), c, metres * stroke, width,
        tuple((units * spread).tolist()), tuple((units * half).tolist()),
        metres * float(np.sqrt(np.mean(error**2))),
    )  # fmt: skip


def _sure(found: clusters.Spread, slopes: Array, hidden: Array) -> tuple[Array, Array]:
    """Standard deviations of functions of the parameters, and halves of their 95 % intervals."""
    half = clusters.half_widths(found, slopes, hidden, SIMULATED)
    return np.hypot(clusters.errors(found.covariance, slopes), hidden), half


def predict(found: Loops, swing: Record, dt: float) -> tuple[Array, Array, Array]:
    """Effort, position and prediction of a record, for a figure."""
    u, x, columns, lagged, past, known = _columns(swing, np.array(found.thresholds), dt)
    explained = (columns + found.creep * lagged) @ np.array(found.weights)
    rest = (x / _SCALE - explained)[known:]
    q = np.linalg.qr(past[known:])[0]
    return u[known:], x[known:] / _SCALE, rest - q @ (q.T @ rest)


def _columns(
    swing: Record, thresholds: Array, dt: float
) -> tuple[Array, Array, Array, Array, Array, int]:
    """Effort, position, plays, their lags, past terms, and the first valid row."""
    from scipy.signal import lfilter

    every = max(len(swing.t) // _ROWS, 1)
    n = len(swing.t) // every * every
    h = every * dt
    u, x = (c[:n].reshape(-1, every).mean(axis=1) for c in (swing.u, _SCALE * swing.x))
    t = np.arange(len(u)) * h
    plays = moved(u, thresholds)
    table = creep.prepare(creep.Creep(share=1.0))
    falls = np.exp(-h / table.times)
    from_start = plays - plays[0]
    lagged = sum(lfilter([1.0 - f], [1.0, -f], from_start, axis=0) for f in falls)
    past = np.stack([np.ones_like(t), *(np.exp(-t / own) for own in table.times[:2]), t], axis=1)
    span = float(np.ptp(u))
    near = 1e-3 * span
    known = max(int(np.argmax(u >= u.max() - near)), int(np.argmax(u <= u.min() + near)))
    return u, x, plays, np.asarray(lagged), past, known


def _part(swing: Record, thresholds: Array, span: float, dt: float) -> _Part:
    """Valid part of a record; offset and past are projected out of every column."""
    u, x, plays, lagged, past, known = _columns(swing, thresholds, dt)
    q = np.linalg.qr(past[known:])[0]

    def less(a: Array) -> Array:
        return np.asarray(a[known:] - q @ (q.T @ a[known:]))

    ways = np.sign(np.diff(u[known:], prepend=u[known]))
    for k in range(1, len(ways)):  # a rest belongs to the branch before it
        ways[k] = ways[k] or ways[k - 1]
    branch = np.cumsum(np.diff(ways, prepend=ways[0]) != 0.0)
    return _Part(less(plays), less(lagged), less(x), branch)


def _number_branches(parts: Sequence[_Part]) -> list[_Part]:
    """Branches with numbers of their own."""
    done, made = 0, []
    for part in parts:
        made.append(part._replace(branch=part.branch + done))
        done += int(part.branch.max()) + 1
    return made


# After a step effort and hysteresis are constant, so the stage rings freely, with its frequency and
# damping. Phase and amplitude show the delay, first-order lag and slew rate of amplifier and stack
# before it.

_SMALL = 0.045  # of the range: such steps hardly meet the limit of the rate
_FINE = 8  # steps of the simulation per period
_PERIODS = 4.0  # of the ringing that a record must hold
_SEEN = 8.0  # noises that the ringing must be
_SLEWS = (0.03, 0.1, 0.3, 1.0, 3.0)  # to begin with, steps per period of the resonance
# Standard deviation of what this leaves out (a loop that widens with the rate), as a part of the
# value, by simulation: seen on 12 random stages of docs/commissioning_piezo.py, checked on others.
SWING_ERRORS = {"resonance": 1e-5, "damping": 1e-3, "lag": 0.2, "slew": 0.03}
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


def fitted_swing(
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

    parts = [_cut_ringing(s, omega, dt) for s in steps]
    thresholds = np.array(loops.thresholds)
    levels = np.array([*before, *(s.u[-1] for s in steps)])
    plays = moved(levels, thresholds)[len(before) - 1 : -1]

    weights = np.array(loops.weights)

    def missed(p: Array) -> Array:
        lag, slew, delay = p[0] * dt, math.exp(p[1]), p[2] * dt
        missing = []
        for s, y in zip(parts, plays, strict=True):
            volts = s.u[0] + _lagged_step(len(s.x), _size(s), lag, slew, dt / _FINE, delay)
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
    # A step up and the one back err alike, so both together are a cluster.
    pairs = _edges([s.x for s in parts])[::2]
    driven = clusters.spread(chosen.jac, chosen.fun, pairs)
    lag = float(chosen.x[0] + chosen.x[-1]) * dt
    slew = math.exp(best.x[1]) if limited else largest / max(lag, dt)
    late_slope = np.array([dt, *[0.0] * (len(chosen.x) - 2), dt])
    slew_slope = np.array([0.0, slew, 0.0])[: len(chosen.x)] * limited
    slopes = (np.diag([0.5 / math.pi, 1.0]), np.stack([late_slope, slew_slope]))
    frequency = omega / (2.0 * math.pi)
    values = np.array([frequency, damping, lag, slew])
    hidden = np.array(list(SWING_ERRORS.values())) * values
    sure = map(_sure, (free, driven), slopes, np.split(hidden, 2))
    spread, half = (np.concatenate(one).tolist() for one in zip(*sure, strict=True))
    return Swing(frequency, damping, lag, slew, limited, tuple(spread), tuple(half))


def _size(step: Record) -> float:
    return float(step.u[-1] - step.u[0])


def _cut_ringing(step: Record, omega: float, dt: float) -> Record:
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
    return _less(x, basis)


def _step(x: Array, goal: Array, omega: float, damping: float, dt: float) -> Array:
    """Residual of the oscillator's response to a moving equilibrium, beside gain and drift."""
    u = np.linspace(0.0, 1.0, len(x))
    shape = _swung(goal / np.abs(goal).max(), omega, damping, dt / _FINE)[::_FINE]
    return _less(x, np.stack([np.ones_like(u), u, shape], axis=1))


def _less(x: Array, basis: Array) -> Array:
    q = np.linalg.qr(basis)[0]
    return np.asarray(x - q @ (q.T @ x))


def _lagged_step(n: int, size: float, lag: float, slew: float, h: float, delay: float) -> Array:
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


# With plays, the width of a curve depends on its depth only. Other widths mean a loop that varies
# with position.

_LEVELS = 40  # efforts at which both ways are compared
_TURNED = 1e-3  # of the range: a turning point


class Curve(NamedTuple):
    """A branch down from the top, and the first-order curve back up."""

    turn: float  # turning point, V
    # u, x, model: effort in V, position and that of the plays in m, from the top on
    u: Array
    x: Array
    model: Array
    # opening, modelled: greatest distance between both ways at one effort, and that of the plays,
    # m
    opening: float
    modelled: float


def curves(swing: Record, found: Loops, dt: float) -> list[Curve]:
    u, x, left = predict(found, swing, dt)
    near = _TURNED * np.ptp(u)
    tops = np.flatnonzero(u >= u.max() - near)
    breaks = np.flatnonzero(np.diff(tops) > 1)
    made = []
    for k in breaks.tolist():
        part = slice(int(tops[k]), int(tops[k + 1]) + 1)
        low = int(np.argmin(u[part]))
        own, model = x[part], (x - left)[part]
        there = [_opening(u[part], values, low) for values in (own, model)]
        made.append(Curve(float(u[part][low]), u[part], own, model, *there))
    return made


def apart(every: list[Curve]) -> float:
    """Deviation of the curves' widths from the plays', over the widest."""
    widest = max((c.opening for c in every), default=0.0)
    most = max((abs(c.opening - c.modelled) for c in every), default=0.0)
    return most / widest if widest > 0.0 else 0.0


def _opening(u: Array, x: npt.NDArray[np.float64], low: int) -> float:
    """Greatest distance between the two branches, at efforts between their ends."""
    at = np.linspace(u[low], u.max(), _LEVELS + 2)[1:-1]
    down = np.interp(at, u[low::-1], x[low::-1])
    return float(np.max(np.abs(down - np.interp(at, u[low:], x[low:]))))
