"""A kiln's record cleaned, cut into legs and curves, and predicted."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.columns import Column
from macromicro.hysteresis import from_density
from macromicro.hysteresis.preisach import Preisach
from macromicro.hysteresis.table import FodTable
from macromicro.identify.kiln import (
    Profile,
    clean,
    first_order_curves,
    fod_table,
    predict,
)
from macromicro.recording import Recording

COLUMNS = (Column("t", "s", ""), Column("thermocouple", "degC", ""), Column("position", "mm", ""))


def recorded(temperature: np.ndarray, position: np.ndarray, dt: float = 0.1) -> Recording:
    t = np.arange(len(temperature)) * dt
    return Recording.from_arrays(COLUMNS, [t, temperature, position], dt, {})


def test_cleaning_takes_spikes_out_and_keeps_parabolas() -> None:
    """A parabola fitted over 6 s leaves one as it is, and its turning point."""
    t = np.arange(0.0, 300.0, 0.1)
    smooth = 60.0 - 0.002 * (t - 150.0) ** 2
    spiky = smooth + 9.0 * ((t > 50.0) & (t < 52.0))
    found = clean(recorded(spiky, 0.01 * t))
    np.testing.assert_allclose(found.temperature, smooth, atol=0.02)
    np.testing.assert_allclose(found.position, 0.01 * t)
    np.testing.assert_allclose(found.t, t)


@pytest.mark.parametrize(("window", "share"), [(0.0, 1.0), (0.3, 1.0), (6.0, 0.19)])
def test_noise_is_averaged_over_its_window(window: float, share: float) -> None:
    """A parabola over n samples keeps about 1.5 / sqrt(n) of white noise: of 61 here. Less than
    five samples are left alone."""
    noise = np.random.default_rng(0).normal(0.0, 0.02, 5000)
    found = clean(recorded(50.0 + noise, np.zeros(5000)), window).temperature - 50.0
    assert found.std() / noise.std() == pytest.approx(share, rel=0.06)
    if share == 1.0:
        np.testing.assert_array_equal(found + 50.0, 50.0 + noise)


def test_a_curve_begins_where_the_record_turned_and_goes_on_by_window_means() -> None:
    up, down = np.linspace(25.0, 75.0, 501), np.linspace(75.0, 25.0, 501)[1:]
    u = np.r_[up, down, up[1:], down]
    made = Profile(np.arange(len(u)) * 0.1, u, 0.01 * u + np.linspace(0.0, 0.1, len(u)))
    curves = first_order_curves(made, 35.0, width=0.45)
    assert len(curves) == 2
    for begin, (uu, xx) in zip((500, 1500), curves, strict=True):
        assert uu[0] == 75.0 and xx[0] == pytest.approx(made.position[begin : begin + 3].mean())
        # Windows of five samples 0.1 degC apart: the first one is the turn's.
        np.testing.assert_allclose(uu[1:4], [74.3, 73.8, 73.3])
        rows = begin + 5 + np.arange(5)
        assert xx[1] == pytest.approx(made.position[rows].mean())
        assert uu[-1] == pytest.approx(25.0, abs=0.3)


TABLE = FodTable.from_everett(
    from_density(lambda up, down: np.where(up - down < 20.0, 1.0, 0.0), 20.0, 1.0, 81), 0.5, 4.0
)


def heated(*peaks: float) -> np.ndarray:
    legs = []
    for peak in peaks:
        rise = np.arange(25.0, peak, 0.1)
        legs += [rise, rise[::-1]]
    return np.concatenate(legs)


def test_a_prediction_is_the_models_run_along_the_cleaned_temperature() -> None:
    u = heated(90.0, 60.0)
    x = Preisach(TABLE).run(u)
    found = predict(TABLE, recorded(u, x + 0.07))
    model = Preisach(TABLE).run(found.profile.temperature)
    np.testing.assert_allclose(found.model, model, atol=1e-12)
    np.testing.assert_allclose(found.profile.position, x + 0.07)
    error = model - found.profile.position
    assert found.rms == pytest.approx(np.sqrt(np.mean(error**2)))
    assert found.share == pytest.approx(found.rms / 3.5)
    assert found.rms == pytest.approx(0.07, rel=0.1)


def test_a_table_comes_from_all_recordings_together() -> None:
    u, v = heated(95.0, 85.0, 75.0), heated(65.0, 55.0, 45.0)
    made = [recorded(w, Preisach(TABLE).run(w)) for w in (u, v)]
    found = fod_table(made, nodes=41)
    assert len(found.raw) == 6
    assert found.shape == "nonnegative" and found.n == 41
    x = Preisach(TABLE).run(u)
    assert predict(found, made[0]).rms < 0.03 * np.ptp(x)


def test_a_share_of_the_stroke_has_no_sign() -> None:
    """Of an actuator that extends on heating as of one that contracts."""
    falling = FodTable(TABLE.lo, TABLE.step, -TABLE.values, 4.0)
    u = heated(90.0)
    x = Preisach(falling).run(u)
    found = predict(falling, recorded(u, x + 0.07))
    assert found.share == pytest.approx(found.rms / 3.5) and found.share > 0.0
