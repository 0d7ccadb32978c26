"""Figure 6.6: the laser's noise, at rest and in the loop."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tests.thesis.ended import collected

from macromicro.thesis.chapter6 import laser_noise
from macromicro.thesis.chapter6.laser_noise import LaserRuns
from macromicro.thesis.contents import find

PROCEDURE = find("laser-noise")


@pytest.fixture(scope="module")
def runs() -> LaserRuns:
    made: LaserRuns = collected("laser-noise")
    return made


@pytest.fixture(scope="module")
def axes(runs: LaserRuns) -> list[Any]:
    drawn = PROCEDURE.figures["6.6"](runs)
    assert not isinstance(drawn.body, str | tuple)
    return list(drawn.body.axes)


def test_ten_seconds_with_no_peak_lost(runs: LaserRuns, axes: list[Any]) -> None:
    """Claim I5: thinned, the curve keeps the amplitude of the record's first 10 s."""
    t, y = axes[0].get_lines()[0].get_data()
    assert 9.9 < t[-1] - t[0] <= 10.0
    assert laser_noise.amplitude(y) == laser_noise.amplitude(runs.rest["laser"][:10_000])
    assert [line.get_ydata()[0] for line in axes[0].get_lines()[1:]] == [-2.0, 2.0]


def test_worst_holds_are_shown(runs: LaserRuns, axes: list[Any]) -> None:
    """Claim I7: each panel shows the noisiest hold of its gains."""
    for ax, held in ((axes[1], runs.calmer), (axes[2], runs.printed)):
        worst = max(laser_noise.last_window(r) for r in held)
        shown = ax.get_lines()[0].get_ydata()
        assert laser_noise.amplitude(shown) == pytest.approx(worst)
        assert np.abs(shown).max() < ax.get_ylim()[1]


def test_every_record_has_its_mark(runs: LaserRuns, axes: list[Any]) -> None:
    counts = {x.get_label(): len(x.get_ydata()) for x in axes[3].get_lines()[:3]}
    assert counts == {"at rest": 5, "Ki = 10": 15, "Ki = 30": 15}
