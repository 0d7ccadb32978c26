"""The virtual test machine for the bench's wires (Section 2.3)."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.plant.bench import Bench
from macromicro.plant.flexure import GRAM_FORCE
from macromicro.thesis.chapter2 import _actuator_runs
from macromicro.thesis.chapter2._actuator_runs import enclosed_area, path, specimen, tangents

S = specimen(Bench())


@pytest.mark.parametrize(("hot", "modulus"), [(25.0, 30e9), (125.0, 75e9)])
def test_pure_phases_have_their_moduli(hot: float, modulus: float) -> None:
    r = _actuator_runs.test_wires(S, *path((25.0, 0.0), (hot, 0.0), (hot, 60.0)))
    stretch = (r.extension[-1] - r.extension[160]) / S.length
    stress = 60.0 * GRAM_FORCE / S.area
    assert stress / stretch == pytest.approx(modulus, rel=1e-6)


def test_heat_gives_the_stroke_and_cold_takes_it_back() -> None:
    r = _actuator_runs.test_wires(S, *path((25.0, 0.0), (125.0, 0.0), (25.0, 0.0)))
    assert r.extension[0] == r.extension[-1] == pytest.approx(0.0, abs=1e-12)
    assert r.extension[160] == pytest.approx(-4.03e-3)


def test_load_shifts_the_transformation() -> None:
    """Clausius-Clapeyron: 8 MPa/K is 0.085 K/gf."""
    finish = []
    for gf in (10.0, 50.0):
        r = _actuator_runs.test_wires(S, *path((25.0, gf), (125.0, gf), each=2000))
        finish.append(tangents(r.temperature, r.extension).finish)
    assert finish[1] - finish[0] == pytest.approx(40.0 * 0.085, abs=0.15)


def test_tangents_of_a_ramp() -> None:
    t = np.linspace(0.0, 100.0, 1001)
    found = tangents(t, np.clip((t - 30.0) / 20.0, 0.0, 1.0))
    assert (found.start, found.finish) == (pytest.approx(30.0, abs=0.5), pytest.approx(50.0, abs=1))


def test_area_of_a_rectangle() -> None:
    x, y = np.array([1.0, 4.0, 4.0, 1.0]), np.array([0.0, 0.0, 2.0, 2.0])
    assert enclosed_area(x, y) == enclosed_area(x[::-1], y[::-1]) == pytest.approx(6.0)


def test_specimen_is_not_stopped() -> None:
    """Taken out of the actuator, whose stop is at 3.98 mm."""
    assert Bench().wire.stop < Bench().wire.stroke < _actuator_runs.specimen(Bench()).wire.stop
