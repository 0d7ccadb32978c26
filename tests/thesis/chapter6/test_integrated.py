"""Figures of the integrated test (Chapter 6)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tests.thesis.ended import collected

from macromicro.control.supervisor import MICRO
from macromicro.drawing.exhibit import Drawn
from macromicro.recording import Recording
from macromicro.thesis.chapter6 import integrated, integrated_runs
from macromicro.thesis.chapter6.integrated import cycling, part
from macromicro.thesis.chapter6.integrated_runs import IntegratedRuns
from macromicro.thesis.contents import find

PROCEDURE = find("integrated")


@pytest.fixture(scope="module")
def runs() -> IntegratedRuns:
    made: IntegratedRuns = collected("integrated")
    return made


@pytest.fixture(scope="module")
def drawn(runs: IntegratedRuns) -> dict[str, Drawn]:
    return {n: draw(runs) for n, draw in PROCEDURE.figures.items()}


def axes_of(drawn: Drawn) -> list[Any]:
    """The axes of a figure."""
    assert not isinstance(drawn.body, str | tuple)
    return list(drawn.body.axes)


def labels(ax: Any) -> list[str]:
    """The labels of all lines."""
    return [str(each.get_label()) for each in ax.get_lines()]


def changed(r: Recording, **columns: float | None) -> Recording:
    """The recording with columns set to a value, or without those that are None."""
    kept = [c for c in r.columns if columns.get(c.name, 0.0) is not None]
    arrays = [np.full(len(r), columns[c.name]) if c.name in columns else r[c.name] for c in kept]
    return Recording.from_arrays(kept, arrays, r.dt, {})


@pytest.mark.slow
def test_zoom_shows_a_whole_turn(runs: IntegratedRuns, drawn: dict[str, Drawn]) -> None:
    """Figure 6.2b: from the first arrival at 190 mm to the next macro move, and 3 mm of it."""
    zoom, fine = axes_of(drawn["6.2"])[1::2]
    second = runs.warm["t"][np.argmax(runs.warm["move"] == 5)]
    assert zoom.get_xlim()[1] > second
    low, high = zoom.get_ylim()
    assert low < 190.0 and high > 193.0
    assert [t.get_text() for t in zoom.texts] == ["reset", "wait"]
    assert "Hall sensor" in labels(fine)


@pytest.mark.slow
def test_whole_system_is_both_sensors(runs: IntegratedRuns, drawn: dict[str, Drawn]) -> None:
    """Figure 6.2: encoder and Hall sensor added, at the third fine level 193 mm."""
    line = next(x for x in axes_of(drawn["6.2"])[1].get_lines() if "encoder" in x.get_label())
    assert line.get_ydata().max() == pytest.approx(193.0, abs=0.2)


@pytest.mark.slow
def test_vibration_shows_every_move(runs: IntegratedRuns, drawn: dict[str, Drawn]) -> None:
    """Figure 6.3: the fitted decay is what the claim measures."""
    full, _, peaks, decays = axes_of(drawn["6.3"])
    found = integrated_runs.shaken(runs)
    assert list(peaks.get_lines()[-1].get_ydata()) == [v.amplitude_um for v in found]
    assert list(decays.get_lines()[-1].get_ydata()) == [v.decay_s for v in found]
    decay = next(x for x in full.get_lines() if x.get_label() == "fitted decay")
    t, y = decay.get_data()
    assert np.interp(found[0].decay_s or 0.0, t, y) == pytest.approx(2.0, abs=0.05)


@pytest.mark.slow
def test_a_laser_that_shows_no_vibration_gets_no_decay(runs: IntegratedRuns) -> None:
    still = runs._replace(warm=changed(runs.warm, laser=0.0))
    full = axes_of(integrated.vibration(still))[0]
    assert "fitted decay" not in labels(full)
    assert "laser" in labels(full)


@pytest.mark.slow
def test_sequence_begins_at_the_reset(runs: IntegratedRuns) -> None:
    """Figure 6.4: from the sample after the reset on, with the return that came before it."""
    for cycle, move in ((0, 4), (9, 364)):
        own = part(runs.warm, runs.single, cycle)
        assert runs.warm["laser_reset"][own.rows.start - 1] == 1
        assert (runs.warm["phase"][own.rows] == MICRO).all()
        assert (own.rows.stop - own.rows.start) * runs.warm.dt == pytest.approx(8.0, abs=0.01)
        assert own.before is not None and own.before.move == move


@pytest.mark.slow
def test_bias_is_seen_without_a_fan_only(runs: IntegratedRuns, drawn: dict[str, Drawn]) -> None:
    """Sections 6.3, 6.3.1: over 5 um in the last cycle, which a fan takes away; the Hall
    sensor is on its set point in both."""
    for number, low, high in (("6.4", 5.0, 9.0), ("6.5", -3.0, 3.0)):
        near = axes_of(drawn[number])[1]
        for label, least, most in (("cycle 10", low, high), ("Hall sensor", -3.0, 3.0)):
            t, y = next(x for x in near.get_lines() if x.get_label() == label).get_data()
            late = -y[(t > 3.4) & (t < 3.9)]
            assert least < late.mean() < most


@pytest.mark.slow
def test_with_a_fan_no_bias_is_spoken_of(runs: IntegratedRuns, drawn: dict[str, Drawn]) -> None:
    """The arrow and the words about missing micrometres belong to Figure 6.4 alone."""
    for number, arrow in (("6.4", 1), ("6.5", 0)):
        near = axes_of(drawn[number])[1]
        assert sum("bias" in text.get_text() for text in near.texts) == arrow
    worst = integrated_runs.cycle_bias(runs, runs.cooled).worst
    assert f"at most {worst:.1f} um" in drawn["6.5"].caption
    assert "missing from every later" in drawn["6.4"].caption
    assert "missing" not in drawn["6.5"].caption


@pytest.mark.slow
def test_green_is_what_counts_as_reproduced(drawn: dict[str, Drawn]) -> None:
    """Figure 6.3 (c, d): the bands are those of claim I2, and the caption says so."""
    for ax, (low, high) in zip(axes_of(drawn["6.3"])[2:], ((14.0, 26.0), (1.5, 2.5)), strict=True):
        assert ax.patches[0].get_extents().transformed(ax.transData.inverted()).bounds[
            1::2
        ] == pytest.approx((low, high - low))
        assert f"{low:g} to {high:g}" in drawn["6.3"].caption


@pytest.mark.slow
def test_a_rig_without_truth_has_the_figure_without_it(
    runs: IntegratedRuns, drawn: dict[str, Drawn]
) -> None:
    hidden = {c.name: None for c in runs.warm.columns if c.name.startswith("true_")}
    bare = changed(runs.warm, **hidden)
    right = axes_of(cycling(runs._replace(warm=bare), "6.4"))[-1]
    assert not any("truth" in label for label in labels(right))
    assert any("truth" in label for label in labels(axes_of(drawn["6.4"])[-1]))


@pytest.mark.slow
def test_squares_show_the_cycle_time(runs: IntegratedRuns, drawn: dict[str, Drawn]) -> None:
    """Claim I6: the times at the last square are those counted."""
    time = integrated_runs.cycle_time(runs)
    near = axes_of(drawn["6.5 (squares)"])[1]
    assert [t.get_text() for t in near.texts] == [
        f"{time.contraction:.2f} s",
        f"{time.extension:.2f} s",
    ]
