"""Linear model with friction of the strokes, with its uncertainty.

    M dv/dt = u(t - lag) - Fv v - s (Fc + Fs exp(-(v/vs)^2)) - F0,   s = sgn v

Force is in volts of effort; back-EMF is part of Fv.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.commission import _left_out, _momentum, _pole, _uneven
from macromicro.commission._uneven import Fit, Level, held
from macromicro.commission.stand import BALANCED, CommissionError, Pull, Record
from macromicro.identify import clusters
from macromicro.identify.axis import Axis, simulate
from macromicro.identify.axis_inverse import ECCENTRIC

if TYPE_CHECKING:
    from macromicro.commission._mode import Mode

UNITS = {
    "mass": "V*s^2/m",
    "viscous": "V*s/m",
    "coulomb": "V",
    "offset": "V",
    "stribeck": "V",
    "stribeck_speed": "m/s",
    "lag": "s",
    "resonance": "Hz",
    "antiresonance": "Hz",
    "damping": "1",
    "sine": "V",
    "cosine": "V",
}
FITTED = ("mass", "viscous", "coulomb", "offset", "lag")
_BY_LIMIT = ("limit", "back")  # what a limited force shows as well
_SPEEDS = (1e-3, 0.01, 0.03, 0.1, 0.3)  # Stribeck speeds tried, parts of the top speed
_LIMITS = (0.1, 0.2, 0.4, 0.7)  # of the largest effort: limits of the force to begin with
_LIMITED = 0.7  # a limit must lower the error to that part
_DROPPED = 0.85  # of the breakaway: sliding friction to begin with where none drops
_FINER = 2  # times that the best speed's neighbours are halved


class Model(NamedTuple):
    axis: Axis  # the parameters, in V and m
    level: Level  # friction along the travel
    names: tuple[str, ...]  # the fitted ones
    covariance: Array
    freedom: float  # degrees of freedom of the intervals: strokes less all that was fitted
    rms: float  # of the free runs' positions, m
    hold: float = 0.0  # effort that was beside the strokes' all the time, V: a weight's
    mode: Mode | None = None  # by the chirp

    @property
    def limber(self) -> Mode | None:
        return self.mode if self.mode is not None and self.mode.found else None

    def shaken(self, mode: Mode | None) -> Model:
        made = self._replace(mode=mode)
        if made.limber is None:
            return made
        kept = [k for k, name in enumerate(self.names) if name != "lag"]
        return made._replace(
            axis=self.axis._replace(lag=made.limber.values["lag"]),
            names=tuple(self.names[k] for k in kept),
            covariance=self.covariance[np.ix_(kept, kept)],
        )

    @property
    def whole(self) -> Axis:
        """The parameters with all of the constant force."""
        return self.axis._replace(offset=self.axis.offset + self.hold)

    def half_width(self, name: str) -> float:
        k = self.names.index(name)
        return self.within * math.sqrt(max(float(self.covariance[k, k]), 0.0))

    @property
    def within(self) -> float:
        """Standard errors in half of a 95 % interval."""
        return clusters.within(self.freedom)


def fitted(
    strokes: Sequence[Record],
    dt: float,
    breakaway: float,
    spread: float,
    slid: float = 0.0,
    pull: Pull = BALANCED,
) -> Model:
    """Parameters with the free simulations from rest nearest to the strokes."""
    # Friction may vary along the travel (`uneven`). The covariance is cluster-robust by strokes
    # (Liang and Zeger 1986); errors that no stroke shows are added (`left_out`). How fast breakaway
    # friction fades is hardly observable but affects the mass, so several speeds are averaged
    # (Hoeting et al. 1999, Bayesian model averaging).
    top = _top(strokes, dt)
    fitted = FITTED if pull == BALANCED else (*FITTED, *ECCENTRIC)
    start = _limited(strokes, breakaway, dt, pull)
    breakaway = max(breakaway - start.viscous * slid, 0.5 * breakaway)
    tried: dict[float, Fit] = {}

    def fit(speed: float, begins: Sequence[Axis]) -> None:
        found = []
        for begin in begins:
            one = held(begin._replace(stribeck_speed=speed * top), breakaway)
            names = fitted if math.isinf(one.limit) else (*fitted, *_BY_LIMIT)
            found.append(
                _uneven.fitted(strokes, one, names, breakaway=breakaway, spread=spread, dt=dt)
            )
        tried[speed] = min(found, key=lambda one: one.square)

    begins = [start]
    if start.coulomb >= breakaway:
        # No search that begins without a drop finds one: what it tries there changes nothing.
        begins.append(start._replace(coulomb=_DROPPED * breakaway, lag=max(start.lag, dt)))
    for speed in _SPEEDS:
        fit(speed, begins)
    for _ in range(_FINER):
        known = sorted(tried)
        best = min(range(len(known)), key=lambda k: tried[known[k]].square)
        for k in {max(best - 1, 0), min(best, len(known) - 2)}:
            fit(math.sqrt(known[k] * known[k + 1]), [start, tried[known[best]].axis])
    every = list(tried.values())
    count = len(fitted)
    squares = np.array([one.square for one in every])
    values = np.array([[getattr(one.axis, n) for n in fitted] for one in every])
    drops = np.array([(one.axis.stribeck, one.axis.stribeck_speed) for one in every])
    chosen = every[int(np.argmin(squares))]
    weights = np.exp(-0.5 * chosen.freedom * (squares / squares.min() - 1.0))
    weights /= weights.sum()
    mean = weights @ values
    away = values - mean
    covariance = sum(
        w * one.covariance[:count, :count] for w, one in zip(weights, every, strict=True)
    )
    covariance += np.einsum("k,ki,kj->ij", weights, away, away)
    shift, hidden = _left_out.beside(mean, fitted, chosen.level.places, dt)
    mean, covariance = mean + shift, covariance + hidden
    if pull.error > 0.0:
        mean, covariance = _told(mean, covariance, fitted, pull)
    mean = _pole.possible(mean, covariance, fitted, clusters.within(chosen.freedom), dt)
    stribeck, speed = weights @ drops
    axis = Axis(
        **dict(zip(fitted, mean.tolist(), strict=True)),
        stribeck=float(stribeck),
        stribeck_speed=float(speed),
        limit=chosen.axis.limit,
        back=chosen.axis.back,
    )
    rms = math.sqrt(chosen.square)
    return Model(axis, chosen.level, fitted, covariance, chosen.freedom, rms)


def _told(
    mean: Array, covariance: Array, names: tuple[str, ...], pull: Pull
) -> tuple[Array, Array]:
    """Parameters and covariance combined with gravity as measured at rest."""
    # Short strokes hardly separate it from a constant force, so both are averaged by their
    # covariance.
    at = [names.index(n) for n in ECCENTRIC]
    off = np.array([pull.sine, pull.cosine]) - mean[at]
    gain = covariance[:, at] @ np.linalg.inv(
        covariance[np.ix_(at, at)] + pull.error**2 * np.eye(len(at))
    )
    better = mean + gain @ off
    kept = [names.index(n) for n in ("mass", "viscous", "coulomb", "lag")]
    if (better[kept] <= 0.0).any() and (mean[kept] > 0.0).all():
        return mean, covariance
    return better, covariance - gain @ covariance[at]


def _limited(strokes: Sequence[Record], breakaway: float, dt: float, pull: Pull) -> Axis:
    """The refined start, with a force limit if that explains the strokes far better."""
    gentle = _begun(_momentum.weakest(strokes), dt, pull)
    start = _begun(strokes, dt, pull) or gentle
    if start is None:
        raise CommissionError(_momentum.APART)
    gentle = gentle or start
    push = max(float(np.abs(s.u).max()) for s in strokes)
    start = start._replace(stribeck_speed=_SPEEDS[1] * _top(strokes, dt))
    free = _search(strokes, start, breakaway, dt)
    plain = _missed(strokes, free, dt)
    best, least = free, _LIMITED
    gentle = gentle._replace(stribeck_speed=start.stribeck_speed)
    # A late force and a limited one look alike: begin on both sides.
    for part, lag in product(_LIMITS, {gentle.lag, 0.1 * dt}):
        tried = gentle._replace(lag=lag, limit=part * push)
        found = _search(strokes, tried, breakaway, dt)
        left = _left(_missed(strokes, found, dt), plain)
        if left < least and found.limit < push:
            best, least = found, left
    return best


def _begun(strokes: Sequence[Record], dt: float, pull: Pull) -> Axis | None:
    """`momentum.begun` with gravity; None where strokes do not determine it."""
    try:
        return _momentum.begun(_momentum.unloaded(strokes, pull), dt)._replace(
            sine=pull.sine, cosine=pull.cosine
        )
    except CommissionError:
        return None


def _search(strokes: Sequence[Record], start: Axis, breakaway: float, dt: float) -> Axis:
    """Output error with uniform friction."""
    from scipy.optimize import least_squares

    top = _top(strokes, dt)
    push = max(float(np.abs(s.u).max()) for s in strokes)
    names = FITTED if math.isinf(start.limit) else (*FITTED, *_BY_LIMIT)
    least = {"viscous": 0.05 * push / top, "coulomb": 0.05 * push, "lag": dt}
    usual = start._replace(offset=0.05 * push)
    scale = np.array([max(getattr(usual, n), least.get(n, 0.0)) for n in names])
    low = np.array([{"offset": -np.inf, "mass": 1e-2}.get(n, 0.0) for n in names])
    begin = np.array([getattr(start, n) for n in names]) / scale
    high = np.array([{"back": 1.0}.get(n, np.inf) for n in names])
    begin = np.clip(begin, low + 1e-3, high - 1e-3)
    some = [_uneven.taken(one) for one in strokes]

    def axis(values: Array) -> Axis:
        found = start._replace(**dict(zip(names, (values * scale).tolist(), strict=True)))
        return held(found, breakaway)

    def missed(values: Array) -> Array:
        every = _missed(strokes, axis(values), dt)
        return np.concatenate([e[k] for e, k in zip(every, some, strict=True)])

    # Differences over a percent: wider than the kinks where a stroke begins and ends.
    found = least_squares(
        missed, begin, bounds=(low, high), jac="3-point", diff_step=1e-2, xtol=1e-6, ftol=1e-8,
        max_nfev=60,
    )  # fmt: skip
    return axis(found.x)


def _missed(strokes: Sequence[Record], axis: Axis, dt: float) -> list[Array]:
    return [s.x - simulate(axis, s.u, dt, float(s.x[0])) for s in strokes]


def _top(strokes: Sequence[Record], dt: float) -> float:
    return max(float(np.abs(np.gradient(s.x, dt)).max()) for s in strokes)


def _left(missed: Sequence[Array], plain: Sequence[Array]) -> float:
    """Residual relative to a plain model: overall, or the mean over strokes against outliers."""

    def squares(each: Sequence[Array]) -> Array:
        found: Array = np.array([np.sum(one**2) for one in each])
        return np.maximum(found, 1e-300)

    mine, other = squares(missed), squares(plain)
    typical = float(np.exp(0.5 * np.mean(np.log(mine / other))))
    return min(math.sqrt(float(mine.sum() / other.sum())), typical)
