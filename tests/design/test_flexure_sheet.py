"""Flexure sheet: (3.1) against itself, the thesis' numbers and the bench's guide."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.design.flexure_sheet import (
    GRAM_FORCE,
    Beam,
    bending_stress,
    deflection,
    max_thickness,
    shape,
    stiffness,
)
from macromicro.errors import InputError
from macromicro.plant import flexure


def test_stated_load_gives_another_thickness() -> None:
    """Section 3.2.2: 35 gf and 2 mm; 0.465 mm is printed. Half the load gives 0.467 (D1)."""
    assert max_thickness(Beam(), 35 * GRAM_FORCE, 2e-3) == pytest.approx(0.5886e-3, rel=1e-3)
    assert max_thickness(Beam(), 17.5 * GRAM_FORCE, 2e-3) == pytest.approx(0.467e-3, rel=5e-3)


def test_chosen_thickness() -> None:
    """0.45 mm: 76.7 N/m, 31 gf at 4 mm, and what the bench's guide does."""
    rate = stiffness(Beam(), 0.45e-3)
    assert rate == pytest.approx(76.7, abs=0.05)
    assert rate * 4e-3 / GRAM_FORCE == pytest.approx(31.3, abs=0.1)
    assert rate == pytest.approx(flexure.stiffness(flexure.Flexure()))


@given(st.floats(0.01, 2.0), st.floats(1e-4, 1e-2), st.floats(1e9, 3e11), st.floats(5e-3, 0.3))
def test_thickness_gives_back_the_deflection(
    force: float, way: float, modulus: float, length: float
) -> None:
    beam = Beam(modulus, 2e-3, length)
    found = deflection(beam, max_thickness(beam, force, way), force)
    assert math.isclose(found, way, rel_tol=1e-9)


def test_stress_follows_from_the_end_moment() -> None:
    """Largest stress = M (t/2) / I with M = F L / 2."""
    beam, t, way = Beam(), 0.45e-3, 2e-3
    moment = stiffness(beam, t) * way * beam.length / 2
    inertia = beam.width * t**3 / 12
    assert bending_stress(beam, t, way) == pytest.approx(moment * t / 2 / inertia)


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf, 1e200, 1e-200, True])
def test_bad_numbers_are_refused(bad: float) -> None:
    with pytest.raises(InputError, match="flexure, force"):
        max_thickness(Beam(), bad, 2e-3)
    with pytest.raises(InputError, match=r"flexure, length.*above 0 m"):
        stiffness(Beam(length=bad), 1e-3)
    with pytest.raises(InputError, match="thickness"):
        deflection(Beam(), bad, 1.0)
    with pytest.raises(InputError, match="deflection"):
        bending_stress(Beam(), 1e-3, bad)


def test_bent_beam_keeps_its_length_and_its_ends_direction() -> None:
    """Figure 3.6a: clamped below, free end shifted but not turned; to second order in the shift."""
    along, aside, nearer = shape(Beam(), 2e-3, 4001)
    assert (along[0], aside[0], aside[-1]) == (0.0, 0.0, pytest.approx(2e-3))
    assert along[-1] == pytest.approx(Beam().length - nearer)
    slope = np.diff(aside) / np.diff(along)
    assert abs(slope[0]) < 1e-4 and abs(slope[-1]) < 1e-4
    assert np.hypot(np.diff(along), np.diff(aside)).sum() == pytest.approx(Beam().length, rel=1e-5)
    assert nearer == pytest.approx(0.6 * 2e-3**2 / Beam().length)


def test_a_bent_beam_keeps_its_length_along_the_way() -> None:
    """Each place comes nearer by the integral of y'^2 / 2 up to it, y' = dx (6 s - 6 s^2) / L."""
    beam, bent = Beam(modulus=2e11, width=0.01, length=0.05), 2e-3
    place, sideways, nearer = shape(beam, bent, 2001)
    s = np.linspace(0.0, 1.0, 2001)
    slope = bent * (6.0 * s - 6.0 * s**2) / beam.length
    steps = 0.5 * np.diff(s) * beam.length * 0.5 * (slope[1:] ** 2 + slope[:-1] ** 2)
    lost = np.concatenate(([0.0], np.cumsum(steps)))
    np.testing.assert_allclose(beam.length * s - place, lost, atol=1e-6 * lost[-1])
    assert lost[-1] == pytest.approx(nearer, rel=1e-6)
    np.testing.assert_allclose(np.gradient(sideways, s * beam.length)[1:-1], slope[1:-1], atol=1e-6)
    assert len(shape(beam, bent)[0]) == 61
