"""Figures 2.12-2.19."""

from __future__ import annotations

import pytest

from macromicro.thesis.contents import find
from macromicro.thesis.procedure import Lab

PROCEDURE = find("preisach-geometry")


def test_captions_say_the_models_output() -> None:
    data = PROCEDURE.collect(Lab())
    shown = {n: draw(data) for n, draw in PROCEDURE.figures.items()}
    for k, number in enumerate(("2.12", "2.13", "2.14", "2.15", "2.16")):
        assert f"f = {data.stages[k].f:.4f} at u{k} = {data.stages[k].u:g}" in shown[number].caption
    q = data.trapezoids[1]
    assert f"{q.difference:.5f}" in shown["2.18"].caption
    assert f"{q.integrated:.5f}" in shown["2.18"].caption


def test_waterfall_ends_at_the_output() -> None:
    """Figure 2.17 (b)."""
    data = PROCEDURE.collect(Lab())
    bars = PROCEDURE.figures["2.17"](data).body.axes[1].patches
    top = bars[-1].get_y() + bars[-1].get_height()
    assert top == pytest.approx(data.stages[-1].f)
    assert len(bars) == 1 + len(data.trapezoids)
