"""Laser interferometer: Sections 6.1 and 6.4.1, Figure 6.6."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.plant import bench, laser
from macromicro.plant.laser import Laser
from macromicro.types import Outputs

from .drives import PLANT, drive

P = Laser()


@pytest.mark.parametrize("seed", range(6))
def test_noise_at_rest_is_two_micrometres(seed: int) -> None:
    """Section 6.4.1 (I5): half peak-to-peak of 1.5-2.5 um over 10 s, machine at rest."""
    reading = drive(np.zeros(10000), np.zeros(10000), seed)[2]
    assert 1.5e-6 <= 0.5 * np.ptp(reading) <= 2.5e-6


def test_slow_noise_keeps_its_deviation_and_forgets_within_its_time() -> None:
    """Stationary: started at zero it reaches the set deviation; correlation exp(-t/time)."""
    rng = np.random.default_rng(0)
    drift, track = 0.0, np.empty(200000)
    for k in range(len(track)):
        drift = laser.drifted(P, drift, float(rng.standard_normal()), 0.01)
        track[k] = drift
    assert track.std() == pytest.approx(P.drift, rel=0.05)
    lag = round(P.drift_time / 0.01)
    assert np.corrcoef(track[:-lag], track[lag:])[0, 1] == pytest.approx(np.exp(-1.0), abs=0.05)


@given(st.floats(-0.2, 0.2))
def test_a_quiet_reading_is_the_path_to_half_a_resolution(path: float) -> None:
    """Section 7.1: the laser's own resolution is 5 nm."""
    assert abs(laser.reading(P, path, 0.0, 0.0) - path) <= 0.5 * P.resolution + 1e-15


def test_reset_makes_the_present_place_zero() -> None:
    """Section 6.1: the laser is reset after the macro move, wherever the stage is."""
    still = PLANT._replace(laser=P._replace(noise=0.0, drift=0.0))
    s = bench.initial(still, 0.1)
    s = s._replace(macro=s.macro._replace(x=0.123), micro=s.micro)
    away = bench.measure(still, s, 0.0, bench.Noise()).laser
    assert away == pytest.approx(0.023, abs=50e-6)
    held = bench.advance(still, s, Outputs(0.0, 0.0, 0.0, 0.0), bench.Noise(), 1e-3)
    assert bench.measure(still, held, 0.0, bench.Noise()).laser == pytest.approx(away, abs=1e-6)
    reset = bench.advance(still, s, Outputs(0.0, 0.0, 0.0, 1.0), bench.Noise(), 1e-3)
    assert abs(bench.measure(still, reset, 0.0, bench.Noise()).laser) <= 1e-8


@pytest.mark.parametrize("draw", [0.0, 2.0, -1.5])
def test_slow_noise_is_pushed_by_its_draws(draw: float) -> None:
    """A share exp(-dt/time) stays; the draw's share keeps the deviation as it is."""
    keep = np.exp(-0.1 / P.drift_time)
    wanted = keep * 4e-7 + P.drift * np.sqrt(1.0 - keep**2) * draw
    assert laser.drifted(P, 4e-7, draw, 0.1) == pytest.approx(wanted)


@pytest.mark.parametrize("draw", [0.0, 2.0, -1.5])
@pytest.mark.parametrize("drift", [0.0, 3e-7, -2e-7])
def test_a_reading_is_path_and_both_noises_in_steps(draw: float, drift: float) -> None:
    found = laser.reading(P, 0.0123, draw, drift)
    assert found == pytest.approx(0.0123 + P.noise * draw + drift, abs=0.5001 * P.resolution)
    assert found / P.resolution == pytest.approx(round(found / P.resolution), abs=1e-6)
