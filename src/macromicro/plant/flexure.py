"""Load of the actuator: flexure guide and bias spring (Section 3.2.2)."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from macromicro.schema.par import Par

GRAM_FORCE = 9.80665e-3


class Flexure(NamedTuple):
    """Four beams of aluminium; each carries half the load over half the way, (3.1)."""

    modulus: Annotated[
        float, Par("Pa", "Young's modulus", "Section 3.2.2", shown="GPa", positive=True)
    ] = 70e9
    width: Annotated[
        float, Par("m", "beam width w", "Section 3.2.2", shown="mm", positive=True)
    ] = 2.0e-3
    thickness: Annotated[
        float, Par("m", "beam thickness t", "Section 3.2.2", shown="mm", positive=True)
    ] = 0.45e-3
    length: Annotated[
        float, Par("m", "beam length L", "Section 3.2.2", shown="mm", positive=True)
    ] = 55.0e-3


class Bias(NamedTuple):
    """The spring (or weight) that pulls the actuator out, and the platform's mass."""

    preload: Annotated[
        float, Par("N", "pull at full extension", "calibrated to S10, I3", lo=0.0)
    ] = 33.0 * GRAM_FORCE
    rate: Annotated[float, Par("N/m", "spring rate", "calibrated to S10", lo=0.0)] = 21.4
    platform: Annotated[
        float, Par("kg", "mass of platform, magnets and reflector", shown="g", lo=0.0)
    ] = 0.02


def stiffness(p: Flexure) -> float:
    """Stiffness of the guide: (3.1) with I = w t^3 / 12; (F/2) over (dx/2) per beam."""
    inertia = p.width * p.thickness**3 / 12.0
    return 12.0 * p.modulus * inertia / p.length**3
