"""Heating and cooling found again in steps made of known dynamics."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
from scipy.signal import lfilter

from macromicro.columns import Column
from macromicro.errors import InputError
from macromicro.hysteresis import from_density
from macromicro.hysteresis.preisach import Preisach
from macromicro.hysteresis.table import FodTable
from macromicro.identify.heating import (
    StepRecord,
    average,
    cooling,
    heating,
    steady,
)
from macromicro.identify.linear import LinearFit
from macromicro.identify.notices import ConvergenceWarning
from macromicro.models.heating import Modes, ladder, step_response
from macromicro.recording import Recording
from macromicro.thesis.chapter5.actuator_models import heating_mls, needed_goal

COLUMNS = (Column("t", "s", ""), Column("laser", "um", ""), Column("ctrl", "V", ""))
MODES = Modes(1.3, 0.09, 0.012, 0.7, 0.2, 0.1)
# Nearly without hysteresis: 4 mm between 20 and 100 degC.
TABLE = FodTable.from_everett(
    from_density(lambda up, down: np.where(up - down < 1.0, 1.0, 0.0), 20.0, 0.5, 161), 0.0, 4.0
)


def trial(x: np.ndarray, dt: float = 0.1, ctrl: np.ndarray | None = None) -> Recording:
    """Positions [mm]."""
    n = len(x)
    sent = np.ones(n) if ctrl is None else ctrl
    return Recording.from_arrays(COLUMNS, [np.arange(n) * dt, 1e3 * x, sent], dt, {})


def stepped(goal: float = 60.0, seconds: float = 200.0, dt: float = 0.05) -> StepRecord:
    """A step from cold; for its first second the position tells no temperature."""
    t = np.arange(0.0, seconds, dt)
    error = np.where(t < 1.0, np.inf, 0.2)
    return StepRecord(t, np.zeros(len(t)), goal * step_response(MODES, t), error)


def test_trials_are_averaged_over_what_all_of_them_have() -> None:
    one, two = np.linspace(0.0, 1.0, 11), np.linspace(0.0, 3.0, 8)
    t, x = average([trial(one), trial(two)])
    np.testing.assert_allclose(t, np.arange(8) * 0.1)
    np.testing.assert_allclose(x, 0.5 * (one[:8] + two))
    with pytest.raises(InputError, match=r"trials: there is no recording"):
        average([])
    with pytest.raises(InputError, match="one sample time"):
        average([trial(one), trial(one, 0.2)])


def test_the_steady_rise_is_the_mean_of_the_last_two_seconds() -> None:
    record = stepped()
    last = record.t >= record.t[-1] - 2.0
    assert steady(record) == pytest.approx(record.rise[last].mean(), rel=1e-12)
    assert steady(record, 50.0) == pytest.approx(record.rise[record.t >= 149.95 - 1e-9].mean())
    error = record.error.copy()
    error[record.t > record.t[-1] - 2.5] = np.inf
    error[record.t > record.t[-1] - 1.9] = 0.2
    with pytest.raises(InputError, match="saturated"):
        steady(record._replace(error=error))
    error[record.t > record.t[-1] - 2.1] = 0.2
    assert steady(record._replace(error=error)) > 0.0


def test_the_modes_of_a_step_are_found_again() -> None:
    """From what its first second hides, too: it has the same goal."""
    found = heating(stepped(), 60.0)
    np.testing.assert_allclose(found.modes, MODES, rtol=1e-4)
    np.testing.assert_allclose(found.ladder, ladder(MODES), rtol=1e-3)
    assert found.nrmse < 1e-6
    half = heating(stepped(), 120.0)  # shares are of the goal
    np.testing.assert_allclose(half.modes[:3], MODES[:3], rtol=1e-4)
    np.testing.assert_allclose(half.modes[3:], 0.5 * np.array(MODES[3:]), rtol=1e-4)


def test_noise_is_told_as_error_of_the_fit_and_of_its_modes() -> None:
    """RMS over the range that was seen; each mode within a few of its standard errors."""
    record = stepped()
    noise = np.random.default_rng(1).normal(0.0, 0.1, len(record.t))
    found = heating(record._replace(rise=record.rise + noise), 60.0)
    seen = record.rise[np.isfinite(record.error)]
    assert found.nrmse == pytest.approx(0.1 / np.ptp(seen), rel=0.15)
    off = np.abs(np.array(found.modes) - MODES) / np.array(found.std)
    assert off.max() < 4.0 and off.mean() > 0.1
    assert all(0.0 < s < m for s, m in zip(found.std, found.modes, strict=True))


@pytest.mark.parametrize("keep", [0.0, 0.9])
def test_intervals_of_the_modes_hold_under_noise_that_goes_together(keep: float) -> None:
    """Of 24 records, 95 % intervals hold nine of ten parameters, and are not wide for nothing."""
    held, wide = [], []
    for seed in range(24):
        record = stepped()
        white = np.random.default_rng(seed).normal(0.0, 0.1, len(record.t))
        noise = np.asarray(lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], white))
        found = heating(record._replace(rise=record.rise + noise), 60.0)
        half = found.factors[1] * np.array(found.std)
        held.append(np.abs(np.array(found.modes) - MODES) < half)
        wide.append(np.array(found.std) / np.abs(np.array(found.modes) - MODES))
    assert np.mean(held) > 0.88
    assert np.median(wide) < 3.0


def test_rates_come_in_falling_order_with_their_own_shares_and_errors() -> None:
    found = heating(stepped(), 60.0)
    assert found.modes.rate1 > found.modes.rate2 > found.modes.rate3
    assert found.modes.share1 > found.modes.share2 > found.modes.share3


@pytest.mark.parametrize(("usable", "goal"), [(49, 60.0), (60, 0.0), (60, -1.0)])
def test_a_step_that_tells_too_little_is_refused(usable: int, goal: float) -> None:
    record = stepped()
    error = np.where(np.arange(len(record.t)) <= usable, 0.2, np.inf)
    with pytest.raises(InputError, match="50 samples or more"):
        heating(record._replace(error=error), goal)  # the sample at 0 s does not count


def told(record: StepRecord, dt: float) -> LinearFit:
    """`mls` of clean data has nothing to settle by."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        return heating_mls(record, 60.0, dt)


def test_the_thesis_way_finds_the_slow_response_too() -> None:
    """mls of order three on even samples; five of rest before the step show where it begins."""
    found = told(stepped()._replace(error=np.full(4000, 0.2)), 0.5)
    assert (len(found.a), len(found.b), found.dt) == (3, 3, 0.5)
    assert found.b.sum() / (1.0 + found.a.sum()) == pytest.approx(1.0, abs=1e-3)
    made = 60.0 * step_response(MODES, np.arange(0.0, 199.95, 0.5))
    np.testing.assert_allclose(found.free_run[0][5:], made, atol=0.01)
    np.testing.assert_array_equal(found.free_run[0][:5], 0.0)


def test_until_a_temperature_is_known_a_line_from_zero_stands_for_it() -> None:
    record = stepped(seconds=60.0)
    record = record._replace(error=np.where(record.t < 4.0, np.inf, 0.2))
    found = told(record, 0.5)
    shown = found.free_run[0] + found.residuals[0]  # nearly the output that it was given
    line = np.interp(4.0, record.t, record.rise) * np.arange(8) / 8.0
    np.testing.assert_allclose(shown[5:13], line, atol=1.5)
    np.testing.assert_allclose(shown[13:], record.rise[80::10], atol=1.5)


def test_the_default_is_ten_samples_a_second() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        found = heating_mls(stepped(seconds=6.0)._replace(error=np.full(120, 0.2)), 60.0)
    assert found.dt == 0.1 and len(found.residuals[0]) == 5 + 60


def test_the_goal_needed_to_pass_a_position_when_the_record_does() -> None:
    t = np.arange(0.0, 60.0, 0.1)
    x = np.minimum(0.05 * t, 2.5)
    found = needed_goal(TABLE, MODES, t, x, 25.0, 2.0)
    # 2 mm are half of the way from 20 to 100 degC, reached at 40 s.
    assert found == pytest.approx((60.0 - 25.0) / float(step_response(MODES, 40.0)), rel=0.01)
    for level in (2.6, 0.0, -1.0):
        with pytest.raises(InputError, match="one that passes"):
            needed_goal(TABLE, MODES, t, x, 25.0, level)


def cooled(tau: float, hold: float = 5.0, dt: float = 0.02, extra: float = 0.0) -> Recording:
    """Held at 85 degC, then an exponential towards 25 degC."""
    t = np.arange(0.0, hold + 4.0 * tau, dt)
    fall = np.maximum(t - hold, 0.0)
    warm = 25.0 + 60.0 * np.exp(-fall / tau)
    x = Preisach(TABLE).run(np.r_[20.0, warm])[1:]
    ctrl = np.where(t < hold - 1e-9, 1.575, 0.0)
    return trial(x + extra, dt, ctrl)


@pytest.mark.parametrize("tau", [0.7, 1.0, 2.5])
def test_the_time_constant_of_a_fall_is_found(tau: float) -> None:
    """63 % of it, and by least squares; the fall begins at the temperature held before."""
    found = cooling(TABLE, [cooled(tau), cooled(tau)], 25.0)
    assert found.time == pytest.approx(tau, abs=0.03)
    assert found.fitted == pytest.approx(tau, rel=0.03)
    assert found.peak == pytest.approx(85.0, abs=0.1)
    assert found.nrmse < 0.02


def test_a_fall_that_is_no_exponential_has_an_error_as_a_share_of_it() -> None:
    """A straight fall of 60 K in 6 s: 63 % of it are gone in 3.8 s."""
    t = np.arange(0.0, 14.0, 0.02)
    warm = np.maximum(85.0 - 10.0 * np.maximum(t - 5.0, 0.0), 25.0)
    x = Preisach(TABLE).run(np.r_[20.0, warm])[1:]
    found = cooling(TABLE, [trial(x, 0.02, np.where(t < 5.0 - 1e-9, 1.5, 0.0))], 25.0)
    assert found.time == pytest.approx(6.0 * (1.0 - math.exp(-1.0)), abs=0.05)
    s = np.linspace(0.0, found.time, 5000)
    off = 60.0 * np.exp(-s / found.fitted) - (60.0 - 10.0 * s)
    assert found.nrmse == pytest.approx(np.sqrt(np.mean(off**2)) / np.ptp(10.0 * s), rel=0.05)


def test_a_fall_that_is_not_seen_is_refused() -> None:
    on = cooled(1.0)
    with pytest.raises(InputError, match="never returns to 0"):
        cooling(TABLE, [trial(on["laser"] * 1e-3, 0.02)], 25.0)
    x = np.full(600, 4.2)  # beyond the table: no temperature is told
    with pytest.raises(InputError, match="first 63 %"):
        cooling(TABLE, [trial(x, 0.02, np.where(np.arange(600) < 250, 1.5, 0.0))], 25.0)


def test_a_heating_fit_that_does_not_settle_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    from scipy import optimize

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        heating(stepped(), 60.0)
    real = optimize.least_squares
    monkeypatch.setattr(optimize, "least_squares", lambda *a, **k: real(*a, **{**k, "max_nfev": 1}))
    with pytest.warns(ConvergenceWarning, match="heating"):
        heating(stepped(), 60.0)
