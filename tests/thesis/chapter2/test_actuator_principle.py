"""Figures 2.8-2.10, (2.1) and A.1."""

from __future__ import annotations

import pytest

from macromicro.drawing.exhibit import Drawn, render
from macromicro.thesis.contents import find
from macromicro.thesis.procedure import Lab

PROCEDURE = find("actuator-principle")


@pytest.fixture(scope="module")
def shown() -> dict[str, Drawn]:
    data = PROCEDURE.collect(Lab())
    return {n: draw(data) for n, draw in PROCEDURE.figures.items()}


def test_captions_tell_bench_from_textbook(shown: dict[str, Drawn]) -> None:
    assert "textbook's law" in shown["2.9"].caption
    assert "They have no plateau" in shown["2.9"].caption
    assert "bench truth" in shown["A.1"].caption


def test_equations_exhibit_has_a_name(shown: dict[str, Drawn]) -> None:
    made = render("(2.1)", shown["(2.1)"])
    assert (made.label, made.name) == ("Equation (2.1)", "equation-2-1")


def test_cycle_has_four_states_in_each_panel(shown: dict[str, Drawn]) -> None:
    for ax in shown["2.10"].body.axes:  # type: ignore[union-attr]
        words = [text.get_text() for text in ax.texts]
        assert [w for w in words if w in "ABCD"] == ["A", "B", "C", "D"]


def test_trace_marks_lie_on_it(shown: dict[str, Drawn]) -> None:
    """Figure A.1: three readings each on heating and on cooling, in the order of the ramp."""
    (ax,) = shown["A.1"].body.axes  # type: ignore[union-attr]
    marks = [line for line in ax.lines if line.get_marker() == "o"]
    places = [float(line.get_xdata()[0]) for line in marks]
    assert places[:3] == sorted(places[:3]) and places[3:] == sorted(places[3:])[::-1]
    levels = [float(line.get_ydata()[0]) for line in marks]
    assert max(levels) == levels[1] > 0.3 and min(levels) == levels[4] < -0.15
