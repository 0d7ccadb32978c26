"""Relative moves of machines of one stage: their sum is the sum of the steps."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from tests.serve.group.bed import Bed as Two

from macromicro.control.live import messages as m

from .bed import Bed

MACHINES = Path(__file__).parents[3] / "examples" / "machines"
STEPS = 12


@pytest.mark.parametrize(
    ("name", "to", "by"),
    [("stage", 5e-3, 13.7e-6), ("disc", 0.5, 1.37e-3), ("piezo-100um", 5e-5, 1.37e-6)],
)
def test_steps_add_up(name: str, to: float, by: float) -> None:
    """A step is no whole number of counts, and a stage stops anywhere within its tolerance."""
    bed = Bed(MACHINES / f"{name}.toml")
    bed.ask(m.Enable())
    if bed.machine.searches:
        bed.end(m.Home())
    bed.end(m.MoveTo(to))
    assert bed.machine.view().target == to
    for _ in range(STEPS):
        bed.end(m.MoveBy(by))
    assert bed.machine.view().target == pytest.approx(to + STEPS * by, abs=1e-12)
    aim = bed.machine.aim - bed.machine.state.frame.offset * bed.pitch
    assert aim == pytest.approx(to + STEPS * by, abs=0.51 * bed.pitch)
    bed.end(m.MoveMacroBy(10))
    assert bed.machine.state.target.macro == pytest.approx(
        (to + STEPS * by) / bed.pitch + 10, abs=1
    )


@pytest.mark.parametrize(
    "request_", [m.MovePointBy({"x": 17.3e-6, "y": -17.3e-6}), m.MoveAxisBy("x", 17.3e-6)]
)
def test_steps_of_two_axes_add_up(request_: Any) -> None:
    bed = Two()
    bed.done(m.MovePoint({"x": 0.03, "y": 0.04}))
    for _ in range(STEPS):
        bed.done(request_)
    assert bed.pair.view().target == pytest.approx(0.03 + STEPS * 17.3e-6, abs=1e-12)
    moved = isinstance(request_, m.MovePointBy)
    assert bed.pair.views()[1].target == pytest.approx(0.04 - moved * STEPS * 17.3e-6, abs=1e-12)


def test_one_of_two_axes_that_replaces_another_adds_to_it() -> None:
    """Whose target is known while the first one is still being slowed down."""
    bed = Two()
    bed.done(m.MovePoint({"x": 0.03, "y": 0.04}))
    bed.ask(m.MovePointBy({"x": 0.01, "y": 0.01}))
    bed.run(100)
    assert isinstance(bed.ask(m.MovePointBy({"x": 0.01, "y": 0.0}, replace=True)), m.Accepted)
    for _ in range(2):
        assert bed.pair.view().target == pytest.approx(0.05, abs=1e-12)
        assert bed.pair.views()[1].target == pytest.approx(0.05, abs=1e-12)
        bed.run(60000, to_end=True)
