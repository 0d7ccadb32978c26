"""Figures of the macro-stage's open-loop models (Sections 4.2.4, 4.2.5)."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest
from tests.thesis.ended import collected

from macromicro.thesis.chapter4 import identification
from macromicro.thesis.chapter4.identification import IdentificationData
from macromicro.thesis.claims import DIFFERS
from macromicro.thesis.contents import find

PANELS = [(v, s) for v in (0.1, 1.0, 2.0) for s in ("square", "sine")]


@pytest.fixture(scope="module")
def data() -> IdentificationData:
    made: IdentificationData = collected("macro-identification")
    return made


@pytest.fixture(scope="module")
def figures(data: IdentificationData) -> dict[str, list[Any]]:
    """Axes by the figure's number."""
    figures = find("macro-identification").figures.items()
    return {n: cast(Any, draw(data).body).axes for n, draw in figures}


def test_step_of_one_volt(data: IdentificationData, figures: dict[str, list[Any]]) -> None:
    """Figure 4.11: the mean of runs of both directions, its difference, the model over it."""
    position, speed = figures["4.11"]
    ways = [np.sign(r["motor"][0]) for r in data.steps[1.0]]
    assert ways.count(1.0) == ways.count(-1.0) == 5
    t, x = position.get_lines()[0].get_data()
    places = [r["macro_position"] for r in data.steps[1.0]]
    gone = [s * (place - place[0]) for s, place in zip(ways, places, strict=True)]
    np.testing.assert_allclose(x, np.mean(gone, axis=0))
    measured, model = speed.get_lines()
    np.testing.assert_allclose(measured.get_ydata(), np.diff(x) * 1e3)
    np.testing.assert_array_equal(measured.get_xdata(), t[1:])
    assert model.get_ydata()[-1] == pytest.approx(data.found.linear.gain, rel=1e-6)
    away = position.get_lines()[1].get_ydata() - x
    assert np.abs(away).max() < 0.01 * np.ptp(x)


@pytest.mark.parametrize("number", ["4.13", "4.17"])
def test_six_panels(data: IdentificationData, figures: dict[str, list[Any]], number: str) -> None:
    """Amplitudes below each other, square beside sine; the bench solid, the model dotted."""
    for ax, panel, case in zip(figures[number], PANELS, data.cases, strict=True):
        assert (case.volts, case.shape) == panel
        assert f"{case.volts:g} V {case.shape}" in ax.get_title(loc="left")
        bench, model = ax.get_lines()
        assert (bench.get_linestyle(), model.get_linestyle()) == ("-", ":")
        rows = np.searchsorted(case.t, bench.get_xdata())
        assert np.ptp(bench.get_xdata()) > 0.99 * np.ptp(case.t)
        np.testing.assert_array_equal(bench.get_ydata(), case.bench[rows])
        shown = case.tuned if number == "4.17" else case.initial
        np.testing.assert_array_equal(model.get_ydata(), shown[rows])


def test_tuned_friction_model(data: IdentificationData, figures: dict[str, list[Any]]) -> None:
    """Figure 4.14: none up to the width, a jump to a0 there, and a line through two speeds."""
    zone, inverse, both = figures["4.14"]
    side = data.found.zone.both
    inside, beyond = (c.get_data() for c in zone.get_lines()[:2])
    assert np.abs(inside[0]).max() == data.found.zone.width
    assert not inside[1].any()
    assert beyond[1][0] == pytest.approx(side.a0, abs=1e-6)
    assert beyond[1][-1] == pytest.approx(side.a0 + 2.0 * side.delta)
    for part in inverse.get_lines():
        assert np.abs(part.get_ydata()).min() == pytest.approx(data.found.zone.width)
    model = next(c for c in both.get_lines() if c.get_label() == "model")
    dots = [c for c in both.get_lines() if c.get_marker() == "o"]
    assert [float(c.get_xdata()[0]) for c in dots] == [0.1, 1.0, 2.0]
    assert [c.get_markerfacecolor() == "none" for c in dots] == [False, False, True]
    for dot in dots:
        line = np.interp(dot.get_xdata(), *model.get_data())
        assert dot.get_ydata() == pytest.approx(line, rel=0.02)


def test_validation_can_fail(data: IdentificationData) -> None:
    """M8 differs where the tuned model is no better; M7 where the initial one is never wrong."""
    worse = [c._replace(tuned=c.initial) for c in data.cases]
    assert identification.case_claims(worse)[1].verdict == DIFFERS
    perfect = [c._replace(initial=c.bench + 0.01 * (c.tuned - c.bench)) for c in data.cases]
    assert identification.case_claims(perfect)[0].verdict == DIFFERS
