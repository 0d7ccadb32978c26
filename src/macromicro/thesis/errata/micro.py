"""Errata of Chapter 5 on heating, cooling and control of the micro-stage."""

from __future__ import annotations

import math

from macromicro.models import electrothermal
from macromicro.models.weighted_gain import Exponential, Weighted, exponential, weighted
from macromicro.thesis.errata.entry import Figure

AMBIENT = 25.0  # degC, Section 5.2.2
FULL_CONTRACTION = 107.5  # degC
DC_GAIN = electrothermal.N0 / electrothermal.D0
STROKE = 3.98  # mm, Section 5.2.2


def _logarithm() -> tuple[Figure, ...]:
    p = Exponential()
    log = math.log(1.0 - (exponential(p, 1.55) - p.y0) / p.b)
    return (
        Figure("A from (5.4) as printed, at 1.55 V of (5.5)", log / 0.05, "1/V", p.a),
        Figure("A with the minus sign", -log / 0.05, "1/V", p.a),
        Figure("argument of the logarithm at 84 degC", 1.0 - (84.0 - p.y0) / p.b),
    )


def _dc_gain() -> tuple[Figure, ...]:
    return (Figure("DC gain of (5.6), 0.001552 / 0.001537", DC_GAIN),)


def _runaway() -> tuple[Figure, ...]:
    low = Weighted().low
    silent = low.x0 - math.log(1.0 + low.y0 / low.b) / low.a
    return (
        Figure("(5.8) at 1.8 V", weighted(Weighted(), 1.8), "K above ambient"),
        Figure("(5.8) at 1.9 V", weighted(Weighted(), 1.9), "K above ambient"),
        Figure("CTRL below which (5.8) is zero", silent, "V", 1.3),
    )


def _cooling() -> tuple[Figure, ...]:
    y, steps = 0.0, []
    for _ in range(4):
        steps.append(y)
        y = 1.0 - y  # y_(k+1) = u - y_k
    return (
        Figure("third sample of the step response of 1/(z+1), printed form", steps[2]),
        Figure("its fourth sample, alternating from then on", steps[3]),
        Figure("time to 63 % of 1/(s+1)", -math.log(1.0 - 0.63), "s", 1.0),
    )


def _offset() -> tuple[Figure, ...]:
    return (Figure("83 - 57.66", 83.0 - 57.66, "K", 25.5),)


def _time_constants() -> tuple[Figure, ...]:
    kp, ki, kaw = 3.0, 30.0, 30.0
    return (
        Figure("K_p / K_i, time constant of the integral action", kp / ki, "s"),
        Figure("1 / K_aw, time constant of the anti-windup", 1.0 / kaw, "s"),
    )


def _saturating() -> tuple[Figure, ...]:
    rise = exponential(Exponential(), 1.6)
    return (
        Figure("(5.5) at 1.6 V, absolute", rise + AMBIENT, "degC"),
        Figure("times the DC gain of (5.6)", DC_GAIN * rise + AMBIENT, "degC"),
        Figure(
            "the same at 1.575 V",
            DC_GAIN * exponential(Exponential(), 1.575) + AMBIENT,
            "degC",
        ),
    )


def _held_back() -> tuple[Figure, ...]:
    """The integral at an error of 2 mm with the effort at its limit of 1.9 V, and its speed.

    It comes to rest at K_i e = K_aw (K_p e + i - 1.9).
    """
    kp, error, limit = 3.0, 2.0, 1.9
    return (
        Figure("proportional effort of the first step, 2 mm", kp * error, "V"),
        Figure("integral effort after anti-windup if K_i = K_aw", error + limit - kp * error, "V"),
        Figure("time constant of that with 2.25", 1.0 / 2.25, "s"),
        Figure("and with 30", 1.0 / 30.0, "s"),
    )


def _scales() -> tuple[Figure, ...]:
    return (
        Figure("full contraction above ambient", FULL_CONTRACTION - AMBIENT, "K"),
        Figure("asymptote, absolute", 83.0 + AMBIENT, "degC"),
    )


def _digits() -> tuple[Figure, ...]:
    low = Weighted().low
    return (
        Figure("the lower curve of (5.8) at 1.6 V", exponential(low, 1.6), "K", 82.581682),
        Figure("the upper curve of (5.8) at 1.6 V", weighted(Weighted(join=-1.0), 1.6), "K"),
    )


def _start() -> tuple[Figure, ...]:
    """(2.11) before any heating: the sum is empty, the output is its first term."""
    return (
        Figure("first term as printed, -f+, for a stroke from 0", -STROKE, "mm"),
        Figure("output of the extended actuator, f-", 0.0, "mm"),
    )


def _triangle() -> tuple[Figure, ...]:
    return (
        Figure("lower limit of the input if it is minus the upper one", -107.5, "degC"),
        Figure("temperature from which the kiln heats", 25.0, "degC"),
    )


EVIDENCE = {
    13: _start,
    33: _triangle,
    8: _logarithm,
    9: _dc_gain,
    11: _runaway,
    12: _cooling,
    17: _offset,
    22: _time_constants,
    29: _saturating,
    30: _scales,
    31: _digits,
    46: _held_back,
}
