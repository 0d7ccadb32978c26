"""A Hall table from runs made by hand: what it covers, how it is extended, what is too little."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.identify.hall import _tables, calibrate, fit_table

Pair = tuple[np.ndarray, np.ndarray]


def both_ways(volts: np.ndarray, place: np.ndarray, lag: float = 0.0) -> list[Pair]:
    return [(volts, place + lag), (volts[::-1], (place - lag)[::-1])]


def test_gaps_at_the_ends_are_extended_with_the_last_slope() -> None:
    """Of a table over 0 to 5 V at 0.5 V, seen from 1 to 4 V."""
    volts = np.linspace(0.9, 4.1, 3201)
    table = calibrate(both_ways(volts, volts**2), 0.0, 5.0, 11)
    assert (table.low, table.step) == (0.0, 0.5)
    inner = table.position[2:9]
    np.testing.assert_allclose(inner[1:-1], np.arange(1.5, 4.0, 0.5) ** 2, atol=0.03)
    first, last = inner[1] - inner[0], inner[-1] - inner[-2]
    assert last > 2.0 * first > 0.0
    np.testing.assert_allclose(table.position[:2], inner[0] - first * np.array([2.0, 1.0]))
    np.testing.assert_allclose(table.position[9:], inner[-1] + last * np.array([1.0, 2.0]))


def test_a_table_never_falls() -> None:
    volts = np.linspace(0.0, 5.0, 5001)
    place = np.where(volts < 2.0, volts, np.where(volts < 3.0, 4.0 - volts, volts - 2.0))
    table = calibrate(both_ways(volts, place), 0.5, 4.5, 9)
    np.testing.assert_allclose(table.position[4:6], table.position[3])
    np.testing.assert_allclose(table.position[[0, 1, 7, 8]], [0.5, 1.0, 2.0, 2.5], atol=1e-9)


def test_the_mean_is_over_runs_of_each_direction_alike() -> None:
    """Half of what the two differ by is `between`; one direction alone tells none."""
    volts = np.linspace(0.0, 5.0, 5001)
    fit = fit_table([*both_ways(volts, volts, 0.1), *both_ways(volts, volts, 0.3)], 0.5, 4.5, 9)
    np.testing.assert_allclose(fit.calibration.position, fit.volts, atol=1e-9)
    np.testing.assert_allclose(fit.between, 0.2, atol=1e-9)
    np.testing.assert_allclose(fit.std, np.std([0.1, -0.1, 0.3, -0.3], ddof=1), atol=1e-9)
    np.testing.assert_allclose(fit.error, fit.std / 2.0)
    one = fit_table([(volts, volts), (volts, volts + 0.1)], 0.5, 4.5, 9)
    assert np.isnan(one.between).all() and one.runs == 2
    down = fit_table([(volts[::-1], volts[::-1])] * 2, 0.5, 4.5, 9)
    assert np.isnan(down.between).all()


@pytest.mark.parametrize(("last", "covered"), [(2.05, 4), (2.55, 5), (4.05, 8)])
def test_runs_must_cover_half_of_the_range(last: float, covered: int) -> None:
    """Five of ten voltages do; all runs must have been there."""
    volts = np.arange(0.45, last, 1e-3)
    whole = np.arange(0.4, 5.1, 1e-3)
    runs = [(volts, volts), (whole, whole)]
    if covered < 5:
        with pytest.raises(InputError, match="4 of 10 voltages are covered"):
            calibrate(runs, 0.5, 5.0, 10)
    else:
        made = calibrate(runs, 0.5, 5.0, 10)
        np.testing.assert_allclose(made.position, made.low + made.step * np.arange(10), atol=1e-9)
        assert np.isfinite(_tables(runs, np.linspace(0.5, 5.0, 10))[0]).sum() == covered


@pytest.mark.parametrize(
    ("spacing", "reach"),
    [
        (0.05, 0.25),  # half a grid step
        (0.1, 0.5),  # eight readings need a whole one
        (0.2, 1.0),  # or two
        (0.3, 0.0),  # and beyond these there are too few
    ],
)
def test_a_line_is_fitted_as_far_around_as_eight_readings_reach(
    spacing: float, reach: float
) -> None:
    volts = 2.0 + spacing * (np.arange(-40, 40) + 0.5)
    place = (volts - 2.0) ** 2  # a line through it is at the mean of the squares
    found = _tables([(volts, place)], np.array([1.5, 2.0]))[0, 1]
    near = place[np.abs(volts - 2.0) < reach]
    if reach:
        assert len(near) >= 8 and found == pytest.approx(near.mean())
    else:
        assert np.isnan(found)


def test_a_voltage_at_the_edge_of_a_run_is_not_covered() -> None:
    volts = np.linspace(1.0, 2.0, 101)
    found = _tables([(volts, volts)], np.array([0.5, 1.0, 1.5, 2.0, 2.5]))[0]
    np.testing.assert_array_equal(np.isfinite(found), [False, False, True, False, False])
