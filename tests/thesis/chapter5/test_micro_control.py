"""Figures of the micro-stage's control (Sections 5.2.2 and 5.3)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tests.thesis.ended import collected

from macromicro.drawing.exhibit import Drawn
from macromicro.runs import sequence
from macromicro.thesis.chapter5 import micro_runs
from macromicro.thesis.chapter5.micro_runs import MicroRuns
from macromicro.thesis.contents import find

PROCEDURE = find("micro-control")


@pytest.fixture(scope="module")
def runs() -> MicroRuns:
    made: MicroRuns = collected("micro-control")
    return made


@pytest.fixture(scope="module")
def drawn(runs: MicroRuns) -> dict[str, Drawn]:
    return {n: draw(runs) for n, draw in PROCEDURE.figures.items()}


def axes_of(drawn: Drawn) -> list[Any]:
    """The axes of a figure."""
    assert not isinstance(drawn.body, str | tuple)
    return list(drawn.body.axes)


def labelled(ax: Any, label: str) -> Any:
    """The line of a label."""
    return next(each for each in ax.get_lines() if each.get_label() == label)


def test_stop_shows_the_highest_positions(runs: MicroRuns, drawn: dict[str, Drawn]) -> None:
    """Claims S3, S4: what is plotted is what the claims measure."""
    whole, foot = axes_of(drawn["5.10 (stop)"])
    at_stop = dict(zip(*labelled(whole, "in 20 s").get_data(), strict=True))
    assert at_stop == {
        v: micro_runs.highest(runs.steps[v]) for v in micro_runs.AT_STOP + micro_runs.ABOVE_STOP
    }
    volts = foot.get_lines()[0].get_xdata()
    assert volts.min() < 1.3 < micro_runs.first_response(runs.feet) < volts.max()


def test_zoom_of_the_effort_is_of_the_full_view(drawn: dict[str, Drawn]) -> None:
    """Figure 5.19: (b) shows where CTRL swings, nearer than (a)."""
    full, near, _ = axes_of(drawn["5.19"])
    for axis in ("get_xlim", "get_ylim"):
        (a, b), (c, d) = getattr(full, axis)(), getattr(near, axis)()
        assert a <= c < d <= b
    low = labelled(full, "Kp 10").get_ydata().min()
    assert near.get_ylim()[0] < low == labelled(near, "Kp 10").get_ydata().min()


def test_curves_are_columns(runs: MicroRuns, drawn: dict[str, Drawn]) -> None:
    """Thinning leaves out samples and adds none."""
    effort, place = axes_of(drawn["5.22"])
    recording = runs.integral[0.5]
    shown = labelled(effort, "Ki 0.5").get_ydata()
    assert np.isin(shown, recording["micro_integral"]).all()
    assert shown[-1] == pytest.approx(recording["micro_integral"][-2], abs=1e-2)
    shown = labelled(place, "Ki 0.5").get_ydata()
    assert np.isin(shown, recording["laser"] * 1e-3).all()


def test_gains_that_the_guard_stops_are_named(runs: MicroRuns, drawn: dict[str, Drawn]) -> None:
    """Figure 5.22: Ki 2.25 runs into the stop, and says so."""
    assert runs.integral[2.25].attributes["finished"] == 0
    assert runs.integral[1.0].attributes["finished"] == 1
    assert "With Ki 1.5, 2.25 the stage runs into its stop" in drawn["5.22"].caption


def test_large_gains_oscillate(runs: MicroRuns, drawn: dict[str, Drawn]) -> None:
    """Figure 5.26, Section 5.3.2: 30 is calm, twice as much is not."""
    unrest = {k: micro_runs.unrest(r) for k, r in runs.held_back.items()}
    assert unrest[30.0] < 0.03
    assert 0.1 < unrest[60.0] < unrest[100.0]
    swing = axes_of(drawn["5.26"])[2].get_lines()[0]
    assert list(swing.get_ydata()) == list(unrest.values())


def test_unrest_of_a_run_cut_short_is_unknown(runs: MicroRuns) -> None:
    assert np.isnan(micro_runs.unrest(runs.integral[2.25]))


def test_anti_windup_does_not_wind_up(runs: MicroRuns) -> None:
    """Figure 5.25: with the same Ki, the integral effort rises where that of PI falls."""
    fall = round(sequence.TIMES[2] / runs.pi.dt)
    rows = slice(fall, fall + 100)
    assert np.diff(runs.pi["micro_integral"][rows]).max() < 0.0
    assert np.diff(runs.gentle[2.25]["micro_integral"][rows]).min() > 0.0


def test_final_zoom_shows_the_band_and_every_hold(runs: MicroRuns, drawn: dict[str, Drawn]) -> None:
    """Figure 5.27b: 5 um stand out, and each hold of the sequence ends within the view."""
    _, near, settling, holds = axes_of(drawn["5.27"])
    low, high = near.get_ylim()
    assert low <= -10.0 and high >= 10.0
    dt = runs.antiwindup.dt
    error = runs.antiwindup["laser"] - 1e3 * runs.antiwindup["micro_reference"]
    for end in (3.0, 5.0, 7.0):
        late = error[round((end - 0.5) / dt) : round(end / dt) - 1]
        assert np.abs(late).max() < 5.0
    shown = labelled(settling, "10 um").get_ydata()
    np.testing.assert_array_equal(shown, sequence.settling(runs.antiwindup))
    levels, errors = micro_runs.hold_errors(runs)
    assert len(errors) == 3 * len(micro_runs.HOLDS)
    assert set(np.round(levels, 9)) == set(micro_runs.HOLDS)
    np.testing.assert_array_equal(holds.get_lines()[0].get_ydata(), errors)
    assert micro_runs.worst_hold(runs) == np.abs(errors).max()
