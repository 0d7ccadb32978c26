"""Errors of output error: forces, noise of the position, pieces, and models that do not fit."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from macromicro.arrays import Array
from macromicro.identify.axis import Axis, simulate
from macromicro.identify.axis_inverse import Rows, differences, fitted
from macromicro.identify.axis_refine import piece, refined
from macromicro.identify.axis_spread import Noise, _differentiated, disturbance, sensed
from macromicro.identify.notices import DataWarning
from macromicro.identify.runs import Run

DT = 1e-3
TRUTH = Axis(4.0, 25.0, 12.0, 2.0)


def forces(n: int, seed: int = 0, low: float = -60.0) -> Array:
    return np.repeat(np.random.default_rng(seed).uniform(low, 60.0, n // 200), 200)


def record(
    n: int, force: float, sensor: float, seed: int = 0, axis: Axis = TRUTH, low: float = -60.0
) -> list[Rows]:
    random = np.random.default_rng(1000 + seed)
    u = forces(n, seed, low)
    x = simulate(axis, u + force * random.standard_normal(n), DT)
    x = x + sensor * random.standard_normal(n)
    return [differences(Run(np.arange(n) * DT, u, x), u, 80.0, 10)]


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


def test_longer_records_do_not_fit_worse() -> None:
    """Forces that nobody measured: four times the record, half the error, and said so."""
    said, real = [], []
    for n in (20000, 80000):
        found = []
        for seed in range(4):
            rows = record(n, 6.0, 0.0, seed)
            found.append(refined(rows, fitted(rows, "coulomb")))
        said.append(np.median([e.std for e in found], axis=0))
        real.append(np.sqrt(np.mean([(e.values - TRUTH[:4]) ** 2 for e in found], axis=0)))
    assert np.all(said[1] < 0.75 * said[0])
    assert np.all(real[1] < 0.9 * real[0]) and np.all(real[1] < 3.0 * said[1])


def test_noise_of_the_position_alone_gives_its_own_small_errors() -> None:
    """Ten times smaller than inverse dynamics would have them, and right."""
    found = []
    for seed in range(8):
        rows = record(8000, 0.0, 1e-5, seed)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            found.append(refined(rows, fitted(rows, "coulomb")))
    said = np.median([e.std for e in found], axis=0)
    real = np.sqrt(np.mean([(e.values - TRUTH[:4]) ** 2 for e in found], axis=0))
    assert np.all((real > 0.4 * said) & (real < 2.0 * said)), (real, said)
    assert said[0] < 1e-4


def test_a_model_that_does_not_fit_is_said_and_its_errors_are_wide() -> None:
    """One way with stops, without Coulomb friction in the model: 84 kg +- 0.15 of 95 it was."""
    axis = Axis(95.0, 200.0, 20.0)
    random = np.random.default_rng(0)
    u = np.repeat(random.uniform(0.0, 100.0, 50), 400)
    x = simulate(axis, u, DT) + 2e-6 * random.standard_normal(len(u))
    rows = [differences(Run(np.arange(len(u)) * DT, u, x), u, 80.0, 10)]
    with pytest.warns(DataWarning, match=r"free run misses by 0\.00.* noise explains"):
        found = refined(rows, fitted(rows, "viscous"))
    assert abs(found.axis.mass - 95.0) < 2.0 * found.std[0]
    assert found.std[0] > 1.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        quiet = refined(rows, fitted(rows, "viscous"), told=False)
    assert quiet.values.tolist() == found.values.tolist() and np.isnan(quiet.std).all()


def test_a_piece_is_twenty_time_constants_or_a_thousand_samples() -> None:
    """Of a record longer than sixty, here 9.6 s; where noise of the position rules, all of it."""
    rows = record(40000, 0.0, 0.0)
    start = fitted(rows, "coulomb")
    turn = start.axis.mass / start.axis.viscous / DT
    assert piece(rows, start, False) == int(20.0 * turn)
    assert piece(rows, start, True) == 40000
    assert piece(record(9000, 0.0, 0.0), start, False) == 9000
    assert piece(record(10000, 0.0, 0.0), start, False) == int(20.0 * turn)
    heavy = fitted(record(40000, 1.0, 0.0, axis=TRUTH._replace(mass=0.5)), "coulomb")
    assert piece(rows, heavy, False) == 1000


def test_counts_of_an_encoder_alone_give_errors_of_rounding() -> None:
    n, step, off = 8000, 2e-5, []
    for seed in range(12):
        u = forces(n, seed)
        at = np.random.default_rng(seed).uniform()
        x = np.floor(simulate(TRUTH, u, DT) / step + at) * step
        rows = [differences(Run(np.arange(n) * DT, u, x), u, 80.0, 10)]
        found = refined(rows, fitted(rows, "coulomb"))
        off.append(np.abs(found.values - TRUTH[: len(found.values)]) / found.std)
    assert (np.array(off) < 2.0).mean() >= 0.85
    assert (np.array(off) < 0.5).mean() < 0.6  # taken for white noise they are twice too wide
