"""Design sheet of the flexure guide (Section 3.2.2): beam thickness, stiffness, stress.

The guide is four equal beams, clamped so that both ends stay parallel. Two in a row share
the deflection, two rows share the load: each beam takes half the guide's load and half its
travel, so guide and beam have the same stiffness. SI units.
"""

from __future__ import annotations

from typing import NamedTuple

from macromicro.design.checks import positive

GRAM_FORCE = 9.80665e-3  # N


class Beam(NamedTuple):
    """What is given before the thickness: Young's modulus [Pa], width w and length L [m].

    By default the aluminium beams of Section 3.2.2.
    """

    modulus: float = 70e9
    width: float = 2.0e-3
    length: float = 55.0e-3


def deflection(beam: Beam, thickness: float, force: float) -> float:
    """Deflection [m] of one beam of `thickness` [m] under `force` [N]: (3.1).

    dx = F L^3 / (12 E I), I = w t^3 / 12. Raises `InputError` unless all are above zero.
    """
    return positive("flexure, force", force, "N") / stiffness(beam, thickness)


def max_thickness(beam: Beam, force: float, deflection: float) -> float:
    """Greatest thickness [m] with which `force` [N] bends one beam by `deflection` [m]: (3.1)
    solved for t, t^3 = F L^3 / (E w dx). Raises `InputError` unless all are above zero."""
    _check(beam)
    positive("flexure, force", force, "N")
    positive("flexure, deflection", deflection, "m")
    cube = force * beam.length**3 / (beam.modulus * beam.width * deflection)
    return float(cube ** (1.0 / 3.0))


def stiffness(beam: Beam, thickness: float) -> float:
    """Stiffness [N/m] of one beam and of the whole guide: 12 E I / L^3, from (3.1)."""
    _check(beam)
    positive("flexure, thickness", thickness, "m")
    inertia = beam.width * thickness**3 / 12.0
    return 12.0 * beam.modulus * inertia / beam.length**3


def bending_stress(beam: Beam, thickness: float, deflection: float) -> float:
    """Greatest stress [Pa], at the clamps of a beam bent by `deflection` [m]: 3 E t dx / L^2.

    From the end moment F L / 2 and (3.1); to be held against the yield strength, which the
    thesis does not do.
    """
    _check(beam)
    positive("flexure, thickness", thickness, "m")
    positive("flexure, deflection", deflection, "m")
    return 3.0 * beam.modulus * thickness * deflection / beam.length**2


def _check(beam: Beam) -> None:
    positive("flexure, modulus", beam.modulus, "Pa")
    positive("flexure, width", beam.width, "m")
    positive("flexure, length", beam.length, "m")
