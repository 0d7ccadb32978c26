"""Open-loop steps (Section 5.2.2) and what is identified from them."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.identify.heating import average, cooling, inferred_step, steady
from macromicro.lab import drive
from macromicro.models import heating
from macromicro.models.heating import from_transfer, step_response
from macromicro.plant import bench
from macromicro.plant.bench import Bench, Sensors
from macromicro.thesis.chapter5 import actuator_models, electrothermal_runs
from macromicro.thesis.chapter5.actuator_models import Models
from macromicro.thesis.chapter5.electrothermal_runs import StepData

PRINTED = from_transfer(*heating.PRINTED)


def test_trials_differ_by_noise_only(stepped: StepData) -> None:
    """Figure 5.10: three trials, their mean drawn solid."""
    first, second, _ = stepped.steps[1.6]
    apart = first["laser"] - second["laser"]
    assert 0.0 < apart.std() < 5.0
    t, mean = average([first, second])
    np.testing.assert_allclose(mean, 0.5e-3 * (first["laser"] + second["laser"]))
    assert t[-1] == pytest.approx(200.0, abs=0.02)


def test_stop_is_reached_above_1_6_volts_only(stepped: StepData) -> None:
    """Claim S3: 3.98 mm, at 1.8 V and not at 1.6 V."""
    assert stepped.steps[1.8][0]["laser"].max() == pytest.approx(3980.0, abs=20.0)
    assert stepped.steps[1.8][0]["contract"].max() == 1
    assert stepped.steps[1.6][0]["laser"].max() < 3900.0
    assert stepped.steps[1.6][0]["contract"].max() == 0


def test_a_step_at_the_stop_has_no_steady_temperature(stepped: StepData, models: Models) -> None:
    record = inferred_step(models.table, stepped.steps[1.8], 25.0)
    with pytest.raises(InputError, match="the position is saturated"):
        steady(record)


def test_asymptote(models: Models) -> None:
    """Claim S5a, (5.3): 83 +-3 K above ambient, offset 57.66 K at 1.5 V."""
    for fit in (models.thesis.linearised, models.thesis.nonlinear):
        assert fit.asymptote == pytest.approx(83.0, abs=3.0)
        assert fit.model.y0 == pytest.approx(57.66, abs=3.0)
    low, high = models.thesis.nonlinear.asymptote_interval
    assert low < models.thesis.nonlinear.asymptote < high


def test_exponent(models: Models) -> None:
    """Claim S5b, (5.5): A = 37.86 1/V within 30 %, or within the confidence interval."""
    assert models.thesis.linearised.model.a == pytest.approx(37.86, rel=0.3)
    assert models.thesis.nonlinear.model.a == pytest.approx(37.86, rel=0.3)
    low, high = models.thesis.nonlinear.interval[1]
    assert low < 37.86 < high


def test_heating_dynamics(models: Models) -> None:
    """Claim S7, (5.6): step response within 5 % (NRMSE) of the printed one."""
    t = np.arange(0.0, 60.0, 0.01)
    printed = step_response(PRINTED, t)
    found = step_response(models.thesis.heating.modes, t)
    assert np.sqrt(np.mean((found - printed) ** 2)) / np.ptp(printed) < 0.05
    # Its slowest mode is not through when the step ends: the DC gain exceeds 1, as printed.
    assert 1.0 < sum(models.thesis.heating.modes[3:]) < 1.03
    assert min(models.thesis.heating.ladder) > 0.0


@pytest.mark.filterwarnings("ignore:mls. not settled")
def test_mls_finds_the_same_dynamics(stepped: StepData, models: Models) -> None:
    """Section 5.2.2: (5.6) was found by MLS."""
    record = inferred_step(models.table, stepped.steps[1.6], 25.0)
    fit = actuator_models.heating_mls(record, steady(record), 0.2)
    y = fit.simulate(np.ones(300))
    printed = step_response(PRINTED, np.arange(300) * 0.2)
    assert np.sqrt(np.mean((y - printed) ** 2)) / np.ptp(printed) < 0.05


def test_cooling_constant(models: Models) -> None:
    """Claim S8, (5.9): 63 % of the fall from 1.575 V, held 10 s, takes 0.8-1.3 s."""
    assert 0.8 < models.thesis.cooling.time < 1.3
    assert models.thesis.cooling.fitted == pytest.approx(models.thesis.cooling.time, rel=0.15)


def test_cooling_record_without_cooling_is_refused(stepped: StepData, models: Models) -> None:
    with pytest.raises(InputError, match="never returns to 0"):
        cooling(models.table, stepped.steps[1.6], 25.0)


def test_full_model_fails_as_the_thesis_says(models: Models) -> None:
    """Claim S10: steady within 5 % of stroke at 1.5-1.6 V; at 1.8 V the dynamic error is at
    least 3 times that at 1.575 V."""
    for volts in electrothermal_runs.BELOW_STOP:
        assert abs(models.steps[volts].steady) < 0.05
    assert models.steps[1.8].dynamic > 3.0 * models.steps[1.575].dynamic


@pytest.mark.parametrize("name", ["1.65 V", "1.7 V", "1.8 V", "1.625 V", "1.675 V", "1.75 V"])
def test_better_model_at_least_halves_the_dynamic_error(models: Models, name: str) -> None:
    """On runs that it was not fitted to, the last three at voltages in no other run; against
    the thesis' model with the gain identified here, and with the printed one."""
    compared = models.unseen[name]
    assert compared.better.dynamic < 0.5 * compared.thesis.dynamic
    assert compared.better.dynamic < 0.5 * compared.printed.dynamic


@pytest.mark.parametrize("name", ["staircase", "minor loops"])
def test_better_model_follows_minor_loops(models: Models, name: str) -> None:
    compared = models.unseen[name]
    assert compared.better.whole < 0.03
    assert compared.better.whole < 0.3 * compared.thesis.whole


def test_better_model_is_a_physical_one(models: Models) -> None:
    """DESIGN: three nodes of positive elements; latent heat; a stage that stiffens."""
    p = models.better.model.wires
    assert min(p.ladder) > 0.0
    assert p.latent > 0.0
    assert p.stiffening > 0.0
    assert np.all(np.diff(p.heat) >= 0.0)
    assert models.better.rms < 0.03
    assert all(np.isfinite(v) and v >= 0.0 for v in models.better.std.values())


def test_profiles_that_are_none_are_refused() -> None:
    with pytest.raises(InputError, match="CTRL profile"):
        drive.heated(bench.prepare(Bench(), Sensors()), [1.5, np.nan])
