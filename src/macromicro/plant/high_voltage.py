"""Amplifier of a piezo stack: range, converter, bandwidth, and the current that charges the stack.

A stack is a capacitor, so the amplifier's current limits how fast its voltage can rise:
dV/dt = I / C.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.kernel import kernel
from macromicro.schema.par import Par


class HighVoltage(NamedTuple):
    """The amplifier and the capacitance that it drives."""

    gain: Annotated[
        float, Par("1", "output per volt of the D/A before it", "PI E-610: 10", positive=True)
    ] = 10.0
    low: Annotated[
        float, Par("V", "lowest output", "PI E-610: -20 to 120 V", lo=-1000.0, hi=0.0)
    ] = -20.0
    high: Annotated[float, Par("V", "highest output", "PI E-610: -20 to 120 V", positive=True)] = (
        120.0
    )
    bits: Annotated[int, Par("", "resolution of the converter before it", lo=8, hi=32)] = 20
    bandwidth: Annotated[
        float, Par("Hz", "small-signal bandwidth with the stack connected", positive=True)
    ] = 3000.0
    current: Annotated[
        float,
        Par(
            "A", "output current", "PI E-610: 100 mA, longer than 30 ms", shown="mA", positive=True
        ),
    ] = 0.1
    capacitance: Annotated[
        float,
        Par("F", "capacitance of the stack", "PI P-621.1CD: 1.5 uF", shown="uF", positive=True),
    ] = 1.5e-6


@kernel
def convert(p: HighVoltage, effort: float) -> float:
    """What is asked of the amplifier: limited to its range, then rounded to a code.

    Parameters
    ----------
    p : HighVoltage
        Parameters of the amplifier.
    effort : float
        V at the D/A.

    Returns
    -------
    float
        V at the stack.
    """
    volts = p.gain * effort
    lsb: float = (p.high - p.low) / 2.0**p.bits
    code = math.floor((min(max(volts, p.low), p.high) - p.low) / lsb + 0.5)
    return min(p.low + code * lsb, p.high)


@kernel
def driven(p: HighVoltage, volts: float, asked: float, dt: float) -> float:
    """Voltage at the stack after one step: a first-order lag, no faster than the current allows.

    Parameters
    ----------
    p : HighVoltage
        Parameters of the amplifier.
    volts : float
        Present voltage, V.
    asked : float
        What the converter asks, V.
    dt : float
        Length of the step, s.

    Returns
    -------
    float
        V.
    """
    change = (asked - volts) * (1.0 - math.exp(-2.0 * math.pi * p.bandwidth * dt))
    most = p.current / p.capacitance * dt
    return volts + min(max(change, -most), most)
