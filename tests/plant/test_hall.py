"""Hall sensor and magnets: Section 3.2.3, Figures 3.7-3.9."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro.plant import encoder, hall
from macromicro.plant.encoder import Converter
from macromicro.plant.hall import Hall

P = Hall()
TRAVEL = np.linspace(0.0, 3.98e-3, 400)


def curve(p: Hall = P) -> np.ndarray:
    """Output [V] over the travel."""
    return np.array([hall.volts(p, float(x), 0.0) for x in TRAVEL])


def test_output_is_strictly_monotone_over_the_travel() -> None:
    """Figure 3.9: every voltage belongs to one position."""
    assert np.all(np.diff(curve()) > 0.0)


def test_mean_slope_is_0_8_um_per_mv() -> None:
    """Section 3.2.3 (D6): 0.75-0.85 um/mV over the travel, 0.976 um/bit."""
    v = curve()
    slope = TRAVEL[-1] * 1e6 / ((v[-1] - v[0]) * 1e3)
    assert 0.75 <= slope <= 0.85
    assert slope * 5000.0 / 4096.0 == pytest.approx(0.976, rel=0.06)


def test_output_uses_the_sensor_s_range_without_saturating() -> None:
    """Section 3.2.3: from 0 to 5 V, 2.5 V midway; and the A/D board can read all of it."""
    v = curve()
    assert 0.0 < v.min() < 0.2
    assert 4.8 < v.max() < 5.0
    assert hall.volts(P, P.centre, 0.0) == pytest.approx(2.5)
    top = encoder.sample(Converter(), float(v.max()) + 4.0 * P.noise)
    assert top < 5.0 - 5.0 / 4096.0


def test_curve_is_odd_about_the_middle() -> None:
    """Figure 3.7: two equal magnets of opposite poles."""
    for d in np.linspace(0.0, 2e-3, 20):
        up, down = hall.volts(P, P.centre + d, 0.0), hall.volts(P, P.centre - d, 0.0)
        assert up - 2.5 == pytest.approx(2.5 - down)


def test_sensor_saturates_at_its_supply() -> None:
    """Section 3.2.3: magnets that touch the sensor saturate it to 0 V or 5 V."""
    strong = P._replace(gain=10.0 * P.gain)
    assert hall.volts(strong, 0.0, 0.0) == 0.0
    assert hall.volts(strong, 3.98e-3, 0.0) == 5.0


def test_lag_is_first_order_and_none_when_zero() -> None:
    goal = hall.volts(P, 2e-3, 0.0)
    assert hall.lagged(P, 0.0, 2e-3, 0.0, P.lag) == pytest.approx(goal * (1.0 - math.exp(-1.0)))
    assert hall.lagged(P._replace(lag=0.0), 0.0, 2e-3, 0.0, 1e-3) == goal
