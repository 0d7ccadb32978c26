"""Figures of the macro-stage's friction (Section 4.2.3)."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest
from tests.thesis.ended import collected

from macromicro.drawing.style import thin_out
from macromicro.thesis.chapter4 import friction
from macromicro.thesis.chapter4.friction import FrictionData
from macromicro.thesis.contents import find


@pytest.fixture(scope="module")
def data() -> FrictionData:
    made: FrictionData = collected("macro-friction")
    return made


@pytest.fixture(scope="module")
def figures(data: FrictionData) -> dict[str, list[Any]]:
    """Axes by the figure's number."""
    figures = find("macro-friction").figures.items()
    return {n: cast(Any, draw(data).body).axes for n, draw in figures}


def test_coulomb_model_and_dots(data: FrictionData, figures: dict[str, list[Any]]) -> None:
    """Figure 4.4: the dots are the runs' steady states, the line the model they give."""
    speeds, levels = figures["4.4"]
    model, moving, still = speeds.get_lines()
    np.testing.assert_array_equal(moving.get_xdata(), data.coulomb.volts)
    np.testing.assert_array_equal(moving.get_ydata(), data.coulomb.speeds)
    at = np.interp(moving.get_xdata(), model.get_xdata(), model.get_ydata())
    np.testing.assert_allclose(at, data.coulomb.speeds, rtol=0.01)
    assert not np.any(still.get_ydata())
    step, dots, rest = levels.get_lines()
    assert np.abs(dots.get_ydata()) == pytest.approx(step.get_ydata()[-1], abs=0.01)
    assert np.abs(rest.get_ydata()).min() > step.get_ydata()[-1]
    assert np.abs(rest.get_ydata()).max() < data.zone.width


def test_low_voltages_are_the_recordings(data: FrictionData, figures: dict[str, list[Any]]) -> None:
    """Figure 4.8: every curve is a run's encoder column; one stops on its way, some go through."""
    ends = []
    for ax, start in zip(figures["4.8"][:2], (0.0, 400.0), strict=True):
        runs = friction.forward(data.runs, start)
        assert tuple(runs) == friction.SHOWN
        for curve, (volts, run) in zip(ax.get_lines(), runs.items(), strict=True):
            assert run["macro_position"][0] == start
            assert np.all(run["motor"] == volts)
            x, y = thin_out(run["t"], run["macro_position"])
            np.testing.assert_array_equal(curve.get_xdata(), x)
            np.testing.assert_array_equal(curve.get_ydata(), y)
            ends.append(float(y[-1]) - start)
    assert friction.easiest(data.zone) == 400.0
    assert any(e < 20.0 for e in ends)
    assert any(100.0 < e < 2000.0 for e in ends)
    assert any(e > 2390.0 for e in ends)


def test_thresholds_and_speed_by_place(data: FrictionData, figures: dict[str, list[Any]]) -> None:
    """Figure 4.8 (c), (d): what M1 takes as width; speed varies along the way, under way only."""
    thresholds, speeds = figures["4.8"][2:]
    drawn = [c for c in thresholds.get_lines() if len(c.get_xdata()) > 2]
    highest = max(float(np.max(c.get_ydata())) for c in drawn)
    assert highest == data.zone.width
    for run in friction.forward(data.runs, 0.0, friction.MOVING).values():
        place, speed = friction.speed_by_place(run)
        assert place.min() > 100.0
        assert place.max() <= 2800.0
        assert speed.min() > 1000.0
        assert 1.15 < speed.max() / speed.min() < 1.6
    assert len(speeds.get_lines()) == len(friction.MOVING)


def test_inverse_cancels_the_dead_zone(data: FrictionData, figures: dict[str, list[Any]]) -> None:
    """Figure 4.9: nothing within the width, a lift by the width, and both in a row the input."""
    zone, inverse, both = figures["4.9"]
    x, y = zone.get_lines()[0].get_data()
    assert not y[np.abs(x) <= data.zone.width].any()
    np.testing.assert_allclose(y[-1], x[-1] - data.zone.width)
    for part in inverse.get_lines()[:2]:
        lifted = part.get_ydata() - part.get_xdata()
        np.testing.assert_allclose(lifted, np.sign(part.get_xdata()) * data.zone.width)
    np.testing.assert_allclose(*both.get_lines()[0].get_data(), atol=1e-12)
