"""Steps sorted by voltage, their mean, and how they cool."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.identify.kinds.seen import degrees

from macromicro.errors import InputError
from macromicro.hysteresis import FodTable
from macromicro.identify.heating import StepRecord
from macromicro.identify.kinds import thermal
from macromicro.identify.kinds.thermal import Source
from macromicro.identify.notices import DataWarning
from macromicro.identify.picking import Picked
from macromicro.identify.runs import Run

DT = 0.1
MEASURED = Source(None, None)


def picked(*parts: tuple[np.ndarray, np.ndarray], role: str = "T") -> Picked:
    """Runs of (u, x) in one file."""
    u, x = (np.concatenate([p[k] for p in parts]) for k in (0, 1))
    t = np.concatenate([np.arange(len(p[0])) * DT for p in parts])
    run = np.concatenate([np.full(len(p[0]), float(k)) for k, p in enumerate(parts)])
    values = {"t": t, "u": u, role: x, "run": run}
    return Picked("f.csv", values, {}, {}, {})


def step(volts: float, n: int = 60, before: int = 0, after: int = 0) -> tuple[np.ndarray, ...]:
    """A voltage held for n samples, 0 V before and after, and a ramp as output."""
    u = np.r_[np.zeros(before), np.full(n, volts), np.zeros(after)]
    return u, 20.0 + 0.01 * np.arange(len(u))


def test_steps_are_sorted_by_voltage_and_begin_where_it_does() -> None:
    with pytest.warns(DataWarning, match=r"^3 runs are no steps .a constant voltage from a cold"):
        found = thermal.steps(
            [
                picked(step(2.0, before=7), step(1.0), step(2.0 + 1e-11)),
                picked(
                    step(3.0, n=40, after=20),
                    step(-1.0),  # no heating
                    step(1.0, n=49, before=20),  # 49 samples from the step on
                    (np.r_[np.full(40, 1.0), np.full(40, 2.0)], np.arange(80.0)),
                    step(1.0, n=50, before=20),
                ),
            ],
            "T",
        )
    assert sorted(found.held) == [1.0, 2.0, 3.0] and list(found.cooled) == [3.0]
    assert [len(found.held[v]) for v in (1.0, 2.0)] == [2, 2]
    first = found.held[2.0][0]
    assert len(first.t) == 60 and first.t[0] == 0.0
    assert first.t[-1] == pytest.approx(5.9) and first.x[0] == pytest.approx(20.07)
    np.testing.assert_array_equal(first.u, 2.0)
    # Without a run that stays, the rise before the fall is the step.
    rise = found.held[3.0][0]
    assert len(rise.t) == len(rise.u) == len(rise.x) == 40 and rise.u[-1] == 3.0
    fall = found.cooled[3.0][0]
    assert len(fall.t) == 60 and fall.u[39] == 3.0 and fall.u[40] == 0.0


def test_a_run_that_stays_is_not_replaced_by_one_that_falls() -> None:
    found = thermal.steps([picked(step(2.0, 70), step(2.0, 40, after=30))], "T")
    assert [len(r.t) for r in found.held[2.0]] == [70]
    assert [len(r.t) for r in found.cooled[2.0]] == [70]


def test_positions_are_taken_by_their_role() -> None:
    found = thermal.steps([picked(step(2.0), role="x")], "x")
    assert found.held[2.0][0].x[0] == 20.0


def test_no_step_and_short_runs_are_refused() -> None:
    with (
        pytest.warns(DataWarning, match="1 runs"),
        pytest.raises(
            InputError, match=r"f\.csv: no run steps to a voltage .*open-loop steps from cold"
        ),
    ):
        thermal.steps([picked(step(-2.0))], "T")
    with pytest.raises(InputError, match=r"f\.csv.*49.*50"):
        thermal.steps([picked(step(2.0, 49))], "T")


def run(x: np.ndarray, dt: float = DT, u: np.ndarray | float = 2.0) -> Run:
    t = np.arange(len(x)) * dt
    return Run(t, np.broadcast_to(np.asarray(u, np.float64), t.shape), np.asarray(x, np.float64))


def test_the_mean_of_runs_alike_is_the_record() -> None:
    x = 20.0 + np.arange(100.0)
    group = [run(x), run(x[:95] + 2.0), run(x[:80] + 50.0), run(x + 90.0, 1.01 * DT)]
    made = thermal.record(group, MEASURED)
    assert len(made.t) == 95 and made.t[-1] == pytest.approx(9.4)
    np.testing.assert_allclose(made.position, x[:95] + 1.0)
    np.testing.assert_allclose(made.rise, np.arange(95.0))  # from the mean of both starts
    np.testing.assert_array_equal(made.error, 0.0)
    warm = thermal.record(group, Source(None, 15.0))
    np.testing.assert_allclose(warm.rise, x[:95] + 1.0 - 15.0)


def test_the_room_is_what_was_measured_before_the_step() -> None:
    """With the error of that mean, by how single samples of the record scatter."""
    noise = 0.2 * np.random.default_rng(3).standard_normal(4100)
    u = np.r_[np.zeros(99), np.full(4001, 2.0)]
    x = np.where(u > 0.0, 50.0, 20.0) + noise
    x[99] = 20.0 + noise[99]  # measured when the step begins
    found = thermal.steps([picked((u, x))], "T")
    (cold,) = found.cold[2.0]
    assert cold.samples == 100 and cold.mean == pytest.approx(x[:100].mean())
    made = thermal.record(found.held[2.0], MEASURED, found.cold[2.0])
    np.testing.assert_allclose(made.rise, x[99:] - x[:100].mean())
    np.testing.assert_allclose(made.error, 0.02, rtol=0.05)
    alone = thermal.record(found.held[2.0], MEASURED)
    np.testing.assert_allclose(alone.rise, x[99:] - x[99])
    np.testing.assert_allclose(alone.error, 0.2, rtol=0.05)
    known = thermal.record(found.held[2.0], Source(None, 21.0), found.cold[2.0])
    np.testing.assert_array_equal(known.error, 0.0)
    two = [thermal.Cold(20.0, 100), thermal.Cold(22.0, 25)]
    both = thermal.record([found.held[2.0][0]] * 2, MEASURED, two)
    np.testing.assert_allclose(both.rise, x[99:] - 21.0)
    np.testing.assert_allclose(both.error, 0.2 * math.sqrt(0.5 * (0.01 + 0.04)), rtol=0.05)


def test_a_fall_goes_to_what_was_measured_before_the_step() -> None:
    t = np.arange(600) * DT
    u = np.where(t < 10.0, 2.0, 0.0)
    x = 20.0 + np.where(t < 10.0, 40.0, 40.0 * np.exp(-(t - 10.0) / 5.0))
    fall = thermal.fall([run(x, u=u)], MEASURED, [thermal.Cold(20.0, 50)])
    assert 5.0 <= fall.time < 5.0 + 1.5 * DT  # the first sample below
    warm = thermal.fall([run(x, u=u)], MEASURED, [thermal.Cold(30.0, 50)])  # 63 % of 30 K
    assert warm.time == pytest.approx(5.0 * math.log(40.0 / (10.0 + 30.0 / math.e)), abs=2.0 * DT)


def test_nine_tenths_of_the_longest_are_too_short() -> None:
    group = [run(np.zeros(101)), run(np.ones(91)), run(np.ones(92))]
    np.testing.assert_allclose(thermal.record(group, MEASURED).position, 0.5)
    group = [run(np.zeros(101)), run(np.ones(91))]
    np.testing.assert_allclose(thermal.record(group, MEASURED).position, 0.0)
    near = [run(np.zeros(101)), run(np.ones(101), DT * 1.0005)]
    np.testing.assert_allclose(thermal.record(near, MEASURED).position, 0.5)


@pytest.fixture(scope="module")
def law() -> FodTable:
    return degrees()


def test_positions_become_temperatures_by_the_table(law: FodTable) -> None:
    u = np.linspace(25.0, 40.0, 200)
    made = thermal.record([run(0.1 * (u - 20.0))], Source(law, None))
    good = np.isfinite(made.error)
    assert good.sum() > 100
    np.testing.assert_allclose(made.rise[good], u[good] - 25.0, atol=0.8)
    cooler = thermal.record([run(0.1 * (u - 20.0))], Source(law, 22.0))
    np.testing.assert_allclose(cooler.rise[good] - made.rise[good], 3.0, atol=0.8)
    np.testing.assert_allclose(made.position, 0.1 * (u - 20.0), atol=1e-6)  # mm


def test_a_position_near_the_stop_shows_no_temperature(law: FodTable) -> None:
    source = Source(law, None)
    none = np.zeros(3)

    def at(share: float) -> StepRecord:
        x = law.f_low + share * law.span * np.array([0.1, 1.0, 0.5])
        return StepRecord(none, x, none, none)

    assert thermal.NEAR_STOP == 0.97
    assert thermal.clear_of_stop(at(0.969), source)
    assert not thermal.clear_of_stop(at(0.971), source)
    assert thermal.clear_of_stop(at(5.0), MEASURED)


def test_drift_is_the_change_over_the_last_tenth() -> None:
    t = np.arange(101.0) + 5.0
    rise = np.where(t >= 95.0, 10.0 + 0.2 * (t - 95.0), 0.0)  # 11 samples, 10 to 12 K
    made = StepRecord(t, rise, rise, rise)
    # Its first and last two samples: 10.1 and 11.9 K of 12 K.
    assert thermal.drift(made) == pytest.approx(1.8 / 12.0)
    assert thermal.drift(made._replace(rise=-rise)) == pytest.approx(-1.8 / 12.0)
    t = np.arange(92.0)
    assert thermal.drift(StepRecord(t, t, t + 0.0, t)) == pytest.approx((90.5 - 82.5) / 91.0)
    assert math.isnan(thermal.drift(StepRecord(t[:90], t, t[:90], t)))
    assert thermal.drift(StepRecord(t, t, 0.0 * t, t)) == 0.0


def cooled(tau: float, n: int = 200, before: int = 30) -> Run:
    """From 80 degC to 20 degC."""
    t = np.arange(n) * DT
    start = np.r_[20.0, np.full(before - 1, 80.0)]  # the first sample is cold
    x = np.r_[start, 20.0 + 60.0 * np.exp(-t / tau)]
    u = np.r_[np.full(before, 2.0), np.zeros(n)]
    return run(x, u=u)


def test_a_fall_gives_its_time_constant() -> None:
    found = thermal.fall([cooled(3.0), cooled(3.0)], MEASURED)
    assert found.time == pytest.approx(3.0)  # the sample at which 1/e is reached
    assert found.fitted == pytest.approx(3.0, rel=1e-5)
    assert found.peak == pytest.approx(80.0) and found.nrmse < 1e-6
    # By a lower ambient temperature the fall seems longer: exp(-t / 3) = ((70 / e) - 10) / 60.
    other = thermal.fall([cooled(3.0)], Source(None, 10.0))
    assert other.time == pytest.approx(math.ceil(-30.0 * math.log((70 / math.e - 10) / 60)) * DT)
    assert other.fitted > 3.1 and other.nrmse > 1e-3


def test_the_peak_is_the_mean_of_the_last_five_samples_before_the_fall() -> None:
    one = cooled(3.0)
    one.x[20:25] = 500.0
    one.x[25:30] = [78.0, 79.0, 80.0, 81.0, 82.0]
    assert thermal.fall([one], MEASURED).peak == pytest.approx(80.0)
    early = cooled(3.0, before=4)
    assert thermal.fall([early], MEASURED).peak == pytest.approx(65.0)  # 20 and three of 80


def test_nrmse_is_of_the_range_that_was_fitted() -> None:
    one = cooled(3.0)
    t = np.arange(200) * DT
    one.x[30:] = 20.0 + 60.0 * np.maximum(1.0 - t / 5.0, 0.0)
    found = thermal.fall([one], MEASURED)
    last = int(np.argmax(1.0 - t / 5.0 <= math.exp(-1.0))) + 1
    model = 60.0 * np.exp(-t[:last] / found.fitted)
    rest = model - 60.0 * (1.0 - t[:last] / 5.0)
    assert found.time == pytest.approx(t[last - 1])
    assert found.nrmse == pytest.approx(
        np.sqrt(np.mean(rest**2)) / (60.0 * t[last - 1] / 5.0), rel=1e-6
    )
    # Least squares: no other time constant is nearer.
    for other in (0.99, 1.01):
        off = 60.0 * np.exp(-t[:last] / (other * found.fitted)) - (
            rest * 0 + 60 * (1 - t[:last] / 5)
        )
        assert np.mean(off**2) > np.mean(rest**2)


@pytest.mark.parametrize("tau", [60.0, 0.3])
def test_a_fall_that_ends_too_early_or_is_too_quick_is_refused(tau: float) -> None:
    with pytest.raises(InputError, match=r"cooling record: it falls from 80 to .* 63 % of the way"):
        thermal.fall([cooled(tau)], MEASURED)


def test_five_samples_of_a_fall_are_enough() -> None:
    assert thermal.fall([cooled(0.45)], MEASURED).time == pytest.approx(0.5)


def test_falls_of_two_lengths_are_averaged_over_the_shorter() -> None:
    one = cooled(3.0)
    short = Run(*(column[:-5] for column in one))
    assert thermal.fall([one, short], MEASURED).time == thermal.fall([one], MEASURED).time


def test_no_fall_from_below_ambient() -> None:
    with pytest.raises(InputError, match="cooling record"):
        thermal.fall([cooled(3.0)], Source(None, 90.0))


def test_a_position_s_fall_by_the_table(law: FodTable) -> None:
    t = np.arange(300) * 0.02
    u = np.r_[np.linspace(25.0, 45.0, 300), np.full(200, 45.0), 25.0 + 20.0 * np.exp(-t)]
    volts = np.r_[np.full(500, 2.0), np.zeros(300)]
    one = run(0.1 * (u - 20.0), 0.02, volts)
    found = thermal.fall([one], Source(law, None))
    assert found.time == pytest.approx(1.0, abs=0.15)
    assert thermal.fall([one], Source(law, 20.0)).time > found.time + 0.1


def test_a_dip_at_once_is_no_fall() -> None:
    one = cooled(3.0)
    one.x[33] = 20.0
    with pytest.raises(InputError, match="cooling record"):
        thermal.fall([one], MEASURED)


def test_a_voltage_of_one_sample_is_a_fall() -> None:
    assert list(thermal.steps([picked(step(2.0, 1, after=60))], "T").cooled) == [2.0]
