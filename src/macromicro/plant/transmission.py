"""Belt, screw or direct drive: gear ratio, backlash, pitch error, compliance."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.kernel import kernel
from macromicro.schema.par import Par

BELT, SCREW, LINEAR = "belt", "screw", "linear"
_SHEET = "drive's data sheet"
_MEASURED = "data sheet or measurement"


class Transmission(NamedTuple):
    """From the motor's turn to the load's travel."""

    kind: Annotated[
        str,
        Par("", "belt, screw, or linear (a linear motor)", _SHEET, choices=(BELT, SCREW, LINEAR)),
    ] = BELT
    radius: Annotated[
        float, Par("m", "radius of the belt's pulley", _SHEET, shown="mm", positive=True)
    ] = 8.0e-3
    lead: Annotated[
        float, Par("m", "lead of the screw: travel per turn", _SHEET, shown="mm", positive=True)
    ] = 5.0e-3
    gear: Annotated[
        float, Par("1", "turns of the motor per turn of pulley or screw", _SHEET, positive=True)
    ] = 1.0
    inertia: Annotated[
        float,
        Par("kg*m^2", "inertia turning with the motor: pulley, screw, coupling", _SHEET, lo=0.0),
    ] = 1.0e-6
    efficiency: Annotated[
        float, Par("1", "efficiency (share of the motor's force)", _SHEET, lo=0.05, hi=1.0)
    ] = 1.0
    frequency: Annotated[
        float,
        Par(
            "Hz",
            "mode of the load on the drive's flexibility, motor held; 0: stiff",
            _MEASURED,
            lo=0.0,
        ),
    ] = 0.0
    damping: Annotated[float, Par("1", "damping ratio of that mode", _MEASURED, lo=0.0, hi=2.0)] = (
        0.02
    )
    backlash: Annotated[
        float, Par("m", "backlash between motor and load", _SHEET, shown="um", lo=0.0)
    ] = 0.0
    error: Annotated[
        float, Par("m", "amplitude of the pitch error", _SHEET, shown="um", lo=0.0)
    ] = 0.0
    error_period: Annotated[
        float, Par("m", "its period along the travel", _SHEET, shown="mm", positive=True)
    ] = 5.0e-3
    cogging: Annotated[
        float, Par("N", "amplitude of the motor's cogging, at the load", _MEASURED, lo=0.0)
    ] = 0.0
    cogging_period: Annotated[
        float, Par("m", "its period along the travel", _MEASURED, shown="mm", positive=True)
    ] = 5.0e-3

    @property
    def ratio(self) -> float:
        """Turn of the motor per travel of the load."""
        if self.kind == LINEAR:
            return 1.0
        return self.gear * (2.0 * math.pi / self.lead if self.kind == SCREW else 1.0 / self.radius)


@kernel
def wave(amplitude: float, period: float, x: float) -> float:
    """A sine along the travel: pitch error (m) or cogging force (N)."""
    return amplitude * math.sin(2.0 * math.pi * x / period)


@kernel
def stretch(slack: float, apart: float) -> float:
    """Strain of the drive: the distance beyond half the backlash."""
    if apart > 0.5 * slack:
        return apart - 0.5 * slack
    if apart < -0.5 * slack:
        return apart + 0.5 * slack
    return 0.0
