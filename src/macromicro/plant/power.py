"""D/A, amplifier in voltage or current mode, and motor of an axis."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.columns import Meaning
from macromicro.kernel import kernel
from macromicro.plant import amplifier
from macromicro.plant.winding import WINDING, winding
from macromicro.schema.par import Par

VOLTAGE, CURRENT = "voltage", "current"
NONE, LINE = "none", "line"
_SHEET = "amplifier's data sheet"
_MOTOR = "motor's data sheet"


class Amplifier(NamedTuple):
    mode: Annotated[
        str,
        Par("", "what an effort sets: voltage or current", _SHEET, choices=(VOLTAGE, CURRENT)),
    ] = VOLTAGE
    supply: Annotated[float, Par("V", "supply of the motor", _SHEET, positive=True)] = 24.0
    current: Annotated[float, Par("A", "maximum current", _SHEET, positive=True)] = 4.0
    bandwidth: Annotated[
        float, Par("Hz", "bandwidth of the current loop (current mode)", _SHEET, positive=True)
    ] = 1000.0
    full_scale: Annotated[float, Par("V", "D/A range, both signs", "D/A board", positive=True)] = (
        10.0
    )
    bits: Annotated[float, Par("", "D/A resolution over both signs", "D/A board", lo=6, hi=24)] = (
        16.0
    )
    gain: Annotated[
        float, Par("1", "motor volts per volt at the D/A (voltage mode)", _SHEET, positive=True)
    ] = 2.4
    transconductance: Annotated[
        float, Par("A/V", "motor current per volt at the D/A (current mode)", _SHEET, positive=True)
    ] = 0.4
    enable: Annotated[
        str, Par("", "its enable input: none (always on) or line", _SHEET, choices=(NONE, LINE))
    ] = NONE
    enable_time: Annotated[
        float, Par("s", "delay from the enable input to the current", _SHEET, shown="ms", lo=0.0)
    ] = 20.0e-3
    fault: Annotated[
        str, Par("", "its fault output: none or line", _SHEET, choices=(NONE, LINE))
    ] = NONE
    continuous: Annotated[
        float, Par("A", "continuous current (fault output)", _SHEET, positive=True)
    ] = 2.0
    peak_time: Annotated[
        float,
        Par("s", "from cold until the greatest current trips it (fault output)", _SHEET, lo=0.01),
    ] = 2.0


class Motor(NamedTuple):
    """A brushed or commutated brushless motor, as seen at its terminals."""

    constant: Annotated[
        float, Par("N*m/A", "torque constant, also that of the back-EMF", _MOTOR, positive=True)
    ] = 0.0302
    force: Annotated[float, Par("N/A", "force constant (linear motor)", _MOTOR, positive=True)] = (
        10.0
    )
    resistance: Annotated[float, Par("ohm", "resistance", _MOTOR, positive=True)] = 1.2
    inductance: Annotated[float, Par("H", "inductance", _MOTOR, shown="mH", positive=True)] = (
        0.24e-3
    )
    inertia: Annotated[float, Par("kg*m^2", "inertia of the rotor", _MOTOR, lo=0.0)] = 1.4e-6

    def figures(self) -> dict[str, Par]:
        return WINDING

    def of_figures(self, given: dict[str, float], where: str) -> dict[str, float]:
        return winding(given, where)


class Power(NamedTuple):
    """Parameters of D/A, amplifier and motor, referred to the load's travel."""

    dac: Annotated[amplifier.Amplifier, Meaning("range and bits of the D/A")]
    by_current: Annotated[int, Meaning("1 in current mode")]
    gain: Annotated[float, Meaning("motor volts, or amperes, per volt at the D/A")]
    supply: Annotated[float, Meaning("", "V")]
    limit: Annotated[float, Meaning("maximum current", "A")]
    pole: Annotated[float, Meaning("of the current loop", "rad/s")]
    resistance: Annotated[float, Meaning("", "ohm")]
    inductance: Annotated[float, Meaning("", "H")]
    emf: Annotated[float, Meaning("back-EMF", "V s/m")]
    push: Annotated[float, Meaning("force at the load", "N/A")]


def prepare(amp: Amplifier, motor: Motor, constant: float, efficiency: float) -> Power:
    by_current = amp.mode == CURRENT
    return Power(
        amplifier.Amplifier(full_scale=amp.full_scale, bits=amp.bits, supply=amp.supply),
        int(by_current),
        amp.transconductance if by_current else amp.gain,
        amp.supply,
        amp.current,
        2.0 * math.pi * amp.bandwidth,
        motor.resistance,
        motor.inductance,
        constant,
        constant * efficiency,
    )


@kernel
def current_terms(
    p: Power, i: float, effort: float, v: float, h: float
) -> tuple[Annotated[float, Meaning(name="a")], Annotated[float, Meaning(name="b")]]:
    """Motor current over one step within the limits, linear in the new speed: a - b v1."""
    wanted = p.gain * amplifier.convert(p.dac, effort)
    volts = wanted
    if p.by_current == 1:
        aim = min(max(wanted, -p.limit), p.limit)
        # A loop of first order, backward Euler: di/dt = pole (aim - i).
        new = (i + h * p.pole * aim) / (1.0 + h * p.pole)
        volts = p.resistance * new + p.emf * v + p.inductance * (new - i) / h
        if abs(volts) <= p.supply:
            return new, 0.0
    volts = min(max(volts, -p.supply), p.supply)
    # di/dt = (V - R i - K v) / L, backward Euler.
    denominator = 1.0 + h * p.resistance / p.inductance
    a = (i + h * volts / p.inductance) / denominator
    b = h * p.emf / p.inductance / denominator
    new = a - b * v
    if abs(new) > p.limit:
        return math.copysign(p.limit, new), 0.0
    return a, b
