"""Stress and strain of a shape memory alloy: the textbook's piecewise straight law (Figures
2.9 and 2.10).

Martensite yields along a plateau, where its twins give way, and keeps that strain when the
load is taken off; austenite is elastic. A share of austenite stiffens the alloy and takes
that share of the plateau's strain back. Rate, temperature and the transformation that
stress causes by itself are left out: the share of austenite is an input. Stress in Pa,
strain as a ratio.
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
    """Share of the plateau's strain that is out under a stress.

    Loading takes it out in proportion between start and end of the plateau; unloading gives nothing
    back.

    Parameters
    ----------
    p : Alloy
        The alloy.
    stress : float
        Stress, Pa.
    before : float
        Share that is out already, 0 to 1.

    Returns
    -------
    float
        0 to 1.
    """
    share = (stress - p.plateau_start) / (p.plateau_end - p.plateau_start)
    return max(before, min(max(share, 0.0), 1.0))


def strain(p: Alloy, stress: float, austenite: float, share: float) -> float:
    """Strain under a stress.

    Phases in series: elastic strains by their shares, and the plateau's of the martensite.

    Parameters
    ----------
    p : Alloy
        The alloy.
    stress : float
        Stress, Pa.
    austenite : float
        Share of austenite, 0 to 1.
    share : float
        Share of the plateau's strain that is out, 0 to 1.

    Returns
    -------
    float
        Dimensionless.
    """
    elastic = (1.0 - austenite) / p.martensite + austenite / p.austenite
    return stress * elastic + (1.0 - austenite) * share * p.plateau_strain
