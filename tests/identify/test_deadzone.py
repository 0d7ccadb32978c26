"""Dead zone (Section 4.2.3, Figure 4.8) and its discontinuous extension (4.5)."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.errors import InputError
from macromicro.identify import dead_zone, discontinuous_dead_zone
from macromicro.identify.notices import DataWarning

T = np.arange(5000) * 1e-3
TRAVEL = (0.0, 1000.0)


def crept(volts: float, start: float, high: float = 2.9, place: float = 500.0) -> tuple:
    """Counts of an axis that needs 2.5 V, but `high` V to pass `place`."""
    sign = np.sign(volts)
    x = start + sign * 2000.0 * max(abs(volts) - 2.5, 0.0) * T
    stuck = abs(volts) < high
    if stuck and sign > 0 and start < place:
        x = np.minimum(x, place)
    if stuck and sign < 0 and start > place:
        x = np.maximum(x, place)
    return T, np.full(5000, volts), np.clip(np.floor(x), -5.0, 1005.0)


VOLTS = (2.4, 2.6, 2.8, 3.0, 3.2)


def trials() -> list[tuple]:
    runs = [crept(v, x) for v in VOLTS for x in (0.0, 300.0, 600.0)]
    return runs + [crept(-v, 1000.0 - x, high=3.1) for v in VOLTS for x in (0.0, 300.0, 600.0)]


def test_lowest_voltage_with_uninterrupted_motion_in_each_direction() -> None:
    """The greatest friction on the way decides, and each direction has its own (M1)."""
    zone = dead_zone(trials(), travel=TRAVEL)
    assert (zone.positive, zone.negative, zone.width) == (3.0, 3.2, 3.2)
    starts, lowest = zone.thresholds(1)
    np.testing.assert_array_equal(starts, [0.0, 300.0, 600.0])
    np.testing.assert_array_equal(lowest, [3.0, 3.0, 2.6])


def test_speed_map_shows_where_the_carriage_waited() -> None:
    """Figure 4.8: little motion where friction is greater."""
    zone = dead_zone(trials(), travel=TRAVEL, bins=10)
    row = zone.speeds[np.searchsorted(zone.volts, 2.8)]
    sticky = int(np.argmin(np.abs(zone.places - 500.0) + (zone.places < 500.0)))
    free = [row[k] for k in range(1, 9) if k not in (sticky - 1, sticky)]
    np.testing.assert_allclose(free, 600.0, rtol=0.05)
    assert row[sticky] < 300.0
    assert np.isnan(zone.speeds[np.searchsorted(zone.volts, 2.4)][5])


def test_a_start_that_never_moves_is_an_interruption() -> None:
    zone = dead_zone(trials(), travel=TRAVEL)
    still = [t for t in zone.trials if abs(t.volts) == 2.4]
    assert not any(t.uninterrupted for t in still)
    assert min(t.pause for t in still) > 0.9


def test_dead_zone_that_was_not_bracketed() -> None:
    low = [r for r in trials() if abs(r[1][0]) < 3.1]
    with pytest.raises(InputError, match="interrupted even at -3 V"):
        dead_zone(low, travel=TRAVEL)
    high = [r for r in trials() if abs(r[1][0]) > 3.1]
    with pytest.warns(DataWarning, match="at most this"):
        assert dead_zone(high, travel=TRAVEL).width == 3.2


def test_runs_that_end_too_early_are_said() -> None:
    cut = [tuple(a[:500] for a in r) for r in trials()]
    with pytest.warns(DataWarning, match="before the end of the travel"):
        dead_zone(cut, travel=TRAVEL)


def test_one_direction_or_changing_voltage_is_refused() -> None:
    with pytest.raises(InputError, match="no run at a negative voltage"):
        dead_zone(trials()[:15])
    t, u, x = trials()[0]
    with pytest.raises(InputError, match="one constant voltage"):
        dead_zone([(t, u * np.linspace(1, 2, 5000), x)])


def steady(volts: float, a0: float, delta: float, gain: float) -> tuple:
    speed = gain * (a0 + delta * (abs(volts) - 3.0))
    return T, np.full(5000, volts), np.sign(volts) * speed * (T - 0.02 * (1 - np.exp(-T / 0.02)))


def test_thesis_figures() -> None:
    """(4.7)-(4.8): 1700 and 3977 counts/s at 0.1 and 1 V give a0 0.364 V and delta 0.636."""
    gain = 165.72 / (1.0 - 0.95833)
    runs = []
    for volts, speed in ((3.1, 1700.0), (4.0, 3977.0)):
        for sign in (1.0, -1.0):
            runs.append((T, np.full(5000, sign * volts), sign * speed * T))
    zone = discontinuous_dead_zone(runs, gain, 3.0)
    assert zone.both.a0 == pytest.approx(0.364, abs=1e-3)
    assert zone.both.delta == pytest.approx(0.636, abs=1e-3)
    assert zone.speed(2.0) == pytest.approx(6507.0, abs=1.0)
    assert zone.speed(-2.0) == pytest.approx(-6507.0, abs=1.0)  # the corrected sign of (4.5)


@settings(max_examples=30, deadline=None)
@given(a0=st.floats(0.05, 1.0), delta=st.floats(0.2, 1.5), ratio=st.floats(0.5, 1.5))
def test_each_direction_keeps_its_own(a0: float, delta: float, ratio: float) -> None:
    runs = [steady(v, a0, delta, 4000.0) for v in (3.1, 3.5, 4.0)]
    runs += [steady(-v, ratio * a0, delta, 4000.0) for v in (3.1, 3.5, 4.0)]
    zone = discontinuous_dead_zone(runs, 4000.0, 3.0)
    assert zone.positive.a0 == pytest.approx(a0, abs=1e-6)
    assert zone.negative.a0 == pytest.approx(ratio * a0, abs=1e-6)
    assert zone.positive.delta == pytest.approx(delta, abs=1e-6)
    assert zone.positive.a0_std < 1e-6


def test_unusable_steady_runs_are_refused() -> None:
    runs = [steady(s * v, 0.3, 0.6, 4000.0) for s in (1, -1) for v in (3.1, 4.0)]
    with pytest.raises(InputError, match=r"beyond \+-3.5 V"):
        discontinuous_dead_zone(runs, 4000.0, 3.5)
    with pytest.raises(InputError, match="two voltages"):
        discontinuous_dead_zone(runs[::2], 4000.0, 3.0)
    with pytest.raises(InputError, match="gain"):
        discontinuous_dead_zone(runs, float("inf"), 3.0)
