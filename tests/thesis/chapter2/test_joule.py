"""The heat balance (2.1)."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.thesis.chapter2 import actuator_principle
from macromicro.thesis.chapter2.actuator_principle import Filament


def test_time_constant_and_end() -> None:
    """rho Cp V / (h A) and R i^2 / (h A) for a metre of wire, term by term."""
    p = Filament(diameter=0.2e-3, convection=80.0)
    volume, surface = np.pi * p.diameter**2 / 4.0, np.pi * p.diameter
    tau = p.density * p.heat * volume / (p.convection * surface)
    assert actuator_principle.time_constant(p) == pytest.approx(tau)
    rise = p.resistivity / volume * 0.3**2 / (p.convection * surface)
    assert actuator_principle.steady(p, 0.3) == pytest.approx(p.ambient + rise)


def test_solution_meets_the_equation() -> None:
    """(2.1) itself, in differences."""
    p, dt = Filament(), 1e-4
    current = np.where(np.arange(20000) < 10000, 0.25, 0.1)
    t = actuator_principle.temperature(p, current, dt)
    area = np.pi * p.diameter**2 / 4.0
    stored = p.density * p.heat * area * np.gradient(t, dt)
    given = p.resistivity / area * current**2 - p.convection * np.pi * p.diameter * (t - p.ambient)
    inside = np.r_[10:9990, 10010:19990]
    assert np.max(np.abs(stored - given)[inside]) < 1e-3 * np.max(np.abs(given))


def test_dot_after_one_time_constant() -> None:
    p = Filament()
    tau = actuator_principle.time_constant(p)
    t = actuator_principle.temperature(p, np.full(1000, 0.2), tau / 1000.0)
    share = (t[-1] - p.ambient) / (actuator_principle.steady(p, 0.2) - p.ambient)
    assert share == pytest.approx(1.0 - np.exp(-1.0))
