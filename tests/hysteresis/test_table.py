"""Tables from measured first-order curves (Sections 2.4.1 and 5.2.1)."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.errors import InputError
from macromicro.hysteresis import FodTable, Preisach, from_density
from macromicro.hysteresis import table as table_module
from macromicro.hysteresis.curves import (
    ClockwiseWarning,
    ClosureWarning,
    CutWarning,
    DroppedCurveWarning,
    MissingRowsWarning,
    OrderWarning,
    averaged,
    direction,
    tidy,
)
from macromicro.hysteresis.shape import cells
from macromicro.hysteresis.table import MOST_NODES

Pair = tuple[np.ndarray, np.ndarray]
LO, HI = 20.0, 110.0
LOW, HIGH = 0.1, 4.1


def hills(alpha: np.ndarray, beta: np.ndarray) -> np.ndarray:
    """A smooth density: broad thresholds about 75 up and 50 down."""
    return np.exp(-(((alpha - 75.0) / 14.0) ** 2) - ((beta - 50.0) / 12.0) ** 2)


TRUE = FodTable.from_everett(from_density(hills, LO, 0.25, 361), LOW, HIGH)


def measured(
    count: int, *, noise: float = 0.0, seed: int = 0, kind: Any = "descending"
) -> list[Pair]:
    """Curves of the true table: own reversals, own abscissae, own lengths."""
    rng = np.random.default_rng(seed)
    starts = np.sort(rng.uniform(30.0, 100.0, count))
    starts = np.append(starts, HI) if kind == "descending" else np.append(LO, starts)
    curves = []
    for start in starts:
        end = LO if kind == "descending" else HI
        u = np.concatenate(
            [[start], rng.uniform(*sorted((start, end)), 150 + rng.integers(50)), [end]]
        )
        u = np.sort(u)[:: -1 if kind == "descending" else 1]
        f = TRUE.curve(start, u, kind)
        curves.append((u, f + noise * rng.normal(size=u.size)))
    return curves


def loop_error(table: FodTable) -> float:
    """Largest error of the major loop, as a share of the output's range."""
    rising, falling = (np.interp(table.grid, TRUE.grid, side) for side in TRUE.major_loop[1:])
    _, up, down = table.major_loop
    return float(max(np.abs(up - rising).max(), np.abs(down - falling).max()) / (HIGH - LOW))


@pytest.mark.parametrize("kind", ["descending", "ascending"])
@pytest.mark.parametrize("shape", ["free", "monotone", "nonnegative"])
def test_curves_without_a_common_grid_give_back_the_model(kind: Any, shape: Any) -> None:
    table = FodTable.from_curves(measured(30, kind=kind), kind, shape=shape, nodes=91)
    assert table.misfit().rms < 1e-3 * (HIGH - LOW)
    assert loop_error(table) < 1e-2  # between 30 reversals, the largest gap 8 degrees
    # Other curves, and a path of many reversals, which no curve shows.
    assert table.misfit(measured(9, seed=5, kind=kind)).rms < 2e-3 * (HIGH - LOW)
    rng = np.random.default_rng(1)
    path = rng.uniform(LO, HI, 300)
    errors = Preisach(table).run(path) - Preisach(TRUE).run(path)
    assert np.sqrt(np.mean(errors**2)) < 4e-3 * (HIGH - LOW)


@pytest.mark.parametrize("shape", ["free", "monotone", "nonnegative"])
def test_noise_is_averaged_not_followed(shape: Any) -> None:
    """1 % of noise on every point leaves much less on the curves between."""
    table = FodTable.from_curves(measured(40, noise=0.04), shape=shape, nodes=61)
    assert table.misfit(measured(9, seed=5)).rms < 0.6 * 0.04


def test_ascending_curves_are_descending_ones_of_the_mirrored_model() -> None:
    """u -> -u and f -> -f: thresholds change places, alpha becomes -beta."""
    curves = measured(12)
    table = FodTable.from_curves(curves, nodes=41)
    mirror = FodTable.from_curves([(-u, -f) for u, f in curves], "ascending", nodes=41)
    assert np.allclose(mirror.values, table.values[::-1, ::-1].T, atol=1e-12)
    assert mirror.lo == pytest.approx(-table.hi)
    path = np.random.default_rng(1).uniform(LO, HI, 80)
    down, up = Preisach(table), Preisach(mirror)
    up.reset("positive")
    assert np.allclose(down.run(path), -up.run(-path), atol=1e-12)


def test_a_falling_output_is_a_model_of_the_other_sign() -> None:
    curves = measured(12)
    table = FodTable.from_curves(curves, shape="nonnegative", nodes=41)
    other = FodTable.from_curves([(u, -f) for u, f in curves], shape="nonnegative", nodes=41)
    assert other.span == pytest.approx(-table.span)
    assert np.allclose(other.values, -table.values, atol=1e-9)


def test_order_of_curves_and_of_rows_and_repetitions_do_not_matter() -> None:
    curves = measured(12, noise=0.01)
    table = FodTable.from_curves(curves, nodes=41)
    rng = np.random.default_rng(3)
    order = rng.permutation(len(curves))
    shuffled = []
    for k in order:
        u, f = curves[k]
        mixed = rng.permutation(u.size)
        shuffled.append((u[mixed], f[mixed]))
    with pytest.warns(OrderWarning, match="sorted"):
        again = FodTable.from_curves(shuffled, nodes=41)
    assert np.allclose(again.values, table.values, atol=1e-9)
    # Every inner point three times: the same curve, not three times the weight.
    thrice = [(np.repeat(u, 3), np.repeat(f, 3)) for u, f in curves]
    assert np.allclose(FodTable.from_curves(thrice, nodes=41).values, table.values, atol=1e-9)


@pytest.mark.parametrize("shape", ["free", "monotone", "nonnegative"])
def test_smoothing_does_not_move_the_major_loop(shape: Any) -> None:
    curves = measured(25, noise=0.02)
    plain, smooth = (
        FodTable.from_curves(curves, shape=shape, smooth=s, nodes=41) for s in (0.0, 6.0)
    )
    for one, other in zip(plain.major_loop, smooth.major_loop, strict=True):
        assert np.allclose(one, other, rtol=0.0, atol=1e-9)
    assert smooth.misfit().rms > plain.misfit().rms
    if shape == "free":
        rough, even = (np.nanstd(np.diff(table.density, axis=0)) for table in (plain, smooth))
        assert even < 0.5 * rough


def test_shapes_hold_exactly_and_cost_fit() -> None:
    curves = measured(25, noise=0.04)
    free, monotone, nonnegative = (
        FodTable.from_curves(curves, shape=shape, nodes=41)
        for shape in ("free", "monotone", "nonnegative")
    )
    assert free.negative_share > 0.05
    below = np.tri(40, 41, dtype=bool)
    for table in (monotone, nonnegative):
        assert np.all(np.diff(table.values, axis=0)[below] >= -1e-13)
        assert np.all(np.diff(table.values, axis=1)[np.tri(41, 40, dtype=bool)] <= 1e-13)
        assert table.everett().values[-1, 0] == 1.0
    assert cells(nonnegative.values).min() > -1e-12
    assert nonnegative.negative_share < 1e-12
    assert free.misfit().rms <= monotone.misfit().rms <= nonnegative.misfit().rms < 0.06


def test_nonnegative_is_the_least_squares_solution() -> None:
    """ADMM against the active-set solution of the same small problem (scipy's nnls)."""
    import scipy.sparse as sp
    from scipy.optimize import nnls

    from macromicro.hysteresis.shape import minimise

    rng = np.random.default_rng(6)
    a = rng.normal(size=(40, 15))
    y = rng.normal(size=40)
    expected, _ = nnls(a, y)
    matrix, bound = sp.csr_array(a.T @ a), sp.csr_array(np.eye(15))
    found = minimise(matrix, a.T @ y, bound, np.zeros(15), 1e-4, 10.0)
    assert np.count_nonzero(expected == 0.0) > 2
    assert np.allclose(found, expected, atol=1e-6)


def test_reversible_input_below_the_lowest_reversal() -> None:
    """Where no curve starts, both branches are the lowest curve: no hysteresis there."""
    curves = [(u, f) for u, f in measured(20) if u[0] > 60.0]
    table = FodTable.from_curves(curves, nodes=61)
    first = min(u[0] for u, _ in curves)
    model = Preisach(table)
    path = np.linspace(LO, first - 2.0 * table.step, 50)
    rise = model.run(path)
    fall = model.run(path[::-1])[::-1]
    assert np.allclose(rise, fall, atol=2e-3 * (HIGH - LOW))


def test_limits_widen_the_table_without_relays_there() -> None:
    table = FodTable.from_curves(measured(12), nodes=101, limits=(0.0, 130.0))
    assert (table.lo, table.hi) == (0.0, pytest.approx(130.0))
    model = Preisach(table)
    top = model.step(HI + 1.5)
    assert model.step(130.0) == pytest.approx(top, abs=2e-3)
    with pytest.raises(InputError, match="hold the data"):
        FodTable.from_curves(measured(12), limits=(30.0, 130.0))


@pytest.mark.parametrize("kind", ["descending", "ascending"])
def test_limits_within_the_data_are_refused_with_what_they_hold(kind: Any) -> None:
    curves = measured(8, kind=kind)
    u = np.concatenate([u for u, _ in curves])
    low, high = float(u.min()), float(u.max())
    for limits in ((low + 1.0, high), (low, high - 1.0)):
        with pytest.raises(InputError, match="limits") as caught:
            FodTable.from_curves(curves, kind, limits=limits, nodes=21)
        shown = str(caught.value).split("hold the data, [")[1].split("]")[0].split(",")
        assert [float(s) for s in shown] == pytest.approx([low, high])
    assert FodTable.from_curves(curves, kind, limits=(high, low), nodes=21).lo == pytest.approx(low)


def test_raw_data_are_kept_as_they_came() -> None:
    curves = [(u.tolist(), f.tolist()) for u, f in measured(5)]
    curves[2][1][7] = float("nan")
    with pytest.warns(MissingRowsWarning, match=r"curves\[2\]: 1 of"):
        table = FodTable.from_curves(curves, nodes=21)
    for (u, f), (raw_u, raw_f) in zip(curves, table.raw, strict=True):
        assert np.array_equal(u, raw_u)
        assert np.array_equal(f, raw_f, equal_nan=True)


def test_first_order_and_density_are_those_of_the_model() -> None:
    table = FodTable.from_everett(from_density(hills, LO, 2.0, 46), LOW, HIGH)
    assert table.first_order[30, 30] == pytest.approx(table.major_loop[1][30])
    assert np.allclose(table.first_order[-1], table.major_loop[2])
    assert np.isnan(table.first_order[10, 11])
    area = 4.0 * (1.0 - 0.5 * np.eye(45))
    assert np.nansum(table.density * area) == pytest.approx(HIGH - LOW)
    middle = LO + 2.0 * (np.arange(45) + 0.5)
    shape = hills(middle[:, None], middle[None, :])
    inner = np.tri(45, k=-1, dtype=bool)
    ratio = table.density[inner] / shape[inner]
    assert np.allclose(ratio, ratio[0], rtol=1e-6)


@given(st.lists(st.floats(-5.0, 5.0), min_size=1, max_size=30), st.floats(0.01, 3.0))
@settings(max_examples=60, deadline=None)
def test_averaging_keeps_ends_and_order(values: list[float], width: float) -> None:
    u = np.array(values)
    mean_u, mean_f = averaged(u, 2.0 * u + 1.0, width)
    assert np.all(np.diff(mean_u) > 0.0) or np.ptp(u) < 1e-12
    assert mean_u[0] == pytest.approx(u.min())
    assert mean_u[-1] == pytest.approx(u.max())
    assert np.allclose(mean_f, 2.0 * mean_u + 1.0)


def test_direction() -> None:
    assert direction(np.array([1.0, 2.0, 2.0, 5.0])) > 0.9
    assert direction(np.array([5.0, 2.0, 1.0])) == pytest.approx(-1.0)
    assert direction(np.array([3.0, 3.0])) == 0.0


GOOD = measured(4)


def with_curve(u: Any, f: Any) -> list[Any]:
    return [*GOOD, (u, f)]


@pytest.mark.parametrize(
    ("curves", "kind", "named"),
    [
        ([], "descending", "at least 2 usable curves"),
        (GOOD[:1], "descending", "at least 2 usable curves"),
        (GOOD, "both", "'ascending'"),
        (GOOD, "ascending", "without a reversal"),
        (with_curve([40.0, 50.0, 60.0, 70.0], [1, 2, 3, 4]), "descending", r"curves\[5\]"),
        (with_curve([40.0, 40.0, 40.0], [1, 2, 3]), "descending", "constant"),
        (with_curve([40.0, 30.0], [1.0]), "descending", "equally long"),
        (with_curve("warm", "cold"), "descending", "numbers"),
        ([1.0, 2.0], "descending", "pair"),
        ([(u, 0.0 * f) for u, f in GOOD], "descending", "changes"),
    ],
)
def test_impossible_curves_are_refused(curves: Any, kind: Any, named: str) -> None:
    with pytest.raises(InputError, match=named):
        FodTable.from_curves(curves, kind)


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"shape": "round"}, "nonnegative"),
        ({"smooth": -1.0}, "0 to 100"),
        ({"smooth": float("nan")}, "0 to 100"),
        ({"nodes": 4}, "8 to"),
        ({"nodes": 10**6}, "8 to"),
    ],
)
def test_impossible_options_are_refused(options: Any, named: str) -> None:
    with pytest.raises(InputError, match=named):
        FodTable.from_curves(GOOD, **options)


def test_what_is_mended_is_said() -> None:
    u, f = GOOD[2]
    rise = np.linspace(LO, u[0], 60)[:-1]
    with pytest.warns(CutWarning, match=r"curves\[4\]: 59 rows before the reversal"):
        kept = tidy([*GOOD[:4], (np.r_[rise, u], np.r_[0.0 * rise, f])], "descending")
    assert sum(np.array_equal(curve.u, u) for curve in kept) == 2
    with pytest.warns(DroppedCurveWarning, match="only 1 different inputs"):
        assert len(tidy([*GOOD, ([50.0, 50.0], [1.0, 0.5])], "descending")) == len(GOOD)
    two = FodTable.from_curves([*GOOD, ([50.0, 40.0], [1.0, 0.5])], nodes=21)
    assert len(two.raw) == len(GOOD) + 1
    with pytest.warns(MissingRowsWarning):
        FodTable.from_curves([(np.r_[u, np.nan], np.r_[f, 1.0]) for u, f in GOOD], nodes=21)


def test_data_that_contradict_themselves_are_pointed_out() -> None:
    drifting = [(u, f + 0.1 * k) for k, (u, f) in enumerate(measured(8))]
    with pytest.warns(ClosureWarning, match="% of the range apart") as told:
        FodTable.from_curves(drifting, nodes=21)
    share = float(str(told[0].message).split("end ")[1].split(" %")[0])
    extent = float(np.ptp(np.concatenate([f for _, f in drifting])))
    assert share == pytest.approx(100.0 * 0.7 / extent, rel=0.2)  # what the last has drifted by
    slightly = [(u, f + 0.003 * k) for k, (u, f) in enumerate(measured(8))]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        FodTable.from_curves(slightly, nodes=21)
    with pytest.warns(ClockwiseWarning, match="clockwise"), pytest.warns(ClosureWarning):
        # Ascending data whose rows were turned round to look descending.
        turned = [(u[::-1], f[::-1]) for u, f in measured(8, kind="ascending")]
        FodTable.from_curves(turned, nodes=21)


def test_clean_data_cause_no_warning() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        FodTable.from_curves(measured(8, noise=0.01), nodes=41)
        wobbly = [(u + np.r_[0.0, 0.2 * np.sin(u[1:])], f) for u, f in measured(8)]
        FodTable.from_curves(wobbly, nodes=41)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"values": np.ones((3, 3))}, "diagonal"),
        ({"values": np.ones(3)}, "shape"),
        ({"values": np.zeros((1, 1))}, "shape"),
        ({"values": np.zeros((0, 0))}, "shape"),
        ({"values": np.zeros((3, 2))}, "shape"),
        ({"values": np.full((3, 3), np.nan)}, "finite"),
        ({"values": np.zeros((3, 3))}, "saturations"),
        ({"step": 0.0}, "step"),
        ({"step": float("nan")}, "step"),
        ({"step": float("inf")}, "step"),
        ({"lo": float("nan")}, "finite lo"),
        ({"lo": float("-inf")}, "finite lo"),
        ({"f_low": float("inf")}, "saturations"),
        ({"kind": "sideways"}, "descending"),
    ],
)
def test_impossible_tables_are_refused(changes: dict[str, Any], named: str) -> None:
    good = {"lo": 0.0, "step": 1.0, "values": np.tril(np.ones((3, 3)), -1), "f_low": 0.0}
    FodTable(**good)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=named):
        FodTable(**{**good, **changes})


def test_a_table_that_turns_back_is_no_everett_table() -> None:
    values = np.tril(np.ones((3, 3)), -1)
    values[1, 0] = 2.0
    with pytest.raises(InputError, match="monotone"):
        FodTable(0.0, 1.0, values, 0.0).everett()


@pytest.mark.parametrize("scale", [1.0, -1.0, 50.0])
def test_the_negative_share_is_that_of_all_weights_sizes(scale: float) -> None:
    """Cells of 3, 2 and -1: a sixth, whatever the unit of the output."""
    values = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [4.0, -1.0, 0.0]])
    assert FodTable(0.0, 1.0, scale * values, 0.0).negative_share == pytest.approx(1.0 / 6.0)


def test_the_smallest_table_has_one_relay() -> None:
    table = FodTable(0.0, 1.0, np.array([[0.0, 0.0], [2.0, 0.0]]), 1.0)
    assert (table.n, table.hi, table.span) == (2, 1.0, 2.0)


@pytest.mark.parametrize(
    "options",
    [{"smooth": 0.0}, {"smooth": 100.0}, {"nodes": 8}, {"nodes": 20}],
)
def test_options_at_the_ends_of_their_ranges_are_accepted(
    options: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(table_module, "MOST_NODES", 20)  # of 801 it takes seconds
    curves = [([10.0, 5.0, 0.0], [8.0, 6.0, 0.0]), ([5.0, 2.5, 0.0], [3.0, 2.0, 0.0])]
    FodTable.from_curves(curves, **{"nodes": 9, **options})


@pytest.mark.parametrize("options", [{"smooth": 100.1}, {"nodes": 7}, {"nodes": MOST_NODES + 1}])
def test_options_just_beyond_are_refused(options: Any) -> None:
    with pytest.raises(InputError):
        FodTable.from_curves([([1.0, 0.0], [1.0, 0.0])] * 2, **options)


def test_what_lies_beyond_a_curves_start_or_the_table_counts_as_its_end() -> None:
    """E = 3 for the relay of the second step, 1 for that across both, 2 for the first."""
    values = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [6.0, 3.0, 0.0]])
    table = FodTable(0.0, 1.0, values, 10.0)
    assert table.curve(2.0, [2.0, 1.0, 0.0]).tolist() == [16.0, 13.0, 10.0]
    assert table.curve(1.0, [1.0, 0.0]).tolist() == [12.0, 10.0]
    assert table.curve(5.0, [9.0, 2.0, -3.0]).tolist() == [16.0, 16.0, 10.0]
    assert table.curve(-4.0, [9.0, -3.0]).tolist() == [10.0, 10.0]
    up = table.curve(0.0, [0.0, 1.0, 2.0], "ascending")
    assert up.tolist() == [10.0, 12.0, 16.0]
    assert table.curve(1.0, [1.0, 2.0], "ascending").tolist() == [13.0, 16.0]
    assert table.curve(1.0, [-5.0, 7.0], "ascending").tolist() == [13.0, 16.0]
    assert table.curve(7.0, [-5.0, 7.0], "ascending").tolist() == [16.0, 16.0]
    assert FodTable(0.0, 1.0, values, 10.0, "ascending").curve(1.0, 1.0) == 13.0


def test_the_misfit_is_that_of_the_curves_in_their_own_direction() -> None:
    values = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [6.0, 3.0, 0.0]])
    down, up = (FodTable(0.0, 1.0, values, 10.0, kind) for kind in ("descending", "ascending"))
    first = [([2.0, 1.0, 0.0], [16.5, 13.0, 9.0]), ([1.0, 0.5, 0.0], [12.0, 11.0, 10.0])]
    assert down.misfit(first) == pytest.approx((np.sqrt(1.25 / 6.0), 1.0, 6))
    second = [([0.0, 1.0, 2.0], [10.0, 12.0, 15.0]), ([1.0, 1.5, 2.0], [13.0, 14.5, 16.5])]
    assert up.misfit(second) == pytest.approx((np.sqrt(1.25 / 6.0), 1.0, 6))
