"""Figures 3.6 and 3.7, Tables 3.1-3.3."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.drawing.exhibit import Drawn, Grid
from macromicro.thesis.contents import find
from macromicro.thesis.procedure import Lab

PROCEDURE = find("sensor-design")


@pytest.fixture(scope="module")
def shown() -> dict[str, Drawn]:
    data = PROCEDURE.collect(Lab())
    return {n: draw(data) for n, draw in PROCEDURE.figures.items()}


def test_magnet_table(shown: dict[str, Drawn]) -> None:
    grid = shown["Table 3.1"].body
    assert isinstance(grid, Grid)
    rows = {row[0]: row[1:] for row in grid.rows}
    assert rows["0.02 in"] == ("760", "725", "", "", "", "", "")
    assert rows["0.1 in"] == ("125", "260", "790", "780", "800", "520", "260")
    assert rows["most over 1 mm, computed"][5] == "184"
    assert rows["most over 1 mm, printed"][5] == "122"


def test_sensor_table_judges_as_d8(shown: dict[str, Drawn]) -> None:
    grid = shown["Table 3.2"].body
    assert isinstance(grid, Grid)
    good = {row[0] for row in grid.rows if row[-1] == "meets both"}
    assert good == {"SS495A", "SS495A1", "SS495A2", "SS94B1", "90215"}


def test_budget_table(shown: dict[str, Drawn]) -> None:
    grid = shown["Table 3.3"].body
    assert isinstance(grid, Grid)
    printed = {row[0]: row[2:4] for row in grid.rows}
    assert printed["D2"] == ("1.22 mV/bit", "1.221 mV/bit")
    assert printed["D5"] == ("1.952 um/bit", "1.984 um/bit")


def test_greatest_thickness_bends_as_far_as_it_must(shown: dict[str, Drawn]) -> None:
    """Figure 3.6 (c): the two greatest thicknesses reach 2 mm at 17.5 and 35 gf."""
    load = shown["3.6"].body.axes[2]  # type: ignore[union-attr]
    for line, gf in zip(load.lines[1:3], (17.5, 35.0), strict=True):
        x, y = line.get_data()
        assert np.interp(gf, x, y) == pytest.approx(2.0, rel=1e-9)


def test_slide_by_runs_through_the_middle(shown: dict[str, Drawn]) -> None:
    """Figure 3.7 (b): no field midway between poles of opposite sign, odd about it."""
    slide = shown["3.7"].body.axes[1]  # type: ignore[union-attr]
    x, y = slide.lines[0].get_data()
    np.testing.assert_allclose(y, -y[::-1], atol=1e-9)
    assert y[np.argmin(np.abs(x))] == pytest.approx(0.0, abs=1e-9)
    assert np.all(np.diff(y) >= 0.0)
