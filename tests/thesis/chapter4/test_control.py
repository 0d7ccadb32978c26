"""Figures of the macro-stage's three controllers (Section 4.3)."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest
from tests.thesis.ended import collected

from macromicro.design import steps
from macromicro.thesis.chapter4 import control
from macromicro.thesis.chapter4._design import STEP
from macromicro.thesis.chapter4.control import TRAVEL, MacroData
from macromicro.thesis.contents import find


@pytest.fixture(scope="module")
def data() -> MacroData:
    made: MacroData = collected("macro-control")
    return made


@pytest.fixture(scope="module")
def figures(data: MacroData) -> dict[str, list[Any]]:
    """Axes by the figure's number."""
    figures = find("macro-control").figures.items()
    return {n: cast(Any, draw(data).body).axes for n, draw in figures}


def curve(ax: Any, label: str) -> tuple[np.ndarray, np.ndarray]:
    """Data of the line with this label."""
    x, y = next(c for c in ax.get_lines() if c.get_label() == label).get_data()
    return np.asarray(x), np.asarray(y)


def visible(ax: Any, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Which points lie within the axes."""
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    return (x >= left) & (x <= right) & (y >= low) & (y <= high)


@pytest.mark.slow
def test_pid(data: MacroData, figures: dict[str, list[Any]]) -> None:
    """Figure 4.18 covers what M9 is judged by, a minute with one reversal, and the sticking."""
    effort, response = figures["4.18"]
    t, motor = curve(effort, "effort")
    assert t[-1] == pytest.approx(60.0, abs=0.1)  # thinned
    assert motor[0] > 0.0 > motor[-1]
    assert motor.max() == data.steps["pid"]["motor"].max()
    t, x = curve(response, "encoder")
    assert x.max() == data.steps["pid"]["macro_position"].max()
    held = x[(t > 4.0) & (t < 8.0)]
    assert np.ptp(held) == 0.0
    assert held[0] > TRAVEL


@pytest.mark.slow
def test_initial_pd_overshoots_in_the_zoom(data: MacroData, figures: dict[str, list[Any]]) -> None:
    """Figure 4.20: the zoom holds the bench's overshoot and every swing; the model has none."""
    full, zoom = figures["4.20"]
    t, x = curve(zoom, "bench")
    seen = x[visible(zoom, t, x)]
    swings = steps.swings(data.steps["pd-initial"]["macro_position"], TRAVEL)
    shown = seen[np.argmax(seen >= TRAVEL - steps.ARRIVED) :]
    turns = np.diff(np.sign(np.diff(shown)[np.diff(shown) != 0.0]))
    assert np.count_nonzero(turns) == len(swings) >= 2
    assert seen.max() > TRAVEL
    assert curve(zoom, "initial model")[1].max() < TRAVEL + 1.0
    assert len(curve(full, "initial model")[1]) == len(curve(full, "bench")[1])


@pytest.mark.slow
def test_damping_ratios(data: MacroData, figures: dict[str, list[Any]]) -> None:
    """Figure 4.22: a curve for each ratio, the output before the limit; M12's is at 5 V."""
    effort, zoom = figures["4.22"]
    for label in ("0.8", "1", "1.05", "1.2", "1.5"):
        trial = data.design.ratios[float(label)]
        t, u = curve(effort, label)
        np.testing.assert_array_equal(u, trial.effort[: len(u)])
        assert u[1:].max() > 5.0
        assert u[0] == trial.first
        assert visible(effort, t, u).all()
        t, x = curve(zoom, label)
        assert x[visible(zoom, t, x)].max() == pytest.approx(STEP + trial.overshoot)
    assert curve(effort, f"{data.design.ratio:.2f}")[1][1:].max() == pytest.approx(5.0, abs=1e-3)


@pytest.mark.slow
def test_crossovers(data: MacroData, figures: dict[str, list[Any]]) -> None:
    """Figure 4.23: a curve for each crossover; in (c) the dots lie where the gain is 1, in (d)
    on the phases: 4.91 and 9.91 rad/s, 76.3 deg."""
    full, zoom, gains, phases = figures["4.23"]
    for label in ("9.91", "6.5", "4.91", "4", "3"):
        x = curve(full, label)[1]
        np.testing.assert_array_equal(x, data.design.frequencies[float(label)].position[: len(x)])
    t, bare = curve(zoom, "4.91, no derivative")
    assert bare[visible(zoom, t, bare)].max() > STEP + 5.0
    dots = [c for c in gains.get_lines() if c.get_marker() == "o"]
    at = [float(c.get_xdata()[0]) for c in dots]
    assert at == pytest.approx([9.91, 4.91, 56.6], rel=0.005)
    loops = [curve(gains, name) for name in ("(4.9)", "(4.10), minus", "(4.10) as printed")]
    for frequency, (w, gain) in zip(at, loops, strict=True):
        crossing = np.exp(np.interp(np.log(frequency), np.log(w), np.log(gain)))
        assert crossing == pytest.approx(1.0, rel=0.01)
    lines = [c for c in phases.get_lines() if len(c.get_xdata()) > 2]
    marks = [c for c in phases.get_lines() if c.get_marker() == "o"]
    for loop, mark in zip(lines, marks, strict=True):
        phase = np.interp(mark.get_xdata(), *loop.get_data())
        assert phase == pytest.approx(mark.get_ydata(), abs=0.5)
    assert marks[0].get_ydata()[0] == pytest.approx(76.3 - 180.0, abs=0.4)


@pytest.mark.slow
def test_tuned_pd(data: MacroData, figures: dict[str, list[Any]]) -> None:
    """Figure 4.24: styles of the legend, the zoom on an arrival, M14's time, M16's slope."""
    full, zoom, move, travel = figures["4.24"]
    styles = {c.get_label(): c.get_linestyle() for c in full.get_lines()}
    assert styles == {"target": "-.", "simulated": "-", "bench": ":"}
    t, x = curve(full, "bench")
    rows = np.round(t * 1e3).astype(int)
    np.testing.assert_array_equal(x, data.square.bench["pd-tuned"][rows])
    t, x = curve(zoom, "bench")
    assert np.any(x[visible(zoom, t, x)] == data.square.reference[0])
    mark = float(move.get_lines()[1].get_xdata()[0])
    t, x = curve(move, "bench")
    assert np.all(np.abs(x[t >= mark] - TRAVEL) <= 0.02 * TRAVEL)
    assert mark == control.full_move(data.steps["pd-tuned"]).measured
    counts, millimetres = curve(travel, "laser")
    assert millimetres[-1] / counts[-1] * 2800.0 == pytest.approx(200.0, abs=0.2)


@pytest.mark.slow
def test_comparison_shows_the_chatter(data: MacroData, figures: dict[str, list[Any]]) -> None:
    """Figure 4.25: the zoom holds the initial PD's overshoot and every swing of that level."""
    full, zoom = figures["4.25"]
    styles = {c.get_label(): c.get_linestyle() for c in full.get_lines()}
    assert styles == {"target": "-.", "PID": "--", "initial PD": ":", "tuned PD": "-"}
    aim = data.square.reference[0]
    level = data.square.bench["pd-initial"][: control.HOLD]
    t, x = curve(zoom, "initial PD")
    seen = x[visible(zoom, t, x)]
    np.testing.assert_array_equal(steps.swings(seen, aim), steps.swings(level, aim))
    assert seen.max() == level.max() > aim
    t, x = curve(zoom, "tuned PD")
    assert not len(steps.swings(x[visible(zoom, t, x)], aim))
