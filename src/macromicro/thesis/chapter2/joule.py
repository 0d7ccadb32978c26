"""Heat balance (2.1) of a wire heated by its current and cooled by air, degC.

rho Cp V dT/dt = R i^2 - h A (T - T_inf), per metre of a round wire, without latent heat.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.schema.par import Par

_LIT = "literature value for NiTi"


class Filament(NamedTuple):
    """A round NiTi wire in air."""

    diameter: Annotated[
        float, Par("m", "diameter: the bench's cross-section", shown="um", positive=True)
    ] = 135e-6
    density: Annotated[float, Par("kg/m^3", "density", _LIT, positive=True)] = 6450.0
    heat: Annotated[
        float, Par("J/(kg*K)", "specific heat (450-840 J/kg/K)", _LIT, positive=True)
    ] = 500.0
    resistivity: Annotated[
        float, Par("ohm*m", "resistivity of martensite (80 micro-ohm cm)", _LIT, positive=True)
    ] = 0.8e-6
    convection: Annotated[
        float, Par("W/(m^2*K)", "convection of so thin a wire in still air", positive=True)
    ] = 100.0
    ambient: Annotated[float, Par("degC", "temperature of the air", "Section 5.2.2")] = 25.0


def time_constant(p: Filament) -> float:
    """rho Cp V / (h A) = rho Cp d / (4 h), s."""
    return p.density * p.heat * p.diameter / (4.0 * p.convection)


def steady(p: Filament, current: float) -> float:
    """Steady temperature at a constant current: T_inf + R i^2 / (h A), deg C."""
    resistance = p.resistivity / (0.25 * math.pi * p.diameter**2)
    return p.ambient + resistance * current**2 / (p.convection * math.pi * p.diameter)


def temperature(p: Filament, current: Array, dt: float) -> Array:
    """Temperature under a stepwise constant current from cold (exact solution of (2.1)), deg C."""
    keep = math.exp(-dt / time_constant(p))
    now, out = p.ambient, np.empty_like(current)
    for k, i in enumerate(current.tolist()):
        end = steady(p, i)
        now = end + (now - end) * keep
        out[k] = now
    return out
