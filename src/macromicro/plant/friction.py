"""Carriage friction: LuGre bristles, Stribeck drop, level that depends on the position.

Canudas de Wit et al., A new model for control of systems with friction, 1995 (the
thesis' [30]). The thesis' dead zone is what an engineer fits to this, Section 4.2.3.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.kernel import kernel
from macromicro.schema.par import Par

_M1 = "calibrated to M1"
_M3 = "calibrated to M3, M3b, M4a, M4b, M5"


class Friction(NamedTuple):
    """Everything that rubs (motor brushes, belt idlers, bushing on the rod), at the belt."""

    coulomb: Annotated[float, Par("N", "kinetic friction", _M1 + ", M2, M3, M6a, M6b", lo=0.0)] = (
        10.485
    )
    stribeck: Annotated[
        float,
        Par("N", "breakaway above kinetic friction (Stribeck drop)", _M1 + ", M6a, M6b", lo=0.0),
    ] = 1.944
    stribeck_speed: Annotated[
        float, Par("m/s", "speed over which the Stribeck drop fades", shown="mm/s", positive=True)
    ] = 0.03214
    ripple: Annotated[
        float,
        Par("N", "greatest change of the friction along the rod", _M1, lo=0.0),
    ] = 0.518
    ripple_long: Annotated[
        float, Par("m", "longer period of that change", shown="mm", positive=True)
    ] = 0.03714
    ripple_short: Annotated[
        float, Par("m", "shorter period of that change", shown="mm", positive=True)
    ] = 0.01214
    bristle: Annotated[
        float, Par("N/m", "stiffness before sliding", shown="N/mm", positive=True)
    ] = 7.26e5
    bristle_damping: Annotated[float, Par("N*s/m", "damping before sliding", lo=0.0)] = 570.0
    viscous: Annotated[float, Par("N*s/m", "viscous friction", _M3, lo=0.0)] = 6.36


@kernel
def ripple(p: Friction, x: float) -> float:
    """Deviation of the friction level from its mean along the rod.

    Parameters
    ----------
    p : Friction
        Parameters of the friction.
    x : float
        Position, m.

    Returns
    -------
    float
        N.
    """
    return (
        p.ripple
        * 0.5
        * (
            math.sin(2.0 * math.pi * x / p.ripple_long)
            + math.sin(2.0 * math.pi * x / p.ripple_short + 1.0)
        )
    )


@kernel
def level(p: Friction, v: float, offset: float) -> float:
    """Steady sliding friction, viscous part aside: the Stribeck curve.

    Parameters
    ----------
    p : Friction
        Parameters of the friction.
    v : float
        Speed, m/s.
    offset : float
        Local deviation of the level (`ripple`), N.

    Returns
    -------
    float
        N, never below 1 uN.
    """
    ratio = v / p.stribeck_speed
    return max(p.coulomb + offset + p.stribeck * math.exp(-ratio * ratio), 1e-6)


@kernel
def bristle_terms(
    p: Friction, z: float, v: float, offset: float, h: float
) -> tuple[float, float, float, float]:
    """LuGre over one step, linear in the new speed v1: z1 = a + b v1, force = c + d v1.

    The slip rate is taken implicitly, so the bristle never rings and the step may be long.

    Parameters
    ----------
    p : Friction
        Parameters of the friction.
    z : float
        Deflection of the bristles, m.
    v : float
        Present speed, m/s.
    offset : float
        Local deviation of the level, N.
    h : float
        Length of the step, s.

    Returns
    -------
    a : float
        m.
    b : float
        s.
    c : float
        N.
    d : float
        N s/m.
    """
    # LuGre: dz/dt = v - sigma0 |v| z / g(v),  F = sigma0 z + sigma1 dz/dt.
    # Backward Euler, the new v1 and z1 where they count, |v| and g taken from before the step:
    #   z1 = z + h (v1 - sigma0 |v| z1 / g)   ->   z1 = hold (z + h v1)
    #   F  = sigma0 z1 + sigma1 (z1 - z) / h, which is linear in v1 as z1 is.
    # With 0 < hold <= 1 the bristle relaxes towards g / sigma0 for any h. Taken explicitly it
    # would have the factor 1 - h sigma0 |v| / g, and ring from h = 2 g / (sigma0 |v|) on: some
    # 60 us at 0.5 m/s.
    hold = 1.0 / (1.0 + h * p.bristle * abs(v) / level(p, v, offset))
    a = hold * z
    b = hold * h
    stiff = p.bristle + p.bristle_damping / h
    return a, b, stiff * a - p.bristle_damping * z / h, stiff * b
