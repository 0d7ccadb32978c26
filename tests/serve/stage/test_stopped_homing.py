"""A homing that ends while the stage presses against the end stop."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from macromicro.control.live import messages as m

from .bed import Bed
from .test_broken import Broken

MACHINES = Path(__file__).parents[3] / "examples" / "machines"


def leaning(bed: Bed) -> float:
    """For how long the stage has stood and pushed, s."""
    return float(bed.machine.leaning())


@pytest.mark.parametrize("slowly", [False, True])  # the first touch, or the second
@pytest.mark.parametrize("name", ["printer", "screw", "disc"])
def test_a_homing_that_is_stopped_while_it_leans_on_the_stop_is_no_fault(
    name: str, slowly: bool
) -> None:
    bed = Broken(MACHINES / f"{name}.toml")  # whole counts: the stage stands between two
    bed.ask(m.Enable())
    bed.ask(m.Home())
    touch = bed.machine.guide.touch
    while math.isfinite(bed.machine.state.work.stop) != slowly or leaning(bed) <= 0.6 * touch.stand:
        bed.run(1)
    bed.ask(m.Stop())
    bed.run(1)
    assert not bed.fault  # of a motion that looks for no stop, it would be too long
    bed.run(round(0.3 / bed.period))
    end = next(n for n in bed.notices if isinstance(n, m.Finished))
    assert end.outcome == m.STOPPED_BY_REQUEST and "rest" not in end.evidence
    count = bed.machine.state.seen.encoder
    bed.run(round(1.0 / bed.period))
    assert not bed.fault and bed.machine.view().mode == m.STOPPED
    assert leaning(bed) == 0.0
    assert abs(bed.machine.state.seen.encoder - count) <= 5.0  # and nothing pulls it back
