"""Errata of Chapter 5 on heating, cooling and control of the micro-stage."""

from __future__ import annotations

import math

from macromicro.models import electrothermal
from macromicro.models.weighted_gain import Exponential, Weighted, exponential, weighted
from macromicro.report.errata.entry import Erratum, Figure, Formula, Quote

AMBIENT = 25.0  # degC, Section 5.2.2
FULL_CONTRACTION = 107.5  # degC
DC_GAIN = electrothermal.N0 / electrothermal.D0


def _logarithm() -> tuple[Figure, ...]:
    """(5.4) on points of (5.5) itself: it should give back the exponent."""
    p = Exponential()
    log = math.log(1.0 - (exponential(p, 1.55) - p.y0) / p.b)
    return (
        Figure("A from (5.4) as printed, at 1.55 V of (5.5)", log / 0.05, "1/V", p.a),
        Figure("A with the minus sign", -log / 0.05, "1/V", p.a),
        Figure("what the logarithm is taken of at 84 degC", 1.0 - (84.0 - p.y0) / p.b),
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
        Figure("its fourth sample, and so on for ever", steps[3]),
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
    """An error of 2 mm with the effort at its limit of 1.9 V: where the integral comes to
    rest, K_i e = K_aw (K_p e + i - 1.9), and how fast."""
    kp, error, limit = 3.0, 2.0, 1.9
    return (
        Figure("proportional effort of the first step, 2 mm", kp * error, "V"),
        Figure("integral effort to which it is led if K_i = K_aw", error + limit - kp * error, "V"),
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


ENTRIES = (
    Erratum(
        8, "(5.4)", "A(x - x0) = ln[1 - (y - y0)/B]",
        "the minus sign is missing, and there is no logarithm for y - y0 >= B",
        "-ln[..], points at or above the asymptote left out", _logarithm,
    ),
    Erratum(
        9, "(5.6)", "T/T_d with a DC gain that is not 1",
        "T_d is called the steady temperature, so the gain should be 1",
        "kept as printed; S7 compares against it", _dc_gain,
        (Quote("5.2.2", "the desired steady-state temperature"),),
    ),
    Erratum(
        10, "Section 5.2.2", "the weighted gain is called (5.9)",
        "it is (5.8); (5.9) is the cooling model",
        "(5.8)", None,
        (
            Quote("5.2.2", "the weighted nonlinear gain, (5.9)"),
            Formula("(5.9)", "1 / (z + 1)"),
        ),
    ),
    Erratum(
        11, "(5.8)", "max(0, ..) below 1.7 V, 10 e^(10 (CTRL - 1.625)) + .. above",
        "it keeps growing where the actuator is said to change no more, its last term tenfold "
        "with every 0.23 V, and is zero where the actuator already responds",
        "bounded above, led down to 1.3 V by a straight line", _runaway,
        (
            Quote("5.3.2", "greater than 1.8 V, the change in response time is minimal"),
            Quote("5.3.2", "signals below 1.3V the actuator does not respond"),
        ),
    ),
    Erratum(
        12, "(5.9)", "1/(z + 1)",
        "its step response swings between 0 and 1; meant is a first-order lag of one second",
        "1/(s + 1)", _cooling,
        (Quote("5.2.2", "the time constant is estimated to be approximately 1 second"),),
    ),
    Erratum(
        17, "(5.3), (5.5)", "B = 25.5",
        "the stated difference is another number", "25.5 in (5.5), as printed", _offset,
    ),
    Erratum(
        22, "Sections 5.1.1, 5.3.2", "\"PD controller with anti-windup\"; K_i = K_aw",
        "the controller is PI; gains in V/(mm s) and 1/s cannot be equal, and the time constants "
        "that equal numbers make differ",
        "PI; K_i = 30 V/(mm s), K_aw = 30 1/s", _time_constants,
        (
            Quote("5.1.1", "PD controller with anti-windup"),
            Quote("Abstract", "a PI controller with anti-windup"),
            Quote("5.3.2", "the time constant of the integrator and the anti-windup control are "
                           "equal"),
        ),
    ),
    Erratum(
        29, "(5.5), (5.6)", "1.6 V counts as not saturated",
        "gain and dynamics together carry 1.6 V beyond the temperature of full contraction, "
        "1.575 V just not",
        "the stop is reached above 1.65 V and not at 1.6 V, as measured (S3)", _saturating,
        (
            Quote("5.2.2", "the time required to reach the saturation temperature of 107.5"),
            Quote("5.2.2", "evident when the input signal exceeds 1.65 V"),
        ),
    ),
    Erratum(
        30, "Section 5.2.2", "83 degC and 107.5 degC, both \"temperature\"",
        "the first is above ambient, the second absolute; read alike, full contraction would lie "
        "24 K above the asymptote that reaches it",
        "83 K above 25 degC; 107.5 degC absolute", _scales,
        (
            Quote("5.2.2", "an output temperature of approximately 83"),
            Quote("5.2.2", "the time required to reach the saturation temperature of 107.5"),
        ),
    ),
    Erratum(
        31, "(5.5), (5.7), (5.8)", "A = 37.86 and 37.8631; u and CTRL",
        "one constant with two values, one input with two names; and the upper curve's offset, "
        "given to eight digits, is the lower curve at 1.6 V, to which it adds another 8 K there",
        "each equation as printed", _digits,
        (
            Formula("(5.5)", "25.5 (1 - e^(-37.86 (CTRL - 1.5)))"),
            Formula("(5.8)", "25.5 (1 - e^(-37.8631 (CTRL - 1.5)))"),
        ),
    ),
    Erratum(
        32, "Section 5.3.2", "Figure 5.13b as evidence from 1.3 V up",
        "the figure shows 1.65 to 1.8 V; nothing is shown above 1.8 V",
        "1.3 and 1.9 V taken as the limits chosen, not as measured", None,
        (
            Quote("5.3.2", "This is true for input signals between 1.3 V and 1.8 V"),
            Quote("Figure 5.13", "(b) 1.65-1.8 V Step"),
        ),
    ),
    Erratum(
        46, "Section 5.3.2, Figure 5.25", "responses with anti-windup, without their gains",
        "K_i and K_aw are not printed; with the only K_i chosen so far, 2.25, and K_aw equal to "
        "it, the first step leads the integral below zero, from where it returns slowly: the "
        "steps end later than without anti-windup",
        "2.25 and 10 shown, neither as the thesis'", _held_back,
        (
            Quote("5.3.1", "A value of K_i = 2.25 is chosen"),
            Quote("5.3.2", "results in more effective operation of the controller"),
        ),
    ),
)  # fmt: skip
