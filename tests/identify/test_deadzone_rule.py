"""The rule behind a dead zone, trial by trial: pauses, the lowest voltage, the map of speeds."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.identify import dead_zone, discontinuous_dead_zone
from macromicro.identify.deadzone import Trial, _lowest, _side, _trial, _under_way, constant
from macromicro.identify.notices import DataWarning
from macromicro.identify.runs import Run

DT = 0.01


def run(x: list[float], volts: float = 3.0) -> Run:
    """Counts, one a hundredth of a second."""
    return Run(np.arange(len(x)) * DT, np.full(len(x), volts), np.array(x, float))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_motion_counts_up_to_the_first_sample_at_the_end_of_the_travel(sign: float) -> None:
    x = [sign * v for v in (0.0, 4.0, 9.0, 10.0, 10.0, 12.0)]
    low, high = sorted((0.0, sign * 10.0))
    assert _under_way(run(x, sign), low, high) == 4
    assert _under_way(run(x[:3], sign), low, high) == 3


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("x", "pause"),
    [
        ([0, 1, 2, 3, 4], 1),  # counts in every sample
        ([0, 0, 0, 1, 2], 3),  # it starts late
        ([0, 1, 1, 1, 1], 3),  # and stops: from its last new count to the end
        ([0, 1, 1, 2, 2, 2, 3], 3),
        ([0, 2, 1, 2, 3], 3),  # back and to where it was is nothing new
    ],
)
def test_a_pause_is_the_longest_time_without_a_new_count(
    sign: float, x: list[float], pause: int
) -> None:
    made = run([sign * v for v in x], sign * 3.0)
    for allowed, uninterrupted in ((pause * DT, True), (pause * DT - 1e-6, False)):
        found = _trial(made, len(x), allowed + 1e-12, (-99.0, 99.0))
        assert found.pause == pytest.approx(pause * DT)
        assert found.uninterrupted == uninterrupted and not found.arrived
    assert (found.volts, found.start, found.end) == (sign * 3.0, sign * x[0], sign * x[-1])


def test_what_even_the_quickest_run_waits_is_no_pause() -> None:
    """The rig's own delay: 0.3 s behind the step; a run that hesitates 0.2 s longer pauses."""
    late = [0.0] * 30
    quick, slow = (
        late + [float(k) for k in range(40)],
        late + [0.0] * 20 + [float(k) for k in range(40)],
    )
    runs = [run(quick, 3.0), run(slow, 2.0), run([-x for x in quick], -3.0)]
    found = dead_zone([tuple(r) for r in runs], pause=0.05)
    assert [t.pause for t in found.trials] == pytest.approx([0.01, 0.21, 0.01], abs=0.011)
    assert (found.positive, found.negative) == (3.0, 3.0)
    assert dead_zone([tuple(r) for r in runs], pause=0.25).positive == 2.0


def test_a_run_that_begins_at_the_end_of_the_travel_has_no_pause() -> None:
    found = _trial(run([10.0, 10.0, 10.0]), 1, 0.05, (0.0, 10.0))
    assert (found.pause, found.uninterrupted, found.arrived) == (0.0, True, True)


@pytest.mark.parametrize(
    ("volts", "end", "arrived"),
    [(3.0, 10.0, True), (3.0, 9.0, False), (-3.0, 0.0, True), (-3.0, 1.0, False)],
)
def test_a_run_arrives_at_the_end_of_its_own_direction(
    volts: float, end: float, arrived: bool
) -> None:
    assert _trial(run([5.0, end], volts), 2, 0.05, (0.0, 10.0)).arrived == arrived


def trial(volts: float, good: bool, arrived: bool = True) -> Trial:
    return Trial(volts, 0.0, 10.0, 0.0, good, arrived)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_voltage_passes_where_it_and_every_higher_one_did(sign: float) -> None:
    """In its direction. One bad trial of several is enough; a lucky low one changes nothing."""
    found = [trial(sign * 2.0, True), trial(sign * 2.5, True), trial(sign * 2.5, False)]
    found += [trial(sign * 3.0, True), trial(sign * 3.5, True), trial(-sign * 9.0, False)]
    assert _lowest(found, sign) == 3.0
    with pytest.raises(InputError, match=f"interrupted even at {-9.0 * sign:g} V"):
        _lowest(found, -sign)


def test_the_lowest_voltage_tried_is_only_a_bound() -> None:
    with pytest.warns(DataWarning, match="lowest voltage tried, -3 V.*at most this"):
        assert _lowest([trial(-3.0, True), trial(-3.5, True)], -1.0) == 3.0


def test_runs_that_ended_early_at_the_voltage_found_are_counted() -> None:
    found = [trial(2.0, False), trial(3.0, True, False), trial(3.0, True), trial(3.0, True, False)]
    with pytest.warns(DataWarning, match="2 runs at 3 V ended before"):
        assert _lowest([*found, trial(4.0, True, False)], 1.0) == 3.0


def test_the_map_is_net_travel_over_time_in_each_place() -> None:
    """Of all runs at a voltage; a place that was not visited has no speed."""
    x = np.r_[np.arange(0.0, 20.0, 1.0), np.arange(20.0, 41.0, 0.5)]  # 100, then 50 count/s
    forth = (np.arange(len(x)) * DT, np.full(len(x), 3.0), x)
    back = (np.arange(41) * DT, np.full(41, -4.0), np.arange(40.0, -1.0, -1.0))
    half = (np.arange(21) * DT, np.full(21, 2.0), np.arange(0.0, 21.0))
    with pytest.warns(DataWarning):
        zone = dead_zone([forth, back, half], travel=(0.0, 40.0), bins=4)
    assert zone.volts.tolist() == [-4.0, 2.0, 3.0]
    assert zone.places.tolist() == [5.0, 15.0, 25.0, 35.0]
    np.testing.assert_allclose(zone.speeds[2], [100.0, 100.0, 50.0, 50.0])
    np.testing.assert_allclose(zone.speeds[0], [-100.0, -100.0, -100.0, -100.0])
    np.testing.assert_allclose(zone.speeds[1, :2], 100.0)
    assert np.isnan(zone.speeds[1, 3])


def test_without_a_travel_it_is_what_all_runs_cover_together() -> None:
    low = (np.arange(31) * DT, np.full(31, 3.0), np.arange(5.0, 36.0))
    high = (np.arange(31) * DT, np.full(31, -3.0), np.arange(40.0, 9.0, -1.0))
    with pytest.warns(DataWarning):
        zone = dead_zone([low, high], bins=5)
    np.testing.assert_allclose(zone.places, np.arange(5.0, 41.0, 7.0)[:-1] + 3.5)
    with pytest.raises(InputError, match="travel"):
        dead_zone([low, high], travel=(30.0, 30.0))


def test_a_voltage_that_is_zero_or_changes_is_refused() -> None:
    t, x = np.arange(30) * DT, np.arange(30.0)
    for u in (np.zeros(30), np.r_[np.full(29, 3.0), 3.00001]):
        with pytest.raises(InputError, match=r"recordings\[0\].u.*one constant voltage"):
            dead_zone([(t, u, x)])
    with pytest.raises(InputError, match="no run at a positive voltage"):
        dead_zone([(t, np.full(30, -3.0), -x)])


def test_the_line_through_steady_states_has_the_errors_of_least_squares() -> None:
    """Runs of one voltage averaged; by the formulas for a straight line."""
    points = [(0.1, 400.0), (0.1, 440.0), (0.5, 700.0), (1.0, 1010.0), (2.0, 1590.0)]
    found = _side(points, 1000.0, "+")
    x, y = np.array([0.1, 0.5, 1.0, 2.0]), np.array([0.42, 0.7, 1.01, 1.59])
    delta = ((x - x.mean()) * (y - y.mean())).sum() / ((x - x.mean()) ** 2).sum()
    a0 = y.mean() - delta * x.mean()
    missed = y - a0 - delta * x
    spread = math.sqrt(float(missed @ missed) / 2.0)
    sxx = float(((x - x.mean()) ** 2).sum())
    assert (found.a0, found.delta) == (pytest.approx(a0), pytest.approx(delta))
    assert found.delta_std == pytest.approx(spread / math.sqrt(sxx))
    assert found.a0_std == pytest.approx(spread * math.sqrt(0.25 + x.mean() ** 2 / sxx))
    assert found.volts.tolist() == x.tolist()
    np.testing.assert_allclose(found.speeds, 1000.0 * y)
    two = _side(points[:3], 1000.0, "+")
    assert math.isnan(two.a0_std) and math.isnan(two.delta_std)
    with pytest.raises(InputError, match="1 of at least two voltages were found in direction -"):
        _side(points[:2], 1000.0, "-")


@pytest.mark.parametrize("share", [0.25, 0.5, 1.0])
def test_the_speed_is_the_slope_of_a_runs_last_part(share: float) -> None:
    """Faster at first by a parabola, whose slope over a stretch is that of its middle."""
    t = np.arange(1001) * 1e-3
    x = 1000.0 * t - 200.0 * t * t
    runs = [(t, np.full(1001, s * v), s * x) for s in (1.0, -1.0) for v in (3.5, 4.0)]
    zone = discontinuous_dead_zone(runs, 1000.0, 3.0, steady=share)
    middle = 1.0 - 0.5 * share
    wanted = 1000.0 - 400.0 * middle
    for side in (zone.positive, zone.negative, zone.both):
        np.testing.assert_allclose(side.speeds, wanted, rtol=1e-3)
        assert side.volts.tolist() == [0.5, 1.0]
    assert (zone.width, zone.gain) == (3.0, 1000.0)


@pytest.mark.parametrize(("gain", "steady"), [(0.0, 0.5), (-1.0, 0.5), (1.0, 0.0), (1.0, 1.01)])
def test_impossible_options_are_refused(gain: float, steady: float) -> None:
    with pytest.raises(InputError, match="gain" if gain <= 0.0 else "steady"):
        discontinuous_dead_zone([], gain, 3.0, steady=steady)


def test_exactly_the_dead_zone_is_not_beyond_it() -> None:
    t = np.arange(30) * DT
    runs = [(t, np.full(30, s * v), s * t) for s in (1.0, -1.0) for v in (3.0, 4.0)]
    with pytest.raises(InputError, match=r"recordings\[0\].u.*beyond \+-3 V"):
        discontinuous_dead_zone(runs, 1.0, 3.0)


@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_a_voltage_is_constant_to_a_billionth_whatever_its_unit(unit: float) -> None:
    def held(volts: float, by: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        t = np.arange(30) * DT
        return t, volts * (1.0 + by * (np.arange(30) == 7)), math.copysign(1.0, volts) * t

    assert len(constant([held(3.0 * unit, 5e-10), held(-3.0 * unit, 5e-10)])) == 2
    with pytest.raises(InputError, match=r"recordings\[1\].u.*one constant voltage"):
        constant([held(3.0 * unit, 0.0), held(-3.0 * unit, 2e-9)])
