"""Errata of Chapter 4, the macro-stage."""

from __future__ import annotations

import math

import numpy as np

from macromicro.design.margins import (
    Crossover,
    PdTaps,
    damping_margin,
    first_crossover,
    lowest_frequency,
    pd_by_margin,
    pd_by_time,
)
from macromicro.models.macro import Linear, Motor, discretised, jump, position_transfer, transfer
from macromicro.thesis.chapter4.pd_route import trial
from macromicro.thesis.errata.entry import Figure

INITIAL = (0.00245865, 0.0000998447)  # (4.9)
TUNED = (0.0124593, 0.0112178)  # (4.10) as printed
STEP = 3000.0  # counts
DEAD_ZONE = 3.0  # V
ONES = Motor(*[1.0] * 7)


def loop(now: float, before: float) -> Crossover:
    """Crossover and phase margin of the controller (now z + before) / z with (4.4)."""
    num, den = position_transfer(Linear())
    return first_crossover(np.polymul([now, before], num), np.polymul([1.0, 0.0], den), Linear().dt)


def _state_space() -> tuple[Figure, ...]:
    """(4.1) and its corrected form with every constant 1: the slower pole."""
    printed = max(np.linalg.eigvals(np.array([[-1.0, 1.0], [1.0, -1.0]])).real)
    right = max(np.linalg.eigvals(np.array([[-1.0, -1.0], [1.0, -1.0]])).real)
    return (
        Figure("slower pole of (4.1) as printed, all constants 1", float(printed), "rad/s"),
        Figure("with -K_b/L", float(right), "rad/s"),
        Figure("pole of (4.2), with that sign, no inductance", transfer(ONES)[1], "rad/s"),
    )


def _pole() -> tuple[Figure, ...]:
    a, held = Linear().a, discretised(*transfer(ONES), 1.0)
    return (
        Figure("pole of (4.3) in z, a as printed (positive)", a),
        Figure("pole with the identified a", -a),
        Figure("its speed", -math.log(-a) / Linear().dt, "rad/s"),
        Figure("pole of (4.3) from (4.2), all constants 1, 1 s", -held.a),
    )


def _regression() -> tuple[Figure, ...]:
    """A known system, y_k = 0.9 y_(k-1) + 0.5 u_(k-1), in the printed regression."""
    u = np.array([1.0, 0.0, -1.0, 2.0, 0.5, -0.5, 1.5, 0.0])
    y = np.zeros(9)
    for k in range(8):
        y[k + 1] = 0.9 * y[k] + 0.5 * u[k]
    found = np.linalg.lstsq(np.column_stack([y[:-1], u]), y[1:], rcond=None)[0]
    return (
        Figure("parameter beside y for a_1 = -0.9, which is -a_1", float(found[0])),
        Figure("parameter beside u for b_1 = 0.5, which is +b_1", float(found[1]), printed=-0.5),
    )


def _negative_side() -> tuple[Figure, ...]:
    a0, delta = 0.364, 0.636
    return (
        Figure("(4.5) as printed at -1 V", -(a0 - delta), "V"),
        Figure("as read, at -1 V", jump(a0, delta, -1.0), "V"),
    )


def _limit() -> tuple[Figure, ...]:
    linear = Linear()
    gain = linear.b / (1.0 + linear.a)
    return (
        Figure("(4.7) without the stray sign", (0.364 + 0.0636) * gain, "counts/s", 1700.0),
        Figure("(4.8) without the stray sign", (0.364 + 0.636) * gain, "counts/s", 3977.0),
    )


def _controllers() -> tuple[Figure, ...]:
    initial, plus, minus = loop(*INITIAL), loop(*TUNED), loop(TUNED[0], -TUNED[1])
    return (
        Figure("crossover of (4.9), plus", initial.frequency, "rad/s"),
        Figure("its phase margin", initial.phase_margin, "deg"),
        Figure("crossover of (4.10), plus", plus.frequency, "rad/s", 4.91),
        Figure("crossover of (4.10), minus", minus.frequency, "rad/s", 4.91),
        Figure("its phase margin", minus.phase_margin, "deg"),
        Figure("phase margin for a damping ratio of 1.05", damping_margin(1.05), "deg"),
    )


def _saturation() -> tuple[Figure, ...]:
    now, before = TUNED
    return (
        Figure("first sample of a 3000-count step under (4.10)", now * STEP, "V"),
        Figure("second, lifted by the dead-zone inverse", (now - before) * STEP + DEAD_ZONE, "V"),
    )


def _reach() -> tuple[Figure, ...]:
    return (Figure("a test input of 2 V behind the dead-zone inverse", 2.0 + DEAD_ZONE, "V"),)


def _asked(ratio: float) -> float:
    """First and largest effort [V] of a 3000-count step under the PD of a damping ratio.

    The crossover is the lowest that the ratio allows, where no derivative action is left.
    """
    num, den = position_transfer(Linear())
    margin = damping_margin(ratio)
    frequency = lowest_frequency(num, den, Linear().dt, margin)
    return pd_by_margin(num, den, Linear().dt, frequency, margin).now * STEP + DEAD_ZONE


def _damping() -> tuple[Figure, ...]:
    from scipy.optimize import brentq

    needed = float(brentq(lambda ratio: _asked(ratio) - 5.0, 1.0, 4.0, xtol=1e-6))
    return (
        Figure("effort of the model with a ratio of 1.05", _asked(1.05), "V", 5.0),
        Figure("damping ratio that needs 5 V", needed, "", 1.05),
    )


def _overshoot() -> tuple[Figure, ...]:
    """The tuned model's step of 3000 counts without and with derivative time."""
    num, den = position_transfer(Linear())
    held = PdTaps(TUNED[0], -TUNED[1]).derivative_time(Linear().dt)

    def of(frequency: float, time: float) -> float:
        return trial(pd_by_time(num, den, Linear().dt, frequency, time)).overshoot

    return (
        Figure("overshoot without derivative time at 9.91 rad/s", of(9.91, 0.0), "counts"),
        Figure("at 4.91 rad/s", of(4.91, 0.0), "counts"),
        Figure("at 2 rad/s", of(2.0, 0.0), "counts"),
        Figure("with the derivative time of (4.10) at 9.91 rad/s", of(9.91, held), "counts"),
        Figure("at 4.91 rad/s", of(4.91, held), "counts"),
    )


EVIDENCE = {
    1: _state_space,
    2: _pole,
    3: _regression,
    4: _negative_side,
    5: _limit,
    6: _controllers,
    7: _saturation,
    19: _reach,
    42: _damping,
    43: _overshoot,
}
