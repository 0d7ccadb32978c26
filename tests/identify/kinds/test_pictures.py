"""The figures of an identification show what they were given, named and to the right scale."""

from __future__ import annotations

import numpy as np
import pytest
from tests.identify.kinds.seen import plots

from macromicro.drawing.style import BINS, BLUE, ORANGE, RED
from macromicro.identify._report import pairs
from macromicro.identify.kinds import pictures

T = np.arange(40) * 0.5


def test_free_runs_show_three_records_at_most_with_their_difference() -> None:
    measured = [np.sin(T + k) for k in range(5)]
    model = [np.cos(T - k) for k in range(5)]
    figure = pictures.free_runs(pairs([T + k for k in range(5)], measured, model), "y [mm]")
    shown = plots(figure)
    assert len(shown) == 6
    assert tuple(figure.get_size_inches()) == pytest.approx((8.6, 4.6))
    assert figure.subplotpars.left == pytest.approx(0.11)
    assert list(figure.axes[0].get_gridspec().get_height_ratios()) == [2, 1]
    assert figure.axes[0].get_shared_x_axes().joined(figure.axes[0], figure.axes[3])
    (legend,) = figure.legends  # above all of them, where no title is
    assert [text.get_text() for text in legend.get_texts()] == ["measured", "model, free run"]
    for k in range(3):
        top, low = shown[k], shown[3 + k]
        assert top.title == f"record {k + 1} of 5"
        assert (top.x, top.y, top.legend) == ("", "y [mm]", False)
        assert (low.title, low.x, low.y, low.legend) == (
            "measured less model", "time [s]", "", False,
        )  # fmt: skip
        assert [x[0] for x in top.lines] == ["measured", "model, free run"]
        np.testing.assert_array_equal(top.lines[0][1], T + k)
        np.testing.assert_array_equal(top.lines[0][2], measured[k])
        np.testing.assert_array_equal(top.lines[1][1], T + k)
        np.testing.assert_array_equal(top.lines[1][2], model[k])
        np.testing.assert_array_equal(low.lines[0][1], T + k)
        np.testing.assert_array_equal(low.lines[0][2], measured[k] - model[k])
        assert low.lines[0][0] == "measured - model"
        colours = [x.get_color() for x in figure.axes[k].lines]
        assert colours == [BLUE, ORANGE]
        assert figure.axes[3 + k].lines[0].get_color() == RED
        assert figure.axes[k].lines[1].get_linestyle() == "--"


def test_a_single_record_needs_no_number_and_time_is_the_axis() -> None:
    shown = plots(pictures.free_runs(pairs([T], [T], [T]), "y"))
    assert [p.title for p in shown] == ["", "measured less model"]
    assert shown[1].x == "time [s]" and shown[0].legend


def test_long_records_are_thinned_and_no_peak_is_lost() -> None:
    t = np.arange(100_000) * 0.01
    model = np.sin(t)
    measured = model + np.where(t == 123.45, 0.7, 0.0) - np.where(t == 987.65, 0.2, 0.0)
    figure = pictures.free_runs(pairs([t], [measured], [model]), "y")
    _, shown, rest = plots(figure)[1].lines[0]
    assert len(rest) == 2 * BINS and rest.max() == pytest.approx(0.7)
    assert rest.min() == pytest.approx(-0.2)
    assert shown[rest.argmax()] == pytest.approx(123.45, abs=t[-1] / BINS)
    assert shown[rest.argmin()] == pytest.approx(987.65, abs=t[-1] / BINS)
    _, shown, rest = plots(pictures.leftover([measured - model], 0.01, "e"))[0].lines[0]
    assert len(rest) == 2 * BINS and rest.max() == pytest.approx(0.7)
    assert shown[rest.argmax()] == pytest.approx(123.45, abs=t[-1] / BINS)


def test_two_records_are_numbered() -> None:
    shown = plots(pictures.free_runs(pairs([T, T], [T, T], [T, T]), "y"))
    assert [p.title for p in shown[:2]] == ["record 1 of 2", "record 2 of 2"]


def test_residuals_stand_in_a_row_beside_their_autocorrelation() -> None:
    one, two = np.array([1.0, -2.0, 3.0, 1.0]), np.array([2.0, 1.0, -1.0])
    figure = pictures.leftover([one, two], 0.25, "e [um]")
    left, right = plots(figure)
    assert tuple(figure.get_size_inches()) == pytest.approx((8.6, 3.4))
    assert figure.subplotpars.left == pytest.approx(0.11)
    assert (left.title, left.x, left.y) == ("residuals, records in a row", "time [s]", "e [um]")
    assert (right.title, right.x) == ("their autocorrelation", "lag [samples]")
    label, t, e = left.lines[0]
    assert label == "residual"
    np.testing.assert_allclose(t, [0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5])
    np.testing.assert_array_equal(e, [*one, *two])
    # Powers 15 and 6; lag 1: -2 - 6 + 3 and 2 - 1; lag 2: 3 - 2 and -2. The shorter record has
    # no third lag.
    marks = next(x for x in right.lines if len(x[1]) == 2 and x[1][0] == 1.0)
    np.testing.assert_array_equal(marks[1], [1, 2])
    np.testing.assert_allclose(marks[2], [-4.0 / 21.0, -1.0 / 21.0])
    band = figure.axes[1].patches[0].get_bbox()
    assert (band.y0, band.y1) == pytest.approx((-2.58 / 7.0**0.5, 2.58 / 7.0**0.5))


def test_fifty_lags_at_most_one_at_least_and_no_division_by_nothing() -> None:
    def lags(*residuals: np.ndarray) -> np.ndarray:
        ax = figure = pictures.leftover(residuals, 1.0, "e")
        ax = figure.axes[1]
        return np.asarray(ax.containers[0].markerline.get_ydata())

    random = np.random.default_rng(1)
    assert len(lags(random.standard_normal(200))) == 50
    assert len(lags(random.standard_normal(51))) == 50
    assert len(lags(random.standard_normal(50))) == 49
    assert len(lags(random.standard_normal(60), random.standard_normal(7))) == 6
    assert list(lags(np.zeros(3))) == [0.0, 0.0]
    assert list(lags(np.ones(1))) == [0.0]


def test_points_take_three_colours_in_turn_and_a_legend_for_several() -> None:
    x = np.array([1.0, 2.0])
    figure = pictures.points("t", "a [V]", "b [m]", [(f"s{k}", x, k * x, "o-") for k in range(28)])
    only = plots(figure)[0]
    assert (only.title, only.x, only.y, only.legend) == ("t", "a [V]", "b [m]", True)
    assert tuple(figure.get_size_inches()) == pytest.approx((8.6, 3.6))
    lines = figure.axes[0].lines
    assert len(figure.axes) == 1 and len(lines) == 27
    assert [x.get_color() for x in lines[:4]] == [BLUE, ORANGE, RED, BLUE]
    for k, (label, xs, ys) in enumerate(only.lines):
        assert label == f"s{k}"
        np.testing.assert_array_equal(xs, x)
        np.testing.assert_array_equal(ys, k * x)
    assert lines[0].get_marker() == "o" and lines[0].get_linestyle() == "-"
    assert lines[0].get_linewidth() == pytest.approx(1.1)
    assert lines[0].get_markersize() == pytest.approx(4)
    assert plots(pictures.points("t", "a", "b", [("s", x, x, ".")] * 2))[0].legend
    assert not plots(pictures.points("t", "a", "b", [("s", x, x, ".")]))[0].legend
