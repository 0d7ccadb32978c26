"""Carriage friction: LuGre bristles, Stribeck drop, level that depends on the position.

Canudas de Wit et al., A new model for control of systems with friction, 1995 (the thesis' [30]).
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.columns import Meaning
from macromicro.kernel import kernel
from macromicro.plant import VARIANT, value_noise
from macromicro.schema.par import Par

_M1 = "calibrated to M1"
_M3 = "calibrated to M3, M3b, M4a, M4b, M5"
_MEASURED = "data sheet or measurement"


class Friction(NamedTuple):
    """All sources of friction (motor brushes, belt idlers, bushing on the rod), at the belt."""

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
    random: Annotated[
        float, Par("N", "random part of the friction level (standard deviation)", VARIANT, lo=0.0)
    ] = 0.0
    random_length: Annotated[
        float, Par("m", "distance over which it changes", shown="mm", positive=True)
    ] = 0.005
    random_seed: Annotated[float, Par("", "which random part", lo=0.0)] = 0.0
    ripple_shift: Annotated[
        float, Par("1", "shift of the change along the rod per distance", VARIANT)
    ] = 0.0
    ageing: Annotated[
        float, Par("N", "rise of the breakaway per decade of rest beyond a second", VARIANT, lo=0.0)
    ] = 0.0
    ageing_slip: Annotated[
        float, Par("m", "slip that ends the rest", shown="um", positive=True)
    ] = 2e-5


class AxisFriction(NamedTuple):
    """Total friction of an axis as a force at the load, by its data sheet."""

    coulomb: Annotated[float, Par("N", "kinetic friction", _MEASURED, lo=0.0)] = 3.0
    stribeck: Annotated[float, Par("N", "breakaway above kinetic friction", _MEASURED, lo=0.0)] = (
        0.6
    )
    stribeck_speed: Annotated[
        float,
        Par("m/s", "Stribeck speed, over which that fades", _MEASURED, shown="mm/s", positive=True),
    ] = 5.0e-3
    viscous: Annotated[float, Par("N*s/m", "viscous friction", _MEASURED, lo=0.0)] = 2.0
    presliding: Annotated[
        float, Par("m", "presliding deflection", _MEASURED, shown="um", positive=True)
    ] = 5.0e-6
    ripple: Annotated[
        float, Par("N", "greatest change of the friction along the travel", _MEASURED, lo=0.0)
    ] = 0.0
    ripple_long: Annotated[
        float, Par("m", "longer period of that change", _MEASURED, shown="mm", positive=True)
    ] = 40.0e-3
    ripple_short: Annotated[
        float, Par("m", "shorter period of that change", _MEASURED, shown="mm", positive=True)
    ] = 12.0e-3


class Worn(NamedTuple):
    """What the friction remembers."""

    way: Annotated[float, Meaning("travelled", "m")]
    rest: Annotated[float, Meaning("how long the contacts have rested", "s")]


@kernel
def ripple(p: Friction | AxisFriction, x: float) -> float:
    """Deviation of the friction level from its mean along the rod."""
    return (
        p.ripple
        * 0.5
        * (
            math.sin(2.0 * math.pi * x / p.ripple_long)
            + math.sin(2.0 * math.pi * x / p.ripple_short + 1.0)
        )
    )


@kernel
def local(p: Friction, x: float, s: Worn) -> float:
    """Local deviation of the friction level: ripple, random part, ageing at rest.

    Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994), Sections 2.1 and 2.2.
    """
    found = ripple(p, x + p.ripple_shift * s.way)
    if p.random > 0.0:
        found += p.random * value_noise.at(p.random_seed, s.way / p.random_length)
    if p.ageing > 0.0:
        found += p.ageing * math.log10(1.0 + s.rest)
    return found


@kernel
def worn(p: Friction, s: Worn, v: float, dt: float) -> Worn:
    """The friction's memory after one step.

    Dieterich's law (Journal of Geophysical Research 84 (1979) 2161):
    d rest/dt = 1 - |v| rest / slip.
    """
    slid = abs(v) * dt
    return Worn(s.way + slid, (s.rest + dt) / (1.0 + slid / p.ageing_slip))


@kernel
def level(p: Friction | AxisFriction, v: float, offset: float) -> float:
    """Steady sliding friction, viscous part aside: the Stribeck curve."""
    ratio = v / p.stribeck_speed
    return max(p.coulomb + offset + p.stribeck * math.exp(-ratio * ratio), 1e-6)


def deflection(p: AxisFriction, force: float) -> float:
    """Deflection [m] of the bristles that hold a force [N], towards lower positions, at rest."""
    stiffness, _ = before_sliding(p, 0.0)
    return -min(force, p.coulomb) / stiffness if stiffness > 0.0 else 0.0


@kernel
def bristle_terms(
    p: Friction | AxisFriction,
    stiffness: Annotated[float, Meaning("before sliding", "N/m")],
    damping: Annotated[float, Meaning("before sliding", "N s/m")],
    z: float,
    v: float,
    offset: float,
    h: float,
) -> tuple[
    Annotated[float, Meaning(name="a")],
    Annotated[float, Meaning(name="b")],
    Annotated[float, Meaning(name="c")],
    Annotated[float, Meaning(name="d")],
]:
    """LuGre over one step, linear in the new speed v1: z1 = a + b v1, force = c + d v1."""
    # LuGre: dz/dt = v - sigma0 |v| z / g(v),  F = sigma0 z + sigma1 dz/dt.
    # Backward Euler, the new v1 and z1 where they count, |v| and g taken from before the step:
    #   z1 = z + h (v1 - sigma0 |v| z1 / g)   ->   z1 = hold (z + h v1)
    #   F  = sigma0 z1 + sigma1 (z1 - z) / h, which is linear in v1 as z1 is.
    # With 0 < hold <= 1 the bristle relaxes towards g / sigma0 for any h. Taken explicitly it
    # would have the factor 1 - h sigma0 |v| / g, and ring from h = 2 g / (sigma0 |v|) on: some
    # 60 us at 0.5 m/s.
    hold = 1.0 / (1.0 + h * stiffness * abs(v) / level(p, v, offset))
    a = hold * z
    b = hold * h
    stiff = stiffness + damping / h
    return a, b, stiff * a - damping * z / h, stiff * b


@kernel
def before_sliding(
    p: AxisFriction, mass: Annotated[float, Meaning("that moves", "kg")]
) -> tuple[Annotated[float, Meaning(name="stiffness")], Annotated[float, Meaning(name="damping")]]:
    """Bristles that reach breakaway over the presliding distance, with a damping ratio of 1."""
    stiffness = (p.coulomb + p.stribeck) / p.presliding
    return stiffness, 2.0 * math.sqrt(stiffness * mass)
