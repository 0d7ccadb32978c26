"""Design sheet of the flexure guide (Section 3.2.2): beam thickness, stiffness, stress.

The guide consists of four equal beams whose ends stay parallel. Two in a row share the
deflection, two rows share the load: each beam takes half the load and half the travel, so
guide and beam have the same stiffness.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.design._checks import positive, sheet

GRAM_FORCE = 9.80665e-3  # N


class Beam(NamedTuple):
    """What is given before the thickness; by default the aluminium beams of Section 3.2.2.

    Examples
    --------
    >>> from macromicro.design import Beam, stiffness
    >>> steel = Beam(modulus=200e9, width=5e-3, length=40e-3)
    >>> round(stiffness(steel, thickness=0.5e-3))  # N/m
    1953
    """

    modulus: float = 70e9  #: Young's modulus, Pa
    width: float = 2.0e-3  #: w, m
    length: float = 55.0e-3  #: L, m


def deflection(beam: Beam, thickness: float, force: float) -> float:
    """Deflection of one beam (3.1): dx = F L^3 / (12 E I), I = w t^3 / 12.

    Parameters
    ----------
    beam : Beam
        Length, width, thickness and material of one flexure.
    thickness : float
        t, m.
    force : float
        F, N.

    Returns
    -------
    float
        m.

    Raises
    ------
    InputError
        A number is not above zero.

    Examples
    --------
    >>> from macromicro.design import Beam, deflection
    >>> round(deflection(Beam(), thickness=0.5e-3, force=1.0) * 1e3, 2)  # mm
    9.51
    """
    return positive("flexure, force", force, "N") / stiffness(beam, thickness)


def max_thickness(beam: Beam, force: float, deflection: float) -> float:
    """Largest thickness for a deflection by a force: (3.1) solved for t^3 = F L^3 / (E w dx).

    Parameters
    ----------
    beam : Beam
        Length, width, thickness and material of one flexure.
    force : float
        F, N.
    deflection : float
        dx, m.

    Returns
    -------
    float
        m.

    Raises
    ------
    InputError
        A number is not above zero.

    Examples
    --------
    >>> from macromicro.design import Beam, max_thickness
    >>> round(max_thickness(Beam(), force=1.0, deflection=4e-3) * 1e3, 2)  # mm
    0.67
    """
    _check(beam)
    positive("flexure, force", force, "N")
    positive("flexure, deflection", deflection, "m")
    cube = force * beam.length**3 / (beam.modulus * beam.width * deflection)
    return float(cube ** (1.0 / 3.0))


def stiffness(beam: Beam, thickness: float) -> float:
    """Stiffness of one beam and of the whole guide: 12 E I / L^3, from (3.1).

    Parameters
    ----------
    beam : Beam
        Length, width, thickness and material of one flexure.
    thickness : float
        t, m.

    Returns
    -------
    float
        N/m.

    Raises
    ------
    InputError
        A number is not above zero.

    Examples
    --------
    >>> from macromicro.design import Beam, stiffness
    >>> round(stiffness(Beam(), thickness=0.5e-3), 1)  # N/m
    105.2
    """
    _check(beam)
    positive("flexure, thickness", thickness, "m")
    inertia = beam.width * thickness**3 / 12.0
    return 12.0 * beam.modulus * inertia / beam.length**3


def bending_stress(beam: Beam, thickness: float, deflection: float) -> float:
    """Greatest stress, at the clamps of a bent beam: 3 E t dx / L^2.

    From the end moment F L / 2 and (3.1); compare it with the yield strength.

    Parameters
    ----------
    beam : Beam
        Length, width, thickness and material of one flexure.
    thickness : float
        t, m.
    deflection : float
        dx, m.

    Returns
    -------
    float
        Pa.

    Raises
    ------
    InputError
        A number is not above zero.

    Examples
    --------
    >>> from macromicro.design import Beam, bending_stress
    >>> round(bending_stress(Beam(), thickness=0.5e-3, deflection=4e-3) / 1e6, 1)  # MPa
    138.8
    """
    _check(beam)
    positive("flexure, thickness", thickness, "m")
    positive("flexure, deflection", deflection, "m")
    return 3.0 * beam.modulus * thickness * deflection / beam.length**2


def shape(beam: Beam, deflection: float, points: int = 61) -> tuple[Array, Array, float]:
    """A bent beam (Figure 3.6a).

    Both ends keep their direction: y = dx (3 s^2 - 2 s^3) with s = place / L. The beam keeps its
    length, so its end approaches by the integral of y'^2 / 2, 3 dx^2 / (5 L).
    """
    _check(beam)
    positive("flexure, deflection", deflection, "m")
    s = np.linspace(0.0, 1.0, points)
    nearer = 3.0 * deflection**2 / (5.0 * beam.length)
    # the integral of (6 s - 6 s^2)^2, which is 6/5 at the end
    share = (12.0 * s**3 - 18.0 * s**4 + 7.2 * s**5) / 1.2
    return beam.length * s - nearer * share, deflection * (3.0 * s**2 - 2.0 * s**3), nearer


def _check(beam: Beam) -> None:
    sheet("flexure, beam", beam, Beam)
    positive("flexure, modulus", beam.modulus, "Pa")
    positive("flexure, width", beam.width, "m")
    positive("flexure, length", beam.length, "m")
