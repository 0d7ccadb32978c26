"""DC motor with inductance (Section 4.1, (4.1) with the signs corrected)."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from macromicro.kernel import kernel
from macromicro.schema.par import Par

_M23 = "calibrated to M2, M3, M3b, M4a, M4b, M5"


class Motor(NamedTuple):
    """Printer motor and pulley; the torque constant is also the back-EMF constant.

    Only the ratios constant / (resistance * pulley) and constant / pulley show outside.
    """

    resistance: Annotated[float, Par("ohm", "armature resistance", positive=True)] = 15.0
    inductance: Annotated[
        float,
        Par(
            "H", "armature inductance", "bench assumption: L/R of 0.5 ms", shown="mH", positive=True
        ),
    ] = 7.5e-3
    constant: Annotated[
        float, Par("N*m/A", "torque and back-EMF constant", _M23, positive=True)
    ] = 0.06484
    pulley: Annotated[float, Par("m", "pulley radius", shown="mm", positive=True)] = 4.0e-3


@kernel
def current_terms(p: Motor, current: float, volts: float, h: float) -> tuple[float, float]:
    """(4.1) first row, backward Euler, linear in the new speed: current = a - b v1."""
    # (4.1): di/dt = (V - R i - K_b omega) / L, omega = v / r
    denominator = 1.0 + h * p.resistance / p.inductance
    a = (current + h * volts / p.inductance) / denominator
    b = h * p.constant / (p.pulley * p.inductance) / denominator
    return a, b


@kernel
def force(p: Motor, current: float) -> float:
    """Pull of the belt."""
    return p.constant * current / p.pulley
