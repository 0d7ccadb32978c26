"""Measured curves put in order: what is left out, what is mended, what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import spearmanr

from macromicro.errors import InputError
from macromicro.hysteresis.curves import (
    CutWarning,
    DroppedCurveWarning,
    MissingRowsWarning,
    OrderWarning,
    averaged,
    direction,
    tidy,
)

DOWN = [10.0, 8.0, 6.0, 4.0, 2.0, 0.0]
OUT = [9.0, 8.0, 7.0, 5.0, 2.0, 0.0]
OTHER = ([5.0, 3.0, 0.0], [4.0, 2.5, 0.0])


@pytest.mark.parametrize("seed", range(8))
def test_direction_is_the_rank_correlation_with_time(seed: int) -> None:
    """Equal inputs share their mean rank."""
    u = np.random.default_rng(seed).integers(0, 6, 20).astype(float)
    assert direction(u) == pytest.approx(spearmanr(u, np.arange(20)).statistic, abs=1e-12)


def test_one_input_or_none_has_no_direction() -> None:
    assert direction(np.array([3.0])) == direction(np.array([3.0, 3.0])) == 0.0
    assert direction(np.array([3.0, 4.0])) == pytest.approx(1.0)


@pytest.mark.parametrize("kind", ["descending", "ascending"])
def test_curves_come_as_descending_ones_by_rising_reversal(kind: str) -> None:
    sign = 1.0 if kind == "descending" else -1.0
    given = [(sign * np.array(u), sign * np.array(f)) for u, f in ((DOWN, OUT), OTHER)]
    found = tidy(given, kind)
    assert [c.u.tolist() for c in found] == [OTHER[0], DOWN]
    assert [c.f.tolist() for c in found] == [OTHER[1], OUT]


def test_of_two_curves_from_one_reversal_the_shorter_comes_first() -> None:
    short = (DOWN[:3], OUT[:3])
    assert [c.u.size for c in tidy([(DOWN, OUT), short, OTHER], "descending")] == [3, 3, 6]


def test_missing_rows_are_left_out() -> None:
    u, f = list(DOWN), list(OUT)
    u[1], f[3] = np.nan, np.inf
    with pytest.warns(MissingRowsWarning, match=r"curves\[0\]: 2 of 6 rows"):
        found = tidy([(u, f), OTHER], "descending")[1]
    assert (found.u.tolist(), found.f.tolist()) == ([10.0, 6.0, 2.0, 0.0], [9.0, 7.0, 2.0, 0.0])


@pytest.mark.parametrize("u", [[4.0, 2.0], [4.0, 4.0, 2.0], [4.0, 3.0, 2.0]])
def test_a_curve_of_two_different_inputs_is_one(u: list[float]) -> None:
    given = [(u, [3.0, 2.0, 1.0][: len(u)]), (DOWN, OUT), OTHER]
    kept = tidy(given, "descending")
    assert [curve.u.tolist() for curve in kept if curve.u[0] == 4.0] == [u]


@pytest.mark.parametrize("u", [[4.0], [4.0, 4.0]])
def test_a_curve_that_stays_where_it_is_is_left_out(u: list[float]) -> None:
    given = [(u, [3.0, 2.0][: len(u)]), (DOWN, OUT), OTHER]
    with pytest.warns(DroppedCurveWarning, match=r"curves\[0\]: only 1 different"):
        assert len(tidy(given, "descending")) == 2


@pytest.mark.parametrize("before", [2, 3])
def test_rows_before_the_reversal_are_cut_off(before: int) -> None:
    """Where they rise all the way to it, two or more."""
    u = [*np.linspace(1.0, 9.0, before), *DOWN]
    f = [*np.linspace(0.5, 8.5, before), *OUT]
    with pytest.warns(CutWarning, match=f"{before} rows before the reversal"):
        found = tidy([(u, f), OTHER], "descending")[1]
    assert (found.u.tolist(), found.f.tolist()) == (DOWN, OUT)


def test_a_curve_that_turns_at_its_end_is_no_curve() -> None:
    """Two rows behind the reversal are too few."""
    u, f = [1.0, 3.0, 5.0, 4.0], [1.0, 2.0, 3.0, 2.5]
    with pytest.warns((CutWarning, DroppedCurveWarning, OrderWarning)):
        found = tidy([(u, f), (DOWN, OUT), OTHER], "descending")
    assert len(found) >= 2


def test_rows_in_no_order_are_sorted_and_that_is_said() -> None:
    u, f = [4.0, 10.0, 0.0, 8.0, 2.0, 6.0], [5.0, 9.0, 0.0, 8.0, 2.0, 7.0]
    with pytest.warns(OrderWarning):
        found = tidy([(u, f), OTHER], "descending")[1]
    assert (found.u.tolist(), found.f.tolist()) == (DOWN, OUT)


@pytest.mark.parametrize(
    ("curves", "kind", "named"),
    [
        ([(DOWN, OUT), OTHER], "sideways", "kind"),
        ([(DOWN, OUT)], "descending", "1 of 1 are usable"),
        ([(DOWN[::-1], OUT), OTHER], "descending", r"curves\[0\].*rises.*highest.*'ascending'"),
        ([(DOWN, OUT), OTHER], "ascending", r"curves\[0\].*falls.*lowest.*'descending'"),
        ([([2.0] * 3, [1.0, 2.0, 3.0]), OTHER], "descending", r"curves\[0\].*constant at 2"),
        ([([-2.0] * 3, [1.0, 2.0, 3.0]), OTHER], "ascending", r"curves\[0\].*constant at -2"),
        ([(DOWN, [1.0] * 6), (OTHER[0], [1.0] * 3)], "descending", "output"),
        ([(DOWN, OUT[:-1]), OTHER], "descending", "shapes"),
        ([([DOWN], [OUT]), OTHER], "descending", "shapes"),
        ([("abc", OUT), OTHER], "descending", "not numbers"),
    ],
)
def test_what_is_no_set_of_curves_is_refused(curves: object, kind: str, named: str) -> None:
    with pytest.raises(InputError, match=named):
        tidy(curves, kind)  # type: ignore[arg-type]


def test_neighbours_are_averaged_and_the_ends_stay() -> None:
    """Bins of 1 from the lowest input on, which has one of its own, as has the highest."""
    u = np.array([0.0, 0.4, 0.6, 1.2, 1.4, 2.5, 3.0, 0.0, 3.0])
    f = np.array([1.0, 2.0, 4.0, 5.0, 7.0, 8.0, 9.0, 3.0, 11.0])
    mean_u, mean_f = averaged(u, f, 1.0)
    np.testing.assert_allclose(mean_u, [0.0, 0.5, 1.3, 2.5, 3.0])
    np.testing.assert_allclose(mean_f, [2.0, 3.0, 6.0, 8.0, 10.0])
    np.testing.assert_allclose(averaged(u, f, np.inf)[0], [0.0, 6.1 / 5.0, 3.0])


def test_only_a_rise_to_the_reversal_is_cut_off() -> None:
    """Rows before it in no order are sorted in with the others."""
    u, f = [4.0, 1.0, 7.0, 3.0, *DOWN], [4.1, 1.1, 7.1, 3.1, *OUT]
    with pytest.warns(OrderWarning):
        found = tidy([(u, f), OTHER], "descending")[1]
    assert found.u.tolist() == sorted(u, reverse=True)


def test_curves_are_ordered_by_their_reversal_not_by_what_follows() -> None:
    """The lower reversal comes first, though its second reading is the higher one."""
    high, low = ([10.0, 5.0, 0.0], [9.0, 4.0, 0.0]), ([9.0, 8.0, 0.0], [8.0, 7.0, 0.0])
    assert [curve.u[0] for curve in tidy([high, low], "descending")] == [9.0, 10.0]
