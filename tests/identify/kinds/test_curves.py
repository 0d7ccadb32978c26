"""Records cut into first-order curves, sample by sample."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.signal import savgol_filter

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify.kinds import hysteresis
from macromicro.identify.picking import Picked


def picked(name: str = "u", **values: object) -> Picked:
    arrays = {role: np.asarray(v, np.float64) for role, v in values.items()}
    return Picked("f.csv", arrays, {}, {"u": name}, {})


def legs(*corners: float, n: int = 10) -> Array:
    """A straight leg of n samples from corner to corner."""
    parts = [np.linspace(a, b, n + 1)[:-1] for a, b in itertools.pairwise(corners)]
    return np.r_[np.concatenate(parts), corners[-1]]


def test_falls_are_cut_where_the_input_turned() -> None:
    u = 100.0 + legs(0, 10, 0, 6, 0.9, 8, 1.1, 5, 0)
    f = np.arange(len(u)) + 0.5
    found = hysteresis.cut_curves(u, f)
    # The last fall follows a rise from 101.1, more than a tenth of the range above the lowest.
    assert len(found) == 3
    for (made, out), top in zip(found, (10, 30, 50), strict=True):
        np.testing.assert_allclose(made, u[top : top + 11], rtol=1e-12)
        np.testing.assert_array_equal(out, f[top : top + 11])


def test_a_rise_begins_where_the_output_is_what_it_is_at_the_low_end() -> None:
    """A record that begins in a room colder than all that it is cooled to afterwards."""
    u = legs(0, 10, 2, 8, 2, 6, 5, 7, 2)

    def extended(level: float) -> int:
        f = np.where(u <= 2.0, 0.0, np.where(u < 5.5, level, 1.0))
        f[41:60] = 1.0  # it turns at 5 before it has come down
        return len(hysteresis.cut_curves(u, f))

    assert extended(0.5) == 3  # but not after the rise from 5
    f = np.where(u < 1.5, 0.0, np.where(u < 5.5, 0.031, 1.0))
    assert len(hysteresis.cut_curves(u, f)) == 1
    f = np.where(u < 1.5, 0.0, np.where(u < 5.5, 0.029, 1.0))
    assert len(hysteresis.cut_curves(u, f)) == 4


def test_what_turns_by_three_hundredths_is_no_noise() -> None:
    def cycles(dip: float) -> list[hysteresis.Pair]:
        u = np.r_[legs(0, 10, 6, n=8)[:-1], legs(6, 6 + dip, 0, n=6)[:-1], legs(0, 9, 0, n=6)]
        return hysteresis.cut_curves(u, np.arange(len(u)) * 1.0)

    assert [u[-1] for u, _ in cycles(0.29)] == [0.0, 0.0]
    assert [u[-1] for u, _ in cycles(0.31)] == [6.0, 0.0]


def test_a_last_fall_may_be_short_but_not_noise() -> None:
    def last(*fall: float) -> int:
        u = np.r_[legs(0, 9, 0, 10)[:-1], 10.0, fall]
        return len(hysteresis.cut_curves(u, np.arange(len(u)) * 1.0)) - 1

    assert last(9.9, 9.87, 9.85, 9.8, 9.69) == 1
    assert last(9.9, 9.87, 9.85, 9.8, 9.72) == 0
    assert last(9.0, 8.0, 7.0, 6.0) == 1  # five samples
    assert last(9.0, 8.0, 7.0) == 0


def test_points_are_means_over_a_three_hundredth_of_the_range() -> None:
    fall = np.r_[10.0 - 0.0333 * np.arange(300), 0.0]
    u = np.r_[legs(0, 10)[:-1], fall]
    f = np.arange(len(u)) ** 1.5
    ((made, out),) = hysteresis.cut_curves(u, f)
    pairs = fall[:300].reshape(150, 2).mean(axis=1)
    np.testing.assert_allclose(made, [10.0, *pairs[1:], 0.0], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(out[1:-1], f[10:310].reshape(150, 2).mean(axis=1)[1:])
    assert out[0] == f[10] and out[-1] == f[-1]


def test_a_long_fall_begins_with_the_mean_of_a_thousandth() -> None:
    u = np.r_[legs(0, 10)[:-1], np.linspace(10.0, 0.0, 2001)]
    f = np.arange(len(u)) * 1.0
    ((made, out),) = hysteresis.cut_curves(u, f)
    assert made[0] == 10.0 and out[0] == 10.5
    ((_, out),) = hysteresis.cut_curves(np.r_[u[:11], u[12:]], np.r_[f[:10], 7.0, f[12:]])
    assert out[0] == (7.0 + 12.0) / 2.0
    ((_, out),) = hysteresis.cut_curves(np.r_[u[:11], u[13:]], np.r_[f[:10], 7.0, f[13:]])
    assert out[0] == 7.0


def test_cycles_from_the_low_end_are_descending_curves_from_the_high_end_ascending() -> None:
    u = legs(0, 10, 0, 6, 0, 8, 0)
    f = np.arange(len(u)) + 0.5
    found = hysteresis.from_tables([picked(u=u, f=f)], "auto")
    assert found.kind == "descending" and len(found.curves) == 3
    np.testing.assert_array_equal(found.records, [(u, f)])
    other = hysteresis.from_tables([picked(u=10.0 - u, f=-f)], "auto")
    assert other.kind == "ascending" and len(other.curves) == 3
    for (a, b), (c, d) in zip(found.curves, other.curves, strict=True):
        np.testing.assert_allclose(c, 10.0 - a, atol=1e-12)
        np.testing.assert_allclose(d, -b)
    with pytest.raises(
        InputError, match=r"f\.csv: 1 ascending curves found: the input never reverses"
    ):
        hysteresis.from_tables([picked(u=u, f=f)], "ascending")
    # Both ends are met: what was asked for counts, else the falls.
    both = [picked(u=legs(0, 10, 0, 10, 0, 10), f=np.arange(51.0))]
    assert [len(hysteresis.from_tables(both, k).curves) for k in ("auto", "ascending")] == [2, 2]
    assert hysteresis.from_tables(both, "auto").kind == "descending"
    assert hysteresis.from_tables(both, "ascending").kind == "ascending"
    most = [picked(u=legs(10, 0, 10, 0, 10, 0, 5), f=np.arange(61.0))]
    assert hysteresis.from_tables(most, "auto").kind == "ascending"
    assert hysteresis.from_tables(most, "descending").kind == "descending"
    with pytest.raises(InputError, match="--curves: 'up'; accepted: auto, ascending or desc"):
        hysteresis.from_tables(both, "up")


def test_one_curve_is_too_few_and_two_will_do() -> None:
    f = np.arange(21.0)
    with pytest.raises(InputError, match="1 descending curves"):
        hysteresis.from_tables([picked(u=legs(0, 5, 0), f=f)], "auto")
    two = [picked(u=legs(0, top, 0), f=f) for top in (5, 3)]
    assert len(hysteresis.from_tables(two, "auto").curves) == 2


def test_a_column_of_curves_is_taken_as_it_is() -> None:
    up, down = np.arange(4.0), np.arange(4.0)[::-1]

    def named(*rows: Array) -> list[Picked]:
        number = np.repeat(np.arange(len(rows))[::-1], 4)
        u = np.concatenate(rows)
        return [picked(u=u, f=2.0 * u, curve=number)]

    found = hysteresis.from_tables(named(up, 3.0 + up, down), "auto")
    assert found.kind == "ascending" and found.records == []
    for (u, f), row in zip(found.curves, (up, 3.0 + up, down), strict=True):
        np.testing.assert_array_equal(u, row)
        np.testing.assert_array_equal(f, 2.0 * row)
    assert hysteresis.from_tables(named(up, 3.0 + up, down), "descending").kind == "descending"
    assert hysteresis.from_tables(named(up, down), "auto").kind == "descending"
    assert hysteresis.from_tables(named(up, down, down), "auto").kind == "descending"
    assert len(hysteresis.from_tables([*named(up), *named(down)], "auto").curves) == 2
    # Without the column in every file the records are cut.
    with pytest.raises(InputError, match="4 rows"):
        hysteresis.from_tables([*named(up), picked(u=up, f=up)], "auto")


def test_constant_columns_and_short_records_are_refused() -> None:
    ramp = np.linspace(0.0, 1.0, 20)
    u, f = hysteresis.clean(picked(u=ramp, f=-ramp))
    np.testing.assert_array_equal(u, ramp)
    np.testing.assert_array_equal(f, -ramp)
    with pytest.raises(InputError, match=r"f\.csv, u: the column is constant at 3"):
        hysteresis.clean(picked(u=np.full(20, 3.0), f=ramp))
    with pytest.raises(InputError, match=r"f\.csv, f: the column is constant at 0"):
        hysteresis.clean(picked(u=ramp, f=0.0 * ramp))
    with pytest.raises(InputError, match=r"f\.csv: the file has 19 rows\. Give 20 rows or more"):
        hysteresis.clean(picked(u=ramp[:19], f=ramp[:19]))


@pytest.mark.parametrize(("dt", "window"), [(0.5, 13), (1.0, 7), (1.4, 5), (1.6, 0), (0.25, 0)])
def test_a_thermocouple_is_smoothed_over_six_seconds(dt: float, window: int) -> None:
    n = 20
    t = np.arange(n) * dt
    u = 20.0 + t + 0.3 * np.cos(2.0 * np.arange(n))
    made, f = hysteresis.clean(picked("thermocouple", u=u, f=2.0 * t, t=t))
    expected = savgol_filter(u, window, 2) if window else u
    np.testing.assert_allclose(made, expected, rtol=1e-12)
    np.testing.assert_array_equal(f, 2.0 * t)
    for same in (picked("u", u=u, f=t, t=t), picked("thermocouple", u=u, f=t)):
        np.testing.assert_array_equal(hysteresis.clean(same)[0], u)


def test_a_thermocouple_loses_its_spikes() -> None:
    t = np.arange(60.0)
    u = 20.0 + 0.5 * t
    spiked = u.copy()
    spiked[30] += 40.0
    made, _ = hysteresis.clean(picked("thermocouple", u=spiked, f=t, t=t))
    np.testing.assert_allclose(made, u, atol=1e-9)
