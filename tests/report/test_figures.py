"""Figures show what the recording holds, thinned without losing a peak."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.drawing import files, style
from macromicro.report import _figures
from macromicro.report._figures import PageFigure
from macromicro.runs import folder
from macromicro.runs.job import Ended


@pytest.fixture(scope="module")
def drawn(ended: Ended) -> dict[str, PageFigure]:
    return {d.name: d for d in _figures.draw(ended)}


def test_all_figures_in_order(ended: Ended, drawn: dict[str, PageFigure]) -> None:
    assert list(drawn) == [
        n for n in folder.FIGURES if n != "tracking" and (n != "vibration" or ended.vibration)
    ]
    assert all(d.caption.endswith(".") and d.title for d in drawn.values())


def test_every_axis_has_units_and_few_points(drawn: dict[str, PageFigure]) -> None:
    for figure in drawn.values():
        for ax in figure.figure.axes:
            assert all(len(line.get_xdata()) <= 2 * style.BINS for line in ax.lines)
        labels = [ax.get_ylabel() for ax in figure.figure.axes] + [
            ax.get_xlabel() for ax in figure.figure.axes
        ]
        shown = [label for label in labels if label and label != "cycle"]
        assert shown and all("[" in label for label in shown)


def test_response_shows_both_stages_where_they_went(
    ended: Ended, drawn: dict[str, PageFigure]
) -> None:
    """Figure 6.2: macro in mm, micro in mm, each with its reference."""
    coarse, _, fine, _ = drawn["response"].figure.axes
    for ax, top in ((coarse, 40.0), (fine, 1.5)):
        reference, measured = ax.lines
        assert reference.get_ydata().max() == pytest.approx(top)
        assert measured.get_ydata().max() == pytest.approx(top, rel=0.02)
        assert ax.get_legend().get_texts()[0].get_text() == "reference"


def test_laser_is_hidden_outside_the_micro_phase(ended: Ended) -> None:
    """Elsewhere it shows the carriage's motion, tens of millimetres."""
    laser = _figures.fine_laser(ended.recording)
    assert np.isnan(laser).any()
    assert np.nanmax(np.abs(laser)) < 2000.0


def test_without_macro_moves_or_truth_there_is_less_to_show(ended: Ended) -> None:
    bare = ended._replace(vibration=[], cycles=[], moves=ended.moves[:1])
    assert [d.name for d in _figures.draw(bare)] == ["response", "efforts", "temperatures"]


def test_png_is_small_and_names_no_address(drawn: dict[str, PageFigure]) -> None:
    data = files.encode(drawn["efforts"].figure)
    assert data.startswith(b"\x89PNG") and len(data) < 300_000
    assert b"http" not in data


@settings(max_examples=50)
@given(
    st.lists(st.floats(-1e6, 1e6) | st.just(float("nan")), min_size=1, max_size=400),
    st.integers(1, 60),
)
def test_thinning_keeps_every_peak(values: list[float], bins: int) -> None:
    y = np.array(values)
    t, shown = style.thin_out(np.arange(len(y)) * 1.0, y, bins)
    assert len(t) == len(shown) <= max(2 * bins, 1)
    assert np.isnan(shown).all() == np.isnan(y).all()
    if not np.isnan(y).all():
        assert np.nanmax(shown) == np.nanmax(y) and np.nanmin(shown) == np.nanmin(y)
    assert (np.diff(t) >= 0).all()
