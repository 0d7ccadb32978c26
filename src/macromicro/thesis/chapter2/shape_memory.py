"""Stress and strain of a shape memory alloy: a piecewise linear law (Figures 2.9, 2.10).

Martensite yields along a plateau and keeps that strain; austenite is elastic. The share of
austenite is an input; rate and stress-induced transformation are neglected. Stress in Pa.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from macromicro.schema.par import Par

_DATA = "data sheets of NiTi"


class Alloy(NamedTuple):
    """A NiTi alloy; moduli and plateau as data sheets give them, strain as Section 3.2.1."""

    martensite: Annotated[
        float, Par("Pa", "modulus of martensite (28-41 GPa)", _DATA, shown="GPa", positive=True)
    ] = 28e9
    austenite: Annotated[
        float, Par("Pa", "modulus of austenite (75-83 GPa)", _DATA, shown="GPa", positive=True)
    ] = 75e9
    plateau_start: Annotated[
        float, Par("Pa", "stress at which twins begin to move", _DATA, shown="MPa", positive=True)
    ] = 70e6
    plateau_end: Annotated[
        float, Par("Pa", "stress at which all have moved", _DATA, shown="MPa", positive=True)
    ] = 140e6
    plateau_strain: Annotated[
        float, Par("1", "strain of the plateau", "stroke over wire length, about 4 %", lo=0.0)
    ] = 0.04


def detwinned(p: Alloy, stress: float, before: float) -> float:
    """Share of the plateau's strain under a stress; unloading recovers nothing."""
    share = (stress - p.plateau_start) / (p.plateau_end - p.plateau_start)
    return max(before, min(max(share, 0.0), 1.0))


def strain(p: Alloy, stress: float, austenite: float, share: float) -> float:
    """Strain under a stress: phases in series, and the plateau's strain of the martensite."""
    elastic = (1.0 - austenite) / p.martensite + austenite / p.austenite
    return stress * elastic + (1.0 - austenite) * share * p.plateau_strain
