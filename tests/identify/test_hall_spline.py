"""A sensor's table by a spline: its lag found, what the mean of runs leaves of it gone."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro import hall_table
from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify.hall import fit_spline, fit_table
from macromicro.plant import bench, hall
from macromicro.plant.bench import Bench, Sensors

LAG = 5.0  # readings
GAIN = 1.2e3  # V/m
N = 6000


def place_of(volts: Array) -> Array:
    """A table that bends, m."""
    return np.asarray((volts - 0.3) / GAIN + 2e-5 * np.sin(1.5 * volts))


def made(
    seed: int = 0, pairs: int = 3, slow: float = 2e-7, sign: float = 1.0
) -> list[tuple[Array, Array]]:
    """Ramps that rise fast at the end and fall fast at the end, so that up and down pass a
    voltage at different speeds; the sensor is `LAG` readings late, each run off by `slow` [m]."""
    random = np.random.default_rng(seed)
    volts = np.linspace(0.0, 5.0, 20_001)
    s = np.arange(N) / N
    up = 4e-3 * (0.3 * s + 0.7 * s**3)
    runs = []
    for x in [up, 4e-3 - up] * pairs:
        late = np.interp(np.arange(N) - LAG, np.arange(N), x)
        v = np.interp(late, place_of(volts), volts) + 1e-3 * random.standard_normal(N)
        off = slow * random.standard_normal() + 5e-7 * random.standard_normal(N)
        runs.append((v[20:], sign * (x + off)[20:]))
    return runs


def test_lag_is_fitted_where_the_mean_of_the_runs_keeps_it() -> None:
    runs = made(slow=0.0)
    found, mean = fit_spline(runs), fit_table(runs)
    assert abs(found.lag - LAG) < 4.0 * found.lag_error < 0.2
    inner = (mean.volts > 0.5) & (mean.volts < 4.5)
    off, left = (
        np.sqrt(np.mean((table.calibration.position - place_of(mean.volts))[inner] ** 2))
        for table in (found.fit, mean)
    )
    assert off < 1e-7
    assert left > 5.0 * off
    assert 4e-7 < found.residual < 9e-7  # of a bin; 1e-6 of a reading, by both sensors
    assert found.wide == pytest.approx(2.5706, abs=1e-4)  # Student's t, 5 degrees of freedom


def test_an_offset_of_each_run_is_the_uncertainty() -> None:
    """The standard error of the mean of six runs, whatever the number of readings."""
    found = fit_spline(made(slow=5e-6)).fit
    seen = np.isfinite(found.error)
    offsets = [float(np.mean(x - place_of(v))) for v, x in made(slow=5e-6)]
    ways = np.array([1.0, -1.0] * 3)
    spread = np.std(offsets - ways * np.mean(ways * offsets), ddof=2)
    assert found.error[seen].mean() == pytest.approx(spread / np.sqrt(6.0), rel=0.5)
    np.testing.assert_allclose(found.std[seen], np.sqrt(6.0) * found.error[seen])


def test_beyond_the_runs_the_last_slope_and_no_uncertainty() -> None:
    found = fit_spline(made(), -1.0, 6.0, 141).fit
    seen = np.isfinite(found.error)
    assert found.volts[seen][0] > 0.29 and not seen[[0, -1]].any()
    steps = np.diff(found.calibration.position)
    np.testing.assert_allclose(steps[:20], steps[0])
    np.testing.assert_allclose(steps[-10:], steps[-1])


@pytest.mark.parametrize(
    ("kept", "message"),
    [
        (slice(0, 3), "number 2 and 1"),
        (slice(0, 6, 2), "number 3 and 0"),
        (slice(0, 0), "number 0 and 0"),
    ],
)
def test_two_runs_each_way_or_a_message(kept: slice, message: str) -> None:
    with pytest.raises(InputError, match=message):
        fit_spline(made()[kept])


def test_a_range_that_the_runs_lack_is_refused() -> None:
    with pytest.raises(InputError, match="of 126 voltages are covered"):
        fit_spline(made(), 4.0, 9.0)
    with pytest.raises(InputError, match="a run has"):
        fit_spline([(v[:: N // 20], x[:: N // 20]) for v, x in made()])


@pytest.mark.slow
def test_interval_of_95_percent_covers_the_bench_table() -> None:
    """The shipped bench, whose sensor is known: within 0.1 to 4.9 V."""
    plant = bench.prepare(Bench(), Sensors())
    xs = np.linspace(0.0, 4.1e-3, 20_001)
    shown = np.array([hall.volts(plant.hall, x, 0.0) for x in xs])
    rises = np.concatenate([[True], np.diff(shown) > 1e-9])
    covered, lags = [], []
    for seed in range(200, 208):
        found = fit_spline(hall_table.ramps(plant, seed))
        volts = found.fit.volts
        inner = (volts > 0.1) & (volts < 4.9)
        off = found.fit.calibration.position - np.interp(volts, shown[rises], xs[rises])
        assert np.sqrt(np.mean(off[inner] ** 2)) < 0.08e-6
        covered.append(np.mean(np.abs(off[inner]) <= found.wide * found.fit.error[inner]))
        lags.append(found.lag)
    assert 0.9 <= np.mean(covered) <= 0.99
    assert np.mean(lags) == pytest.approx(3.0, abs=0.1)  # ms, a reading each
