"""How far the runs of a Hall calibration agree (Figure 3.9)."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.identify.hall import calibrate, fit_table


def runs(noise: float, lag: float, pairs: int = 3) -> list[tuple[np.ndarray, np.ndarray]]:
    """Ramps up and down: the sensor trails the stage by `lag` [m]; each run has an offset
    of `noise` [m] (standard deviation)."""
    random = np.random.default_rng(1)
    place = np.linspace(0.0, 4e-3, 40_000)
    made = []
    for _ in range(pairs):
        for x, way in ((place, 1.0), (place[::-1], -1.0)):
            volts = 0.3 + 1.1e3 * (x - way * lag)
            made.append((volts, x + noise * random.standard_normal()))
    return made


def test_table_is_the_same_with_and_without_its_uncertainty() -> None:
    data = runs(1e-6, 2e-6)
    fit = fit_table(data)
    np.testing.assert_array_equal(fit.calibration.position, calibrate(data).position)
    assert fit.runs == 6


def test_lag_shows_between_the_directions_and_cancels_in_the_mean() -> None:
    fit = fit_table(runs(0.0, 2e-6))
    seen = np.isfinite(fit.between)
    np.testing.assert_allclose(fit.between[seen], 2e-6, atol=1e-9)
    np.testing.assert_allclose(fit.std[seen], 2e-6 * np.sqrt(6 / 5), rtol=1e-3)
    line = (fit.volts - 0.3) / 1.1e3
    np.testing.assert_allclose(fit.calibration.position[seen], line[seen], atol=1e-9)


def test_scatter_of_the_runs_is_the_uncertainty() -> None:
    fit = fit_table(runs(3e-6, 0.0, pairs=40))
    seen = np.isfinite(fit.std)
    assert fit.std[seen].mean() == pytest.approx(3e-6, rel=0.25)
    np.testing.assert_allclose(fit.error[seen], fit.std[seen] / np.sqrt(80))


def test_one_run_has_no_uncertainty() -> None:
    with pytest.raises(InputError, match="two runs"):
        fit_table(runs(0.0, 0.0)[:1])
