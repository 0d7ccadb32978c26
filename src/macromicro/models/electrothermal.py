"""Electro-thermal heating model of Section 5.2.2: weighted gain (5.7)-(5.8), dynamics (5.6).

Temperatures are in K above ambient.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from macromicro.columns import Meaning
from macromicro.kernel import kernel
from macromicro.models.weighted_gain import Weighted, weighted

# (5.6): T/T_d = (N2 s^2 + N1 s + N0) / (s^3 + D2 s^2 + D1 s + D0)
N2, N1, N0 = 1.001, 0.1483, 0.001552
D2, D1, D0 = 1.491, 0.1604, 0.001537
# Section 5.3.2: below this CTRL voltage [V] the actuator does not respond.
FIRST_RESPONSE = 1.3
PRINTED = Weighted()


class Heating(NamedTuple):
    """State of (5.6) in controllable canonical form; T = N2 s2 + N1 s1 + N0 s0."""

    s0: Annotated[float, Meaning("", "K s^3")]
    s1: Annotated[float, Meaning("ds0/dt", "K s^2")]
    s2: Annotated[float, Meaning("ds1/dt", "K s")]


@kernel
def gain(ctrl: float, ceiling: float) -> float:
    """T_d for CTRL: (5.7)-(5.8), with a ceiling and a continuation to 0."""
    # (5.8) grows without bound and is capped as the driver is. Below 1.469 V it is zero, although
    # the actuator responds from 1.3 V (Section 5.3.2): a line leads to its value at 1.5 V.
    if ctrl <= FIRST_RESPONSE:
        return 0.0
    if ctrl >= 2.2:
        return ceiling
    value = weighted(PRINTED, ctrl)
    if ctrl < 1.5:
        value = max(value, 57.66 * (ctrl - FIRST_RESPONSE) / (1.5 - FIRST_RESPONSE))
    return min(value, ceiling)


@kernel
def step(s: Heating, goal: float, dt: float) -> Heating:
    """State of (5.6) after one step (semi-implicit Euler)."""
    s2 = s.s2 + dt * (goal - D2 * s.s2 - D1 * s.s1 - D0 * s.s0)
    s1 = s.s1 + dt * s2
    s0 = s.s0 + dt * s1
    return Heating(s0, s1, s2)


@kernel
def temperature(s: Heating) -> float:
    """T of (5.6)."""
    return N2 * s.s2 + N1 * s.s1 + N0 * s.s0
