"""Figures of the electro-thermal procedure (Sections 5.2.2 and 5.2.3)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from macromicro.drawing.exhibit import Drawn
from macromicro.identify.heating import AMBIENT, cooling
from macromicro.thesis.chapter5.actuator_models import Models
from macromicro.thesis.chapter5.electrothermal import FAST_S
from macromicro.thesis.chapter5.electrothermal_runs import ABOVE_STOP, BELOW_STOP, HELD_S
from macromicro.thesis.chapter5.kiln import KilnRuns
from macromicro.thesis.contents import find

PROCEDURE = find("electrothermal")


@pytest.mark.slow
def test_table_is_that_of_the_kilns_own_procedure(models: Models, kiln_runs: KilnRuns) -> None:
    """Section 5.2.2: the temperatures are inferred by the same data."""
    np.testing.assert_array_equal(models.table.values, kiln_runs.table.values)


@pytest.fixture(scope="module")
def shown(models: Models) -> dict[str, Drawn]:
    return {n: draw(models) for n, draw in PROCEDURE.figures.items()}


def axes(drawn: Drawn) -> list[Any]:
    body: Any = drawn.body
    return list(body.axes)


def labelled(ax: Any) -> dict[str, Any]:
    return {str(x.get_label()): x for x in ax.lines if not str(x.get_label()).startswith("_")}


@pytest.mark.slow
def test_three_broken_trials_and_their_mean(shown: dict[str, Drawn]) -> None:
    """Figure 5.10: for each voltage."""
    for ax in axes(shown["5.10"]):
        broken = [x for x in ax.lines if x.get_linestyle() == "--"]
        assert len(broken) == 3 * len(BELOW_STOP + ABOVE_STOP)
        assert sorted(labelled(ax)) == sorted(f"{v:g} V" for v in BELOW_STOP + ABOVE_STOP)


@pytest.mark.slow
def test_measured_points_lie_on_the_fitted_gain(shown: dict[str, Drawn], models: Models) -> None:
    """Figure 5.11: points of the steps below the stop, and (5.2) within a kelvin of them."""
    lines = labelled(axes(shown["5.11"])[0])
    points = lines["measured"]
    np.testing.assert_allclose(points.get_xdata(), BELOW_STOP)
    np.testing.assert_allclose(points.get_ydata(), list(models.thesis.steady.values()))
    fit = lines["non-linear least squares"]
    near = np.interp(points.get_xdata(), fit.get_xdata(), fit.get_ydata())
    assert np.abs(near - points.get_ydata()).max() < 1.0


@pytest.mark.parametrize("number", ["5.13", "5.15", "5.17"])
@pytest.mark.slow
def test_panels_part_the_voltages_as_the_captions_do(shown: dict[str, Drawn], number: str) -> None:
    """(a) 1.5-1.6 V, (b) 1.65-1.8 V."""
    low, high = axes(shown[number])[:2]
    assert [x for x in labelled(low) if x.endswith(" V")] == [f"{v:g} V" for v in BELOW_STOP]
    assert [x for x in labelled(high) if x.endswith(" V")] == [f"{v:g} V" for v in ABOVE_STOP]


def modelled(ax: Any) -> list[Any]:
    return [x for x in ax.lines if x.get_linestyle() == "--"]


@pytest.mark.slow
def test_weighted_gain_speeds_up_large_steps(shown: dict[str, Drawn]) -> None:
    """Figures 5.13b and 5.15b: with (5.5) alone all large steps are one, at 94 degC after
    6 s; the second exponential parts them."""
    plain, weighted = (
        [line.get_ydata()[-1] for line in modelled(axes(shown[number])[1])]
        for number in ("5.13", "5.15")
    )
    assert np.ptp(plain) < 1.0
    assert np.diff(weighted).min() > 5.0
    assert max(plain) < min(weighted)


@pytest.mark.slow
def test_joined_gain_is_drawn_over_its_exponentials(shown: dict[str, Drawn]) -> None:
    """Figure 5.14: next to nothing below 1.47 V, never less; 139.1 K at 1.8 V."""
    lines = labelled(axes(shown["5.14"])[0])
    volts, rise = lines["weighted gain (5.8)"].get_data()
    assert 0.0 <= rise.min() < 0.001
    assert np.interp(1.8, volts, rise) == pytest.approx(139.1, abs=0.1)
    assert {"lower exponential", "upper exponential"} < set(lines)


@pytest.mark.slow
def test_cooling_passes_63_percent_where_it_is_marked(
    shown: dict[str, Drawn], models: Models
) -> None:
    """Figure 5.16: the mark lies on the identified exponential and on the measured fall."""
    lines = labelled(axes(shown["5.16"])[0])
    mark = next(x for name, x in lines.items() if name.startswith("63 %"))
    ((time,), (level,)) = mark.get_data()
    assert time == cooling(models.table, models.data.warm, AMBIENT).time
    for name, most in (("first order, identified", 0.05), ("1.575 V to 0 V, cycled", 0.5)):
        t, y = lines[name].get_data()
        known = np.isfinite(y)
        assert np.interp(time, t[known], y[known]) == pytest.approx(level, abs=most)


@pytest.mark.slow
def test_better_model_stands_below_the_thesis_one(shown: dict[str, Drawn], models: Models) -> None:
    """Figure 5.17: the same measurements above and below; labelled as beyond the thesis."""
    panels = axes(shown["5.17"])
    for above, below in zip(panels[:2], panels[2:], strict=True):
        assert "beyond the thesis" in below.get_title(loc="left")
        assert "beyond the thesis" not in above.get_title(loc="left")
        for name, line in labelled(above).items():
            np.testing.assert_array_equal(line.get_ydata(), labelled(below)[name].get_ydata())
    assert "beyond the thesis" in shown["5.17"].caption
    assert panels[0].lines[0].get_xdata()[-1] == pytest.approx(HELD_S, rel=0.01)
    assert panels[1].lines[0].get_xdata()[-1] == pytest.approx(FAST_S, rel=0.01)
    thesis, better = (
        abs(panels[k].lines[-1].get_ydata() - panels[k].lines[-2].get_ydata()).max() for k in (1, 3)
    )
    assert better < 0.5 * thesis
    assert models.better.rms < 0.03
