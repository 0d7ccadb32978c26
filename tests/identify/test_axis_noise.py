"""What disturbs an axis (`macromicro.identify._axis_noise`)."""

from __future__ import annotations

import numpy as np
import pytest
from tests.identify.disturbed import record, slow_record

from macromicro.identify._axis_noise import Noise, _differentiated, disturbance, sensed
from macromicro.identify.axis_inverse import fitted


def test_noise_of_a_position_is_seen_through_its_motion() -> None:
    (rows,) = record(8000, 0.0, 3e-5)
    assert sensed(rows.run.x) == pytest.approx(3e-5, rel=0.05)
    (rows,) = record(8000, 6.0, 0.0)
    assert sensed(rows.run.x) < 2e-6


def test_slow_forces_are_told_from_noise_of_the_position() -> None:
    """White noise of 6 N at 1 kHz: over a block of B samples 6 / sqrt(B)."""
    rows = record(40000, 6.0, 0.0)
    start = fitted(rows, "coulomb")
    told = disturbance(rows, start)
    assert told.block == 20

    def slow(found: Noise) -> float:
        return float(np.sqrt(found.power * found.block) / (1.0 + found.filter.sum()))

    assert slow(told) == pytest.approx(6.0, rel=0.15)
    rows = record(40000, 0.0, 1e-5)
    start = fitted(rows, "coulomb")
    quiet = disturbance(rows, start)
    assert slow(quiet) < 0.5 and quiet.sensor == pytest.approx(1e-5, rel=0.05)


def test_a_block_mean_of_a_second_difference_is_that_of_its_ends() -> None:
    """White noise behind an ideal low-pass at 0.04 of the rate, by a long draw."""
    spectrum = np.fft.rfft(np.random.default_rng(0).standard_normal(400_000))
    spectrum[int(0.04 * 400_000) :] = 0.0
    second = np.diff(np.fft.irfft(spectrum), 2)
    for block in (10, 20, 50):
        means = second[: len(second) // block * block].reshape(-1, block).mean(axis=1)
        assert _differentiated(block, 10) == pytest.approx(np.mean(means**2), rel=0.05)


def test_what_a_slow_force_may_be_is_told_by_measured_samples() -> None:
    """Its strength and time, in the middle of some records; of a quick force nothing."""
    strength, time = [], []
    for seed in range(12):
        rows = slow_record(seed)
        may = disturbance(rows, fitted(rows, "coulomb")).slow
        weights = np.array([one.weight for one in may])
        strength.append(np.exp(weights @ np.log([one.slow for one in may])))
        time.append(np.exp(weights @ np.log([one.time for one in may])))
    assert np.median(strength) == pytest.approx(1.44, rel=0.5)
    assert np.median(time) == pytest.approx(1000.0, rel=0.5)
    rows = record(8000, 6.0, 0.0)
    assert not disturbance(rows, fitted(rows, "coulomb")).slow
