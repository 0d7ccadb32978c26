"""A homing that ends while the stage presses against the end stop."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from tests.serve.stage.bed import Bed

from macromicro.control.live import messages as m
from macromicro.machines import compositions
from macromicro.machines import machine as machines

MACHINES = Path(__file__).parents[3] / "examples" / "machines"


@pytest.fixture
def plotter(tmp_path: Path) -> Path:
    """The axis x of the plotter, whose elastic stop pushes it back."""
    _, machine, tree = compositions.each(MACHINES / "xy-plotter.toml")[0]
    file = tmp_path / "x.toml"
    file.write_text(machines.as_toml(machine, tree), encoding="utf-8")
    return file


def leaning(bed: Bed) -> float:
    """For how long the stage has stood and pushed, s."""
    return float(bed.machine.leaning())


def stopped(file: Path, *, second: bool) -> Bed:
    """A stage whose homing is stopped while it leans on the stop, at the second touch or before."""
    bed = Bed(file)
    bed.ask(m.Enable())
    bed.ask(m.Home())
    touch = bed.machine.guide.touch
    while math.isfinite(bed.machine.state.work.stop) != second or leaning(bed) <= 0.6 * touch.stand:
        bed.run(1)
    bed.ask(m.Stop())
    return bed


def check(bed: Bed) -> None:
    """It comes to rest soon, stays there, and no guard trips."""
    bed.run(round(0.2 / bed.period))
    end = next(n for n in bed.notices if isinstance(n, m.Finished))
    assert end.outcome == m.STOPPED_BY_REQUEST and "rest" not in end.evidence
    there = bed.machine.state.seen.encoder
    bed.run(round(1.0 / bed.period))
    assert not bed.fault and bed.machine.view().mode == m.STOPPED
    assert leaning(bed) == 0.0
    assert abs(bed.machine.state.seen.encoder - there) <= 3.0


@pytest.mark.parametrize("second", [False, True])
@pytest.mark.parametrize("name", ["printer", "screw"])
def test_a_homing_that_is_stopped_against_the_end_stop_is_no_fault(name: str, second: bool) -> None:
    check(stopped(MACHINES / f"{name}.toml", second=second))


@pytest.mark.parametrize("second", [False, True])
def test_nothing_pulls_a_stage_back_to_a_stop_that_pushed_it_away(
    plotter: Path, second: bool
) -> None:
    check(stopped(plotter, second=second))
