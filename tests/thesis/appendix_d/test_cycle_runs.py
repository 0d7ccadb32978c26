"""Cycle testing of the actuator alone (Appendix D)."""

from __future__ import annotations

import numpy as np
import pytest
from tests.thesis.ended import collected, ended
from tests.thesis.fixture_drives import CycleTwin

from macromicro.rig.fixtures import CYCLE_PERIOD
from macromicro.rig.session import CYCLE, Fixture
from macromicro.thesis import cycle_bench
from macromicro.thesis.appendix_d import cycle_testing
from macromicro.thesis.appendix_d.cycle_testing import CycleData, Cycles
from macromicro.thesis.claims import DIFFERS, REPRODUCED, Claim
from macromicro.thesis.cycle_bench import CycleBench

TWIN = cycle_bench.prepare(CycleBench())


@pytest.fixture(scope="module")
def data() -> CycleData:
    made: CycleData = collected("cycle-testing")
    return made


@pytest.fixture(scope="module")
def claims() -> dict[str, Claim]:
    return {c.id: c for c in ended("cycle-testing").claims}


@pytest.mark.parametrize("name", ["A1", "A2", "A4", "A5", "A6"])
@pytest.mark.slow
def test_claim_is_reproduced(claims: dict[str, Claim], name: str) -> None:
    assert claims[name].verdict == REPRODUCED


@pytest.mark.slow
def test_a3_is_slower_than_printed_and_says_why(claims: dict[str, Claim]) -> None:
    assert claims["A3"].verdict == DIFFERS and claims["A3"].reason


@pytest.mark.parametrize(
    ("name", "low", "high"), [("A1", 0.18, 0.30), ("A2", 0.14, 0.24), ("A3", 1.0, 1.45)]
)
@pytest.mark.slow
def test_settled_time(claims: dict[str, Claim], name: str, low: float, high: float) -> None:
    measured = claims[name].measured
    assert isinstance(measured, float)
    assert low <= measured <= high


@pytest.mark.slow
def test_rig_gives_what_the_compiled_run_gives() -> None:
    """The same law drives the twin sample by sample: the same counts."""
    fast = cycle_testing.cycling_runs(TWIN, runs=1, cycles=2, room_std=0.0, rest_s=0.0)
    channels = ("encoder",)
    rig = Fixture("a cycle bench", CYCLE, lambda seed: CycleTwin(TWIN), channels, CYCLE_PERIOD)
    slow = cycle_testing.cycling_runs(rig, runs=2, cycles=2, rest_s=0.5)
    np.testing.assert_array_equal(slow.counts[0], fast.counts[0])
    np.testing.assert_array_equal(slow.literal, fast.literal)
    np.testing.assert_array_equal(slow.unlimited, fast.unlimited)
    # Half a second is no rest: the second run begins warm. The room was not measured.
    assert not np.array_equal(slow.counts[1], slow.counts[0])
    assert np.isnan(slow.room).all()


@pytest.mark.slow
def test_pid_without_conditional_integration_drifts(data: CycleData) -> None:
    """Erratum to Appendix D: the integral drifts; after one overshoot 149 are not reached."""
    found = cycle_testing.measure(data.unlimited)
    assert data.unlimited.max() > 170.0
    assert np.isfinite(found.tau1[0])
    assert np.isnan(found.tau1[1:]).all()


@pytest.mark.slow
def test_derivative_per_second_is_too_slow(data: CycleData) -> None:
    """Erratum to Appendix D: Kd de/Ts cannot reach tau1 = 0.23 s; over 0.34 s."""
    assert np.nanmin(cycle_testing.measure(data.literal).tau1) > 0.34


@pytest.mark.parametrize("reading", ["literal", "unlimited"])
@pytest.mark.slow
def test_other_readings_fail_the_claims(data: CycleData, reading: str) -> None:
    """The verdicts come from the recordings."""
    counts = np.tile(getattr(data, reading), (len(data.counts), 1))
    found = {c.id: c for c in cycle_testing.claims(data._replace(counts=counts))}
    assert found["A1"].verdict == DIFFERS


@pytest.mark.slow
def test_half_an_hour_is_enough_and_ten_seconds_are_not() -> None:
    """Claim A6: in a room of one temperature, a rested run repeats the one before."""
    rested = cycle_testing.cycling_runs(TWIN, runs=2, cycles=4, room_std=0.0)
    np.testing.assert_array_equal(rested.counts[0], rested.counts[1])
    hurried = cycle_testing.cycling_runs(TWIN, runs=2, cycles=4, room_std=0.0, rest_s=10.0)
    first, second = (cycle_testing.measure(c) for c in hurried.counts)
    assert second.fall[0] > first.fall[0] + 0.02


def test_times_and_shares_of_a_known_cycle() -> None:
    """149 counts after 0.3 s, 0 until 0.1 s; back at 0 after 1.2 s; 150 half of the time."""
    part = np.zeros(4000)
    part[101:300] = 100.0
    part[300:400] = 149.0
    part[400:2050] = np.where(np.arange(1650) % 2 == 0, 150.0, 151.0)
    part[2050:3200] = 80.0
    found = Cycles(*(float(v[0]) for v in cycle_testing.measure(part)))
    assert found.tau1 == pytest.approx(0.3)
    assert found.tau2 == pytest.approx(0.2)
    assert found.fall == pytest.approx(1.2)
    assert (found.first, found.last) == (50.0, 50.0)


def test_an_output_that_stays_down_is_not_measured() -> None:
    found = cycle_testing.measure(np.zeros(4000))
    assert np.isnan(found.tau1[0]) and np.isnan(found.first[0])


def test_run_trend_allows_for_the_room() -> None:
    room = np.array([22.5, 23.5, 22.8, 23.9, 23.0, 22.2, 23.3])
    noise = 1e-4 * np.array([1.0, -1.0, 2.0, -2.0, 1.0, -2.0, 1.0])
    flat = cycle_testing.run_trend(1.5 + 0.03 * (room - 23.0) + noise, room)
    assert abs(flat.slope) <= flat.reach < 1e-3
    rising = cycle_testing.run_trend(1.5 + 0.005 * np.arange(7) + noise, room)
    assert rising.slope == pytest.approx(0.005, abs=2e-4)
    assert rising.slope > rising.reach
