"""Minimum-energy efforts that bring carriage and swing to rest at a place, a horizon ahead.

Modes without friction: X + V / a, V and the damped swing, X = (1 + share) x + share q, V = X'.
w(k) = c(N - 1 - k)' (G + R)^-1 eta: c(j) the state that a unit effort leaves j periods later,
G = sum c c', eta what the free motion lacks, R the allowed error (Bryson and Ho, Applied
Optimal Control, 1975, Section 5.3).
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.columns import Meaning
from macromicro.control.terminal import model
from macromicro.control.terminal.model import Motion, Terminal
from macromicro.kernel import kernel

# What an effort of 1 V is worth: place (m), speed (m/s), deflection (m), its speed (m/s).
_X, _V, _Q, _S = 3e-6, 5e-4, 1e-5, 1.5e-3


class Modes(NamedTuple):
    rate: Annotated[float, Meaning("of the speed's decay", "1/s")]
    tied: Annotated[float, Meaning("deflection per speed while the speed decays", "s")]
    fall: Annotated[float, Meaning("of the speed in a period")]
    a: Annotated[float, Meaning("swing over a period: q = a q + b s, s = c q + d s")]
    b: Annotated[float, Meaning("swing over a period: q = a q + b s, s = c q + d s")]
    c: Annotated[float, Meaning("swing over a period: q = a q + b s, s = c q + d s")]
    d: Annotated[float, Meaning("swing over a period: q = a q + b s, s = c q + d s")]
    place: Annotated[float, Meaning("what a unit effort of one period leaves")]
    speed: Annotated[float, Meaning("what a unit effort of one period leaves")]
    deflection: Annotated[float, Meaning("what a unit effort of one period leaves")]
    swing: Annotated[float, Meaning("what a unit effort of one period leaves")]


class Landing(NamedTuple):
    """Weights of `c` for each mode."""

    place: float
    speed: float
    deflection: float
    swing: float


@kernel
def modes(p: Terminal, dt: float) -> Modes:
    whole = 1.0 + p.share
    rate = p.drag / whole
    fall = math.exp(-rate * dt)
    speed = p.push * (1.0 - fall) / rate
    place = p.push * dt / rate
    w = 2.0 * math.pi * p.frequency * math.sqrt(whole)
    if w <= 0.0:
        return Modes(rate, 0.0, fall, 0.0, 0.0, 0.0, 0.0, place, speed, 0.0, 0.0)
    d = whole * p.decay + 0.5 * p.drag * p.share / whole
    tied = rate / (rate * rate - 2.0 * d * rate + w * w)
    a, b, c, e = model.turn(w, d, 0.5 * dt)
    q, s = -tied * p.push * dt, (tied * rate - 1.0) * p.push * dt
    left_q, left_s = a * q + b * s, c * q + e * s
    a, b, c, e = model.turn(w, d, dt)
    return Modes(rate, tied, fall, a, b, c, e, place, speed, left_q, left_s)


@kernel
def planned(p: Terminal, m: Modes, at: Motion, goal: float, periods: int) -> Landing:
    g11, g12, g13, g14 = _X * _X, 0.0, 0.0, 0.0
    g22, g23, g24 = _V * _V, 0.0, 0.0
    g33, g34, g44 = _Q * _Q, 0.0, _S * _S
    v, q, s = m.speed, m.deflection, m.swing
    speed = (1.0 + p.share) * at.v + p.share * at.s
    end_v, end_q, end_s = speed, at.q - m.tied * speed, at.s + m.tied * m.rate * speed
    for _ in range(periods):
        g11 += m.place * m.place
        g12 += m.place * v
        g13 += m.place * q
        g14 += m.place * s
        g22 += v * v
        g23 += v * q
        g24 += v * s
        g33 += q * q
        g34 += q * s
        g44 += s * s
        v, q, s = m.fall * v, m.a * q + m.b * s, m.c * q + m.d * s
        end_v = m.fall * end_v
        end_q, end_s = m.a * end_q + m.b * end_s, m.c * end_q + m.d * end_s
    lack = (1.0 + p.share) * (goal - at.x) - p.share * at.q - speed / m.rate
    # (G + R) weights = lack by L D L'
    l21, l31, l41 = g12 / g11, g13 / g11, g14 / g11
    d2 = g22 - l21 * g12
    l32, l42 = (g23 - l21 * g13) / d2, (g24 - l21 * g14) / d2
    d3 = g33 - l31 * g13 - l32 * l32 * d2
    l43 = (g34 - l31 * g14 - l32 * l42 * d2) / d3
    d4 = g44 - l41 * g14 - l42 * l42 * d2 - l43 * l43 * d3
    y1 = lack
    y2 = -end_v - l21 * y1
    y3 = -end_q - l31 * y1 - l32 * y2
    y4 = -end_s - l41 * y1 - l42 * y2 - l43 * y3
    z4 = y4 / d4
    z3 = y3 / d3 - l43 * z4
    z2 = y2 / d2 - l32 * z3 - l42 * z4
    z1 = y1 / g11 - l21 * z2 - l31 * z3 - l41 * z4
    return Landing(z1, z2, z3, z4)


@kernel
def efforts(m: Modes, plan: Landing, periods: int) -> tuple[float, float, float]:
    v, q, s = m.speed, m.deflection, m.swing
    first, lowest, highest = 0.0, math.inf, -math.inf
    for _ in range(periods):  # from the last period to the first
        first = plan.place * m.place + plan.speed * v + plan.deflection * q + plan.swing * s
        lowest, highest = min(lowest, first), max(highest, first)
        v, q, s = m.fall * v, m.a * q + m.b * s, m.c * q + m.d * s
    return first, lowest, highest
