"""Frequency response of an axis by chirps, fitted to a rigid axis and to a compliant drive."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.commission import _exciting
from macromicro.commission.stand import Record
from macromicro.identify import clusters
from macromicro.identify.search import least_squares
from macromicro.machines import sheets
from macromicro.machines.parts import LOAD, MOTOR

Complex = npt.NDArray[np.complex128]

_ALIASES = 2  # of the sampled spectrum, either side
_GONE = -8.0  # real part of a pole, times the period
EVEN = math.sqrt(0.5)  # antiresonance to resonance where nothing shows it: equal masses
DAMPED = 0.04  # damping ratio of the modes tried


class Shape(NamedTuple):
    drag: float  # viscous slope to the mass, 1/s
    lag: float  # of the effort, s
    rise: float = 0.0  # time constant of the current's rise, by which back-EMF acts late, too, s
    resonance: float = 0.0  # of motor and load against each other, Hz; 0: none
    ratio: float = EVEN  # antiresonance to resonance
    damping: float = DAMPED  # ratio, of the load on the drive with the motor held
    at: str = MOTOR  # side of the encoder

    @property
    def rotor(self) -> float:
        return self.ratio**2 if self.resonance > 0.0 else 0.5

    @property
    def held(self) -> float:
        """Antiresonance: frequency of the load with the motor fixed, Hz."""
        return self.ratio * self.resonance


class Spectra(NamedTuple):
    """Spectra of all pairs at the frequencies of the chirp."""

    f: Array  # Hz
    # effort, speed: V, m/s
    effort: Complex
    speed: Complex
    dt: float  # control period, s


def spectra(passes: Sequence[Record], dt: float) -> Spectra:
    n = min(len(one.t) for one in passes)
    u = np.array([one.u[: n - 1] for one in passes])
    v = np.diff([one.x[:n] for one in passes], axis=1) / dt
    f: Array = np.arange((n + 1) // 2) / ((n - 1) * dt)
    rows = (f >= _exciting.LOW) & (f <= _exciting.HIGH / dt)
    efforts, speeds = (np.fft.rfft(w[::2] - w[1::2], axis=1)[:, rows] for w in (u, v))
    return Spectra(f[rows], efforts, speeds, dt)


def response(shape: Shape, f: Array, dt: float) -> Complex:
    """Mean speed over a period, per effort, of an axis with a mass of 1, sampled."""
    k = np.arange(-_ALIASES, _ALIASES + 1)[:, None]
    s = np.asarray(2j * math.pi * (f + k / dt), np.complex128)
    drag, seen = sheets.impedance(
        s,
        rotor=shape.rotor,
        moved=1.0 - shape.rotor,
        viscous=0.0,
        frequency=shape.held,
        damping=shape.damping,
    )
    speed: Complex = 1.0 / (drag * (1.0 + shape.rise * s) + shape.drag)
    if shape.at == LOAD:
        speed = speed * seen
    # Position after a hold, and its difference over the period that begins with the effort.
    back = np.exp(-2j * math.pi * f * dt)
    shift = (1.0 - back) ** 2 / (back * dt**2)
    found: Complex = shift * np.sum(speed / s**2 * np.exp(-s * shape.lag), axis=0)
    return found


def transients(shape: Shape, f: Array, dt: float) -> Complex:
    """Spectra that the poles leave, a row each."""
    z = np.exp(-2j * math.pi * f * dt)
    rows = [np.ones_like(z), z]
    for p in poles(shape) * dt:
        if p.real < _GONE:
            continue  # gone within a period: the constants hold it
        if p.imag == 0.0:
            rows.append(1.0 / (1.0 - math.exp(p.real) * z))
        elif p.imag > 0.0:
            pole = np.exp(p)
            both = 1.0 - 2.0 * pole.real * z + abs(pole) ** 2 * z * z
            rows += [1.0 / both, z / both]
    return np.array(rows)


def poles(shape: Shape) -> Complex:
    rotor, moved, winding = shape.rotor, 1.0 - shape.rotor, np.array([shape.rise, 1.0])
    if shape.resonance <= 0.0:
        free, stiff = np.array([1.0, 0.0]), np.array([1.0])
    else:
        w = 2.0 * math.pi * shape.held
        spring = moved * np.array([2.0 * shape.damping * w, w * w])  # times s
        stiff = np.polyadd([moved, 0.0, 0.0], spring)
        free = np.polyadd(np.polymul([rotor, 0.0], stiff), np.polymul([moved, 0.0], spring))
    every = np.polyadd(np.polymul(free, winding), shape.drag * stiff)
    found: Complex = np.roots(every).astype(np.complex128)
    return found


# Two models are compared with a rigid axis: an encoder on the motor (antiresonance below the
# resonance) and one at the load, behind the drive. The weights are the noise between pairs of
# passes.

_SPACING = 0.05  # of the frequencies tried, natural logarithm
_SLOPES = (5.0, 60.0)  # 1/s, viscous slope to mass, tried
_USUAL = 20.0  # 1/s, the same beside a strong mode
_LATE = (0.4, 0.4)  # periods of lag and of rise to begin with
_RATIOS = {MOTOR: (0.4, 0.6, 0.8, 0.95), LOAD: (EVEN,)}
_BEGUN = 2  # of the frequencies tried, from which searches go on
_LOOKED = 250  # frequencies that are looked at before
_OCTAVE = 0.15  # natural logarithm of the frequency over which noise is taken as one
_LEAST = 5  # frequencies on either side, at least
_EXPLAINED = 0.8  # a mode leaves at most that part of what a stiff axis leaves
_SURE = 0.08  # half of the interval of a mode's frequency, in parts of it, at most
_ALIKE = 0.005  # standard deviation of their ratio by what is left out
_APART = 3.0  # standard errors between resonance and antiresonance, where both are shown
_DULL = 0.4  # damping ratio of what is no resonance any more
_INSIDE = 0.93  # of the highest frequency of the chirp: beyond it a mode is not seen whole
_SEEN = 0.5  # signal's part of a spectrum's power from where it shows something
_BLOCK = 0.2  # natural logarithm of the frequency over which what is left may go together
# Standard deviations of what the model leaves out (friction that is no viscous one, slack, a rotor
# that an encoder behind the drive does not show), as parts, by simulation: seen on random belts.
MODEL_ERRORS = {"resonance": 0.013, "antiresonance": 0.015, "damping": 0.3}
_LATE_BY = 0.05  # periods; the same of the lag


class Mode(NamedTuple):
    shape: Shape  # the axis with its mode; `resonance` 0: none was found
    gain: float  # 1 / mass, m/s^2 per V
    # standard errors of `resonance` (Hz), of `antiresonance` (Hz) where the encoder shows one,
    # where the encoder shows one too of `damping` (ratio), and of `lag` (s); none where there is
    # no mode
    errors: dict[str, float]
    # mean square of what `shape` leaves, in the passes' noise: about 1 where it explains all
    left: float
    seen: tuple[float, float]  # frequencies between which the chirp shows anything, Hz
    frequency: Array  # Hz
    measured: Complex  # speed per effort, m/s/V
    # model, stiff: the same by `shape`, and by the best stiff axis
    model: Complex
    stiff: Complex

    @property
    def found(self) -> bool:
        return self.shape.resonance > 0.0

    @property
    def values(self) -> dict[str, float]:
        every = {
            "resonance": self.shape.resonance,
            "antiresonance": self.shape.held,
            "damping": self.shape.damping,
            "lag": self.shape.lag + self.shape.rise,
        }
        return {name: every[name] for name in self.errors}


class _Fit(NamedTuple):
    shape: Shape
    gain: float
    cost: float  # mean square of what is left, in noise
    errors: dict[str, float]
    apart: float = math.inf  # of its two frequencies, in standard errors


def find_mode(passes: Sequence[Record], dt: float) -> Mode | None:
    if len(passes) < 4:
        return None
    every = spectra(passes, dt)
    measured, noise, share = average(every)
    seen = np.flatnonzero(share >= _SEEN)
    if len(seen) < 8 * _LEAST:
        return None
    top = seen[-1] + 1
    some = Spectra(every.f[:top], every.effort[:, :top], every.speed[:, :top], dt)
    noise = noise[:top]
    stiff = min((_search(some, noise, Shape(d, *_late(dt))) for d in _SLOPES), key=_cost)
    limped = [_best(some, noise, at, stiff.shape) for at in (MOTOR, LOAD)]
    best = min(limped, key=_cost)
    if not _is_mode(best, stiff, float(some.f[-1])):
        best = stiff
    curves = [one.gain * response(one.shape, some.f, dt) for one in (best, stiff)]
    return Mode(
        best.shape, best.gain, best.errors, best.cost, (float(some.f[0]), float(some.f[-1])),
        some.f, measured[:top], curves[0], curves[1],
    )  # fmt: skip


def average(every: Spectra) -> tuple[Complex, Array, Array]:
    power = np.maximum((np.abs(every.effort) ** 2).sum(axis=0), 1e-300)
    response = (every.speed * every.effort.conj()).sum(axis=0) / power
    left = (np.abs(every.speed - response * every.effort) ** 2).sum(axis=0)
    noise = _smooth(np.log(every.f), left / (len(every.effort) - 1))
    whole = _smooth(np.log(every.f), (np.abs(every.speed) ** 2).mean(axis=0))
    return response, np.sqrt(0.5 * noise), 1.0 - np.minimum(noise / whole, 1.0)


def _smooth(x: Array, y: Array) -> Array:
    """Means over `_OCTAVE` on either side."""
    k = np.arange(len(x))
    low = np.maximum(np.minimum(np.searchsorted(x, x - _OCTAVE), k - _LEAST), 0)
    high = np.minimum(np.maximum(np.searchsorted(x, x + _OCTAVE), k + _LEAST), len(x))
    total = np.concatenate([[0.0], np.cumsum(y)])
    found: Array = (total[high] - total[low]) / (high - low)
    return found


def _late(dt: float) -> tuple[float, float]:
    return _LATE[0] * dt, _LATE[1] * dt


def _cost(fit: _Fit) -> float:
    return fit.cost


def _is_mode(fit: _Fit, stiff: _Fit, top: float) -> bool:
    """Whether it beats a rigid axis and is a resonance within the measured band."""
    shape = fit.shape
    return (
        fit.cost < _EXPLAINED * stiff.cost
        and 1.3 * _exciting.LOW < shape.resonance < _INSIDE * top
        and shape.damping / shape.ratio < _DULL
        and 2.0 * fit.errors["resonance"] < _SURE * shape.resonance
        # An antiresonance at the resonance takes it away: what is left is some other disturbance.
        and fit.apart > _APART
    )


def _best(some: Spectra, noise: Array, at: str, stiff: Shape) -> _Fit:
    """The best mode for an encoder position: weak beside the rigid axis, or dominant."""
    every = max(len(some.f) // _LOOKED, 1)
    thin = Spectra(some.f[::every], some.effort[:, ::every], some.speed[:, ::every], some.dt)
    step = np.arange(math.log(1.2 * _exciting.LOW), math.log(float(some.f[-1])), _SPACING)
    tried = [
        base._replace(resonance=f, ratio=ratio, at=at)
        for f in np.exp(step).tolist()
        for ratio in _RATIOS[at]
        for base in (stiff, Shape(_USUAL, *_late(some.dt)))
    ]
    costs = [float(np.mean(_residual(thin, noise[::every], one)[1] ** 2)) for one in tried]
    begun: list[Shape] = []
    for k in np.argsort(costs).tolist():
        near = (abs(math.log(tried[k].resonance / b.resonance)) < 3 * _SPACING for b in begun)
        if len(begun) < _BEGUN and not any(near):
            begun.append(tried[k])
    rough = min((_search(thin, noise[::every], shape) for shape in begun), key=_cost)
    return _search(some, noise, rough.shape)


def _residual(some: Spectra, noise: Array, shape: Shape) -> tuple[float, Array]:
    """The best gain, and the residual over the noise, shape (pairs, 2 n)."""

    def rows(values: Complex) -> Array:
        found: Array = np.concatenate([values.real, values.imag], axis=-1)
        return found

    basis = np.linalg.qr(rows(transients(shape, some.f, some.dt) / noise).T)[0]
    pushed = rows(response(shape, some.f, some.dt) / noise * some.effort)
    went = rows(some.speed / noise)
    pushed, went = (y - (y @ basis) @ basis.T for y in (pushed, went))
    gain = float(np.sum(pushed * went) / np.sum(pushed * pushed))
    return gain, went - gain * pushed


def _search(some: Spectra, noise: Array, begin: Shape) -> _Fit:
    """The local optimum, with errors by blocks of pairs and frequencies."""
    dt, limp, inner = some.dt, begin.resonance > 0.0, begin.at == MOTOR
    top = float(some.f[-1])
    # Lags begin at 1, so that differences are not taken over parts of nothing.
    low = [math.log(0.01), 1.0, 1.0, math.log(_exciting.LOW), math.log(1e-3), 0.1]
    high = [math.log(3000.0), 21.0, 9.0, math.log(top), 0.0, 0.995]
    count = 3 if not limp else 6 if inner else 5

    def shape(x: Array) -> Shape:
        d, lag, rise = math.exp(x[0]), (float(x[1]) - 1.0) * dt, (float(x[2]) - 1.0) * dt
        if not limp:
            return Shape(d, lag, rise)
        ratio = float(x[5]) if inner else begin.ratio
        return Shape(d, lag, rise, math.exp(x[3]), ratio, math.exp(x[4]), begin.at)

    def missed(x: Array) -> Array:
        return _residual(some, noise, shape(x))[1].ravel()

    first = [math.log(begin.drag), 1.0 + begin.lag / dt, 1.0 + begin.rise / dt]
    if limp:
        first += [math.log(begin.resonance), math.log(begin.damping), begin.ratio]
    bounds = (np.array(low[:count]), np.array(high[:count]))
    start = np.clip(first[:count], bounds[0] + 1e-3, bounds[1] - 1e-3)
    done = least_squares(missed, start, bounds=bounds, x_scale="jac", ftol=1e-6, max_nfev=25)
    best = shape(done.x)
    gain, left = _residual(some, noise, best)
    cost = float(np.mean(left**2))
    if not limp:
        return _Fit(best, gain, cost, {})
    errors, ratio = _errors(some, done.jac.reshape(*left.shape, count), left, best)
    return _Fit(best, gain, cost, errors, (1.0 - best.ratio) / ratio if ratio else math.inf)


def _errors(
    some: Spectra, slopes: Array, left: Array, shape: Shape
) -> tuple[dict[str, float], float]:
    """Standard errors by blocks, last that of the frequency ratio (0 where it is not fitted)."""
    block = np.floor(np.log(some.f / some.f[0]) / _BLOCK).astype(int)
    parts = [np.concatenate([block, block]) == k for k in range(block[-1] + 1)]
    # Lag and rise may do the same to all that is seen: then only their sum is known.
    table = slopes.copy()
    table[..., 2] -= table[..., 1]
    shown = [np.einsum("pni,pnj->pij", table[:, rows], table[:, rows]) for rows in parts]
    scores = [np.einsum("pni,pn->pi", table[:, rows], left[:, rows]) for rows in parts]
    covariance = clusters.by_scores(np.concatenate(shown), np.concatenate(scores)).covariance
    spread = np.sqrt(np.diag(covariance))
    relative, values = {"resonance": float(spread[3])}, {"resonance": shape.resonance}
    ratio = 0.0
    if shape.at == MOTOR:  # behind the drive its damping depends on the motor's part, not shown
        relative["damping"], values["damping"] = float(spread[4]), shape.damping
        relative["antiresonance"] = math.hypot(float(spread[3]), float(spread[5]) / shape.ratio)
        values["antiresonance"] = shape.held
        ratio = math.hypot(float(spread[5]), _ALIKE)
    found = {
        name: values[name] * math.hypot(one, MODEL_ERRORS[name]) for name, one in relative.items()
    }
    found["lag"] = some.dt * math.hypot(float(spread[1]), _LATE_BY)
    return found, ratio
