"""Amplifier of a piezo stack: range, converter, bandwidth, current limit dV/dt = I / C."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.kernel import kernel
from macromicro.schema.par import Par


class HighVoltage(NamedTuple):
    """The amplifier and its capacitive load."""

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
    """Commanded voltage, limited to the range and rounded to a code."""
    volts = p.gain * effort
    lsb: float = (p.high - p.low) / 2.0**p.bits
    code = math.floor((min(max(volts, p.low), p.high) - p.low) / lsb + 0.5)
    return min(p.low + code * lsb, p.high)


@kernel
def driven(p: HighVoltage, volts: float, asked: float, dt: float) -> float:
    """Voltage after one step: a first-order lag with limited current."""
    change = (asked - volts) * (1.0 - math.exp(-2.0 * math.pi * p.bandwidth * dt))
    most = p.current / p.capacitance * dt
    return volts + min(max(change, -most), most)
