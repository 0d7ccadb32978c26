"""Figures of the kiln's procedure (Section 5.2.1, Appendix D)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from macromicro.drawing.exhibit import Drawn
from macromicro.thesis.chapter5 import kiln_runs as kiln
from macromicro.thesis.chapter5.kiln import KilnRuns, first_cycle
from macromicro.thesis.contents import find

PROCEDURE = find("kiln")


@pytest.fixture(scope="module")
def shown(kiln_runs: KilnRuns) -> dict[str, Drawn]:
    return {n: draw(kiln_runs) for n, draw in PROCEDURE.figures.items()}


def axes(drawn: Drawn) -> list[Any]:
    body: Any = drawn.body
    return list(body.axes)


@pytest.mark.slow
def test_example_is_one_heating_cycle(kiln_runs: KilnRuns) -> None:
    """Figure 5.5: one rise and one fall, heater on and then off."""
    example = first_cycle(kiln_runs.heated.curves)
    assert np.count_nonzero(np.diff(example["heater"])) == 1
    assert example["thermocouple"].max() > kiln.MAXIMA[0]
    assert np.median(example["thermocouple"][-50:]) == pytest.approx(kiln.COLD, abs=1.0)


@pytest.mark.slow
def test_spikes_are_seen_raw_and_gone_smoothed(shown: dict[str, Drawn]) -> None:
    """Figure 5.5: (a) with the spikes, (b) without."""
    raw, smooth = (ax.lines[0].get_ydata() for ax in axes(shown["5.5"]))
    assert np.abs(np.diff(raw)).max() > 5.0
    assert np.abs(np.diff(smooth)).max() < 2.0


@pytest.mark.slow
def test_averages_lie_on_the_loop(shown: dict[str, Drawn]) -> None:
    """Figure 5.6: solid line and, far fewer, diamonds."""
    record, diamonds = axes(shown["5.6"])[0].lines
    assert diamonds.get_marker() == "D" and diamonds.get_linestyle() == "None"
    assert len(diamonds.get_xdata()) < 0.1 * len(record.get_xdata())
    rising = slice(0, int(np.argmax(record.get_xdata())))
    u, x = record.get_xdata()[rising], record.get_ydata()[rising]
    up = slice(0, int(np.argmax(diamonds.get_xdata())))
    order = np.argsort(u, kind="stable")
    near = np.interp(diamonds.get_xdata()[up], u[order], x[order])
    assert np.abs(near - diamonds.get_ydata()[up]).max() < 0.1


@pytest.mark.slow
def test_every_curve_is_drawn_as_measured(shown: dict[str, Drawn], kiln_runs: KilnRuns) -> None:
    """Figure 5.7: one line from each M_k."""
    lines = [line for line in axes(shown["5.7"])[0].lines if len(line.get_xdata()) > 50]
    raw = sorted(kiln_runs.table.raw, key=lambda c: float(c[0][0]))
    assert len(raw) == len(kiln.MAXIMA)
    for line, (u, f) in zip(lines, raw, strict=False):
        np.testing.assert_array_equal(line.get_xdata(), u)
        np.testing.assert_array_equal(line.get_ydata(), f)


@pytest.mark.slow
def test_table_has_three_axes(shown: dict[str, Drawn]) -> None:
    """Figures 5.8 and D.6: M_k, m_k and contraction."""
    for number in ("5.8", "D.6"):
        (ax,) = axes(shown[number])
        assert "M_k" in ax.get_xlabel() and "m_k" in ax.get_ylabel()
        assert "contraction" in ax.get_zlabel()


@pytest.mark.slow
def test_every_new_profile_is_compared_once(shown: dict[str, Drawn], kiln_runs: KilnRuns) -> None:
    """Figures 5.9 and D.7: measured and model over time and over temperature."""
    panels = axes(shown["5.9"]) + axes(shown["D.7"])[:2]
    pairs = list(zip(panels[::2], panels[1::2], strict=True))
    assert len(pairs) == len(kiln_runs.predictions)
    for (time, loop), p in zip(pairs, kiln_runs.predictions, strict=True):
        assert time.lines[0].get_ydata().max() == pytest.approx(p.profile.position.max())
        assert time.lines[1].get_ydata().max() == pytest.approx(p.model.max())
        every = max(len(p.model) // 4000, 1)
        np.testing.assert_array_equal(loop.lines[0].get_ydata(), p.profile.position[::every])
        np.testing.assert_array_equal(loop.lines[1].get_ydata(), p.model[::every])
