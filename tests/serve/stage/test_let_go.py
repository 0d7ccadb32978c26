"""A stage whose push ends while its reading stands: nobody knows whether it went on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from tests.serve.stage.bed import Bed

from macromicro.control.live import messages as m
from macromicro.serve.stage._machine import NO_MOTION

PRINTER = Path(__file__).parents[3] / "examples" / "machines" / "printer.toml"


@pytest.fixture
def homed() -> Bed:
    bed = Bed(PRINTER)
    bed.ask(m.Enable())
    bed.run(2)
    bed.end(m.Home())
    bed.end(m.MoveTo(0.05))
    return bed


def leaning(bed: Bed, seconds: list[float]) -> None:
    """What the guard says of the push, period by period, while the stage stands."""
    said = iter(seconds)
    bed.machine.leaning = lambda: next(said, 0.0)
    bed.run(len(seconds) + 2)


def lost(bed: Bed) -> list[Any]:
    return [n for n in bed.notices if getattr(n, "cause", "") == NO_MOTION]


def test_a_push_without_motion_that_is_let_go_ends_trust(homed: Bed) -> None:
    reveal = homed.machine.guide.touch.reveal
    leaning(homed, [0.5 * reveal, reveal + 1e-3, 0.0])
    assert lost(homed) and homed.machine.view().trusted == 0.0


def test_a_free_stage_may_need_so_long_to_show_motion(homed: Bed) -> None:
    leaning(homed, [0.5 * homed.machine.guide.touch.reveal, homed.machine.guide.touch.reveal, 0.0])
    assert not lost(homed) and homed.machine.view().trusted == 1.0


def test_a_stage_that_moved_at_last_is_known(homed: Bed) -> None:
    homed.ask(m.MoveTo(0.08))
    leaning(homed, [0.2] * 100)  # it goes on meanwhile, whatever the guard says
    assert not lost(homed) and homed.machine.view().trusted == 1.0
