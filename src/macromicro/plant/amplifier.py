"""D/A board and PWM amplifier (Sections 3.1, 3.2.1): from commanded volts to the load."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro import nominal
from macromicro.kernel import kernel
from macromicro.plant import VARIANT
from macromicro.schema.par import Par


class Amplifier(NamedTuple):
    """The MultiQ-3 board's outputs and the amplifiers behind them."""

    full_scale: Annotated[
        float, Par("V", "D/A range, both signs", "Section 3.1", positive=True)
    ] = nominal.FULL_SCALE
    bits: Annotated[
        float, Par("", "D/A resolution over both signs", "MultiQ-3 board, Section 3.3", lo=6, hi=24)
    ] = 12.0
    supply: Annotated[
        float, Par("V", "PWM amplifier's output at 100 % duty", "Section 3.1", positive=True)
    ] = 20.0
    motor_duty: Annotated[
        float, Par("1", "motor's PWM duty at D/A full scale", "Section 3.1", lo=0.01, hi=1.0)
    ] = 1.0
    ctrl_duty: Annotated[
        float, Par("1", "CTRL's PWM duty at D/A full scale", "Section 3.2.1", lo=0.01, hi=1.0)
    ] = 0.2
    sag: Annotated[
        float,
        Par(
            "ohm",
            "inner resistance of the motor's supply",
            VARIANT,
            lo=0.0,
        ),
    ] = 0.0


@kernel
def convert(p: Amplifier, volts: float) -> float:
    """D/A output for a commanded voltage: saturated, then rounded to a code."""
    lsb: float = 2.0 * p.full_scale / 2.0**p.bits
    limited = min(max(volts, -p.full_scale), p.full_scale)
    return min(math.floor(limited / lsb + 0.5) * lsb, p.full_scale)


@kernel
def duty(p: Amplifier, volts: float, at_full_scale: float) -> float:
    """Signed PWM duty for a D/A voltage: linear up to full scale."""
    return volts / p.full_scale * at_full_scale


@kernel
def motor_volts(p: Amplifier, volts: float, current: float) -> float:
    """Mean voltage across the motor (Section 3.1), with the supply's voltage drop."""
    share = duty(p, volts, p.motor_duty)
    return (p.supply - p.sag * share * current) * share


@kernel
def ctrl_level(p: Amplifier, volts: float) -> float:
    """CTRL in the thesis' D/A volts: mean PWM voltage over 0.8 V per volt (Section 3.2.1)."""
    return p.supply * duty(p, volts, p.ctrl_duty) / 0.8
