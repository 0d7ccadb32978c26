"""The kiln's procedure (Section 5.2.1): cycles, spikes, the table and its predictions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import median_filter
from tests.thesis.fixture_drives import KilnTwin

from macromicro.errors import InputError
from macromicro.identify.kiln import (
    clean,
    first_order_curves,
    fod_table,
    predict,
    without_spikes,
)
from macromicro.recording import Recording
from macromicro.rig.fixtures import KILN_PERIOD, KilnSample
from macromicro.rig.session import KILN, Fixture
from macromicro.thesis import kiln_bench as fixture
from macromicro.thesis.chapter5 import kiln_runs as kiln
from macromicro.thesis.chapter5.actuator_models import full_contraction
from macromicro.thesis.chapter5.kiln import KilnRuns
from macromicro.thesis.chapter5.kiln_runs import KilnData
from macromicro.thesis.kiln_bench import KilnBench


def rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(x**2)))


def test_compiled_run_equals_the_rig_sample_by_sample() -> None:
    """The thermostat drives the twin as it drives the compiled rollout: the same bits."""
    plant = fixture.prepare(KilnBench())
    turns = [45.0, 38.0, 41.0]
    fast = kiln.run(plant, turns, seed=3)
    channels = ("thermocouple", "encoder")
    rig = Fixture("a kiln", KILN, lambda seed: KilnTwin(plant, seed), channels, KILN_PERIOD)
    slow = kiln.run(rig, turns, seed=3)
    assert [c.name for c in slow.columns] == [c.name for c in fast.columns[:5]]
    assert len(fast) == len(slow) > 500
    for name in ("t", "thermocouple", "encoder", "position", "heater"):
        np.testing.assert_array_equal(fast[name], slow[name])


def test_maxima_fall_and_every_cycle_ends_cold(heated: KilnData) -> None:
    """Section 5.2.1: with each heating cycle M_k was decreased, then cooled to ambient."""
    curves = first_order_curves(clean(heated.curves), cold=35.0)
    assert len(curves) == len(kiln.MAXIMA)
    tops = [u[0] for u, _ in curves]
    # Interference may hold the relay on for a few seconds, so a maximum is met to a few kelvin.
    assert np.abs(np.array(tops) - kiln.MAXIMA).max() < 4.0
    assert all(u[-1] < kiln.COLD + 1.0 for u, _ in curves)


def test_encoder_shows_fourteen_micrometres(heated: KilnData) -> None:
    """Section 5.2.1: a linear resolution of approximately 14 um."""
    r = heated.curves
    steps = np.unique(np.round(np.diff(np.unique(r["position"])), 6))
    assert steps.min() == pytest.approx(0.014, rel=1e-3)
    assert np.abs(r["position"] - r["true_position"]).max() < 0.014


def test_smoothing_takes_the_spikes_and_leaves_the_temperature(heated: KilnData) -> None:
    """Claim S1: under 0.5 K RMS where raw spikes exceed 5 K. The reference is the
    temperature of the thermocouple itself, which only a twin knows."""
    r = heated.curves
    true = r["true_thermocouple"]
    smooth = without_spikes(r["t"], r["thermocouple"])
    assert np.abs(r["thermocouple"] - true).max() > 5.0
    assert rms(r["thermocouple"] - true) > 1.5
    assert rms(smooth.values - true) < 0.2
    assert np.abs(smooth.values - true).max() < 1.5
    # Nothing but the neighbourhood of spikes was touched.
    assert smooth.replaced.mean() < 0.1
    kept = ~smooth.replaced
    np.testing.assert_array_equal(smooth.values[kept], r["thermocouple"][kept])


def test_wide_median_clips_turning_points(heated: KilnData) -> None:
    """Note to claim S2: a median wide enough for all spikes costs more than they did."""
    worst = []
    for r in heated.tests:
        true, high = r["true_thermocouple"], r["thermocouple"]
        wide = median_filter(high, 601, mode="mirror")
        slope = without_spikes(r["t"], high).values
        assert rms(wide - true) > 5.0 * rms(slope - true)
        worst.append(np.abs(wide - true).max())
    assert max(worst) > 5.0


def test_model_predicts_new_profiles(kiln_runs: KilnRuns) -> None:
    """Claim S2, Figure 5.9: under 3 % of stroke on minor loops; here under 1 %."""
    assert len(kiln_runs.predictions) == 3
    assert max(p.share for p in kiln_runs.predictions) < 0.01


@pytest.mark.slow
def test_median_in_place_of_smoothing_spoils_the_prediction(
    heated: KilnData, kiln_runs: KilnRuns
) -> None:
    """Note to claim S2: 7-11 % of stroke with a wide median, on table and profiles alike."""
    runs = [_with_median(r, 601) for r in (heated.curves, *heated.tests)]
    table = fod_table(runs[:1])
    errors = [predict(table, r).share for r in runs[1:]]
    assert min(errors) > 5.0 * max(p.share for p in kiln_runs.predictions)


def _with_median(r: Recording, samples: int) -> Recording:
    arrays = [r[c.name] for c in r.columns]
    index = [c.name for c in r.columns].index("thermocouple")
    arrays[index] = median_filter(r["thermocouple"], samples, mode="mirror")
    return Recording.from_arrays(r.columns, arrays, r.dt, {})


def test_full_contraction(kiln_runs: KilnRuns) -> None:
    """Claim S6: 107.5 +-1.5 degC, where the branch is within 5 % of its end. At the very end
    the thermocouple on the top plate, hotter than the wires, reads up to 1.7 K more than 107.5."""
    assert full_contraction(kiln_runs.table) == pytest.approx(107.5, abs=1.5)
    assert full_contraction(kiln_runs.table, within=0.01) == pytest.approx(107.5, abs=2.0)


@pytest.mark.parametrize("turns", [[], [20.0], [60.0, 70.0], [60.0, 40.0, 35.0], [np.nan]])
def test_profiles_that_do_not_turn_are_refused(turns: list[float]) -> None:
    with pytest.raises(InputError, match="up and down in turn"):
        kiln.run(fixture.prepare(KilnBench()), turns)


def test_unreachable_temperature_is_told() -> None:
    with pytest.raises(InputError, match=r"turns\[0\]"):
        kiln.run(fixture.prepare(KilnBench()), [250.0])


def in_room(ambient: float) -> Fixture:
    """A rig whose kiln stands in a room of so many degC."""
    plain = fixture.prepare(KilnBench())
    plant = plain._replace(oven=plain.oven._replace(ambient=ambient))
    return Fixture(
        "a kiln", KILN, lambda seed: KilnTwin(plant, seed), ("thermocouple", "encoder"), KILN_PERIOD
    )


def test_a_rig_s_thermocouple_shows_its_room_before_it_is_heated() -> None:
    assert kiln.coldest(in_room(25.0), 1) == kiln.COLD
    assert kiln.coldest(in_room(34.0), 1) == pytest.approx(34.0 + kiln.COOLED, abs=0.3)
    with pytest.raises(InputError, match=r"a kiln, thermocouple.*5\d\.\d degC before.*Let it cool"):
        kiln.coldest(in_room(55.0))
    silent = in_room(25.0)._replace(make=lambda seed: Silent())
    with pytest.raises(InputError, match="nan degC"):
        kiln.coldest(silent)


class Silent(KilnTwin):
    """A kiln whose thermocouple gives no value."""

    def __init__(self) -> None:
        super().__init__(fixture.prepare(KilnBench()), 0)

    def read(self) -> KilnSample:
        return super().read()._replace(thermocouple=np.nan)


def test_in_a_warm_room_it_cools_to_a_little_above_it() -> None:
    """Nothing cools below the room: profiles that end at 31 degC would not end at 34 degC."""
    plain = fixture.prepare(KilnBench())
    warm = plain._replace(oven=plain.oven._replace(ambient=34.0))
    assert kiln.coldest(plain) == kiln.COLD and kiln.coldest(warm) == 36.0
    cold = kiln.coldest(warm)
    record = kiln.run(warm, kiln.cycles((114.0, 104.0, 96.0, 88.0), cold), seed=1)
    assert record["thermocouple"][-1] == pytest.approx(cold, abs=1.5)
    assert fod_table([record], nodes=41).span > 3.0  # mm, of all its curves
    assert all(low >= cold for turns in kiln.profiles(cold) for low in turns)
