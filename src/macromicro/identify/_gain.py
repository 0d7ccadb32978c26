"""Static gain from steady temperatures: (5.2)-(5.5), and its upper half (5.7)-(5.8)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.identify.notices import ConvergenceWarning, notice
from macromicro.identify.records import signal
from macromicro.identify.search import least_squares
from macromicro.identify.witnesses import within
from macromicro.models.weighted_gain import Exponential, Weighted, weighted


class GainFit(NamedTuple):
    model: Exponential  # b (K), a (1/V), y0 (K), x0 (V)
    interval: Array  # 95 % limits of b, a, y0; NaN where the method gives none
    asymptote: float  # b + y0, K
    asymptote_interval: tuple[float, float]  # Its 95 % limits, K
    rms: float  # distance of the points, K


def _checked(volts: npt.ArrayLike, rise: npt.ArrayLike, least: int) -> tuple[Array, Array]:
    """Both in order of the voltage, checked for number, equality and rise."""
    x, y = signal(volts, "CTRL"), signal(rise, "steady temperature")
    if len(x) != len(y) or len(x) < least or len(np.unique(x)) < len(x):
        found = f"voltages and temperatures number {len(x)} and {len(y)}"
        raise ProblemError("static gain", found, f"Give {least} or more pairs, all different.")
    order = np.argsort(x)
    x, y = x[order], y[order]
    if np.any(np.diff(y) <= 0.0):
        raise InputError("steady temperature", list(y), "values that rise with CTRL")
    return x, y


def asymptote(rise: npt.ArrayLike) -> float:
    """y_inf of (5.3) from three last values at equal steps of CTRL (Aitken)."""
    y = signal(rise, "steady temperature")[-3:]
    steps = np.diff(y)
    if len(steps) != 2 or not steps[0] > steps[1] > 0.0:
        raise InputError("asymptote", list(y), "three values whose differences shrink")
    return float(y[-1] + steps[1] ** 2 / (steps[0] - steps[1]))


def linearised(volts: npt.ArrayLike, rise: npt.ArrayLike, y_inf: float | None = None) -> GainFit:
    """The thesis' method (5.3)-(5.5) for the static gain, ill-conditioned in A."""
    # x0, y0 from the lowest point, B from the asymptote, A by least squares through the origin on A
    # x' = y', y' = -ln(1 - (y - y0) / B); (5.4) is printed without its minus sign.
    x, y = _checked(volts, rise, 3)
    if y_inf is None:
        if np.ptp(np.diff(x)[-2:]) > 1e-6:
            raise InputError("static gain", list(x), "equal steps of CTRL, or y_inf given")
        y_inf = asymptote(y)
    x0, y0 = float(x[0]), float(y[0])
    b = y_inf - y0
    if np.any(y >= y_inf):
        raise InputError("static gain, y_inf", y_inf, f"more than all temperatures ({y[-1]:.6g})")
    dx, dy = x[1:] - x0, -np.log(1.0 - (y[1:] - y0) / b)
    a = float(dx @ dy / (dx @ dx))
    deviation = dy - a * dx
    free = len(dx) - 1
    std = float(np.sqrt(deviation @ deviation / free / (dx @ dx)))

    reach = within(free) * std
    interval = np.array([[np.nan, np.nan], [a - reach, a + reach], [np.nan, np.nan]])
    model = Exponential(b, a, x0, y0)
    return GainFit(model, interval, y_inf, (np.nan, np.nan), _rms(model, x, y))


def nonlinear(volts: npt.ArrayLike, rise: npt.ArrayLike) -> GainFit:
    """b, a and y0 of (5.2) by non-linear least squares, x0 at the lowest voltage."""
    x, y = _checked(volts, rise, 4)
    x0 = float(x[0])

    def residual(theta: Array) -> Array:
        return np.asarray(theta[0] * -np.expm1(-theta[1] * (x - x0)) + theta[2] - y)

    start = [1.05 * np.ptp(y), 3.0 / np.ptp(x), y[0]]
    scale = [float(np.ptp(y)), 1.0 / float(np.ptp(x)), float(np.ptp(y))]
    found = least_squares(residual, start, x_scale=scale, method="lm", xtol=1e-12, ftol=1e-12)
    if found.status <= 0:
        notice(ConvergenceWarning, f"static gain: {found.message}; last values returned")
    free = len(x) - 3
    variance = float(found.fun @ found.fun) / free
    covariance = np.linalg.inv(found.jac.T @ found.jac) * variance
    factor = within(free)
    reach = factor * np.sqrt(np.diag(covariance))
    b, a, y0 = (float(v) for v in found.x)
    across = np.array([1.0, 0.0, 1.0])
    both = factor * float(np.sqrt(across @ covariance @ across))
    model = Exponential(b, a, x0, y0)
    return GainFit(
        model,
        np.column_stack([found.x - reach, found.x + reach]),
        b + y0,
        (b + y0 - both, b + y0 + both),
        _rms(model, x, y),
    )


def _rms(model: Exponential, x: Array, y: Array) -> float:
    fit = model.b * -np.expm1(-model.a * (x - model.x0)) + model.y0
    return float(np.sqrt(np.mean((fit - y) ** 2)))


def upper(
    low: Exponential,
    steady: Mapping[float, float],
    goals: Mapping[float, float],
    start: float = 1.625,
) -> Weighted:
    """The whole (5.8): the second exponential and the transition (5.7) to it."""
    # The offset is the lower curve at 1.6 V, as in the thesis (82.58). The rest by least squares,
    # softly held at the printed values where the data do not determine it.
    if len(goals) < 2:
        raise InputError("upper gain, goals", len(goals), "2 voltages above the stop, or more")
    offset = _at(low, 1.6)
    printed = np.array([np.log(10.0), np.log(10.0), np.log(40.0), 1.7])

    def model(theta: Array) -> Weighted:
        scale, rate, sharpness = (float(v) for v in np.exp(theta[:3]))
        return Weighted(low, scale, rate, start, offset, sharpness, float(theta[3]))

    def residual(theta: Array) -> Array:
        p = model(theta)
        below = [(weighted(p, v) - _at(low, v)) / 0.1 for v in steady]
        above = [(weighted(p, v) / y - 1.0) / 0.01 for v, y in goals.items()]
        return np.concatenate([below, above, 0.1 * (theta - printed)])

    reach = np.array([4.0, 3.0, 1.5, 0.1])
    found = least_squares(residual, printed, bounds=(printed - reach, printed + reach))
    if found.status <= 0:
        notice(ConvergenceWarning, f"upper gain: {found.message}; last values returned")
    return model(found.x)


def _at(p: Exponential, volts: float) -> float:
    return p.b * -float(np.expm1(-p.a * (volts - p.x0))) + p.y0
