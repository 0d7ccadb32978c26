"""A noisy encoder: the live machine counts more coarsely, on a rig as on a simulated stage."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from tests.serve.group.bed import Bed as Both
from tests.serve.stage.bed import Bed
from tests.serve.stage.test_lines import EXAMPLES, written

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted
from macromicro.serve.stage.rig import as_counts, shared_out

NOISY = 'noise = "5 um"\n'  # of 0.4 counts


@pytest.mark.parametrize("real", [False, True])
def test_a_piezo_stage_is_where_it_was_sent(real: bool) -> None:
    bed = Bed(EXAMPLES / "piezo-100um.toml", real=real)
    assert bed.pitch > 10.0 * bed.tree.encoder.pitch
    assert isinstance(bed.ask(m.Enable()), Accepted)
    assert bed.end(m.MoveTo(20e-6)).outcome == m.DONE
    near = pytest.approx(20e-6, abs=bed.tree.arrival.tolerance)
    assert bed.machine.view().position == near
    if real:
        assert bed.twin._measured(0.0) == near


@pytest.mark.parametrize("real", [False, True])
def test_an_index_pulse_is_told_in_the_same_counts(tmp_path: Path, real: bool) -> None:
    bed = Bed(written(tmp_path, "home+index", more=NOISY), real=real)
    assert bed.pitch > 3.0 * bed.tree.encoder.pitch
    assert isinstance(bed.ask(m.Enable()), Accepted)
    end = bed.end(m.Home())
    assert end.outcome == m.DONE and end.evidence["offset_raw_counts"] == 0.0


def test_of_two_rigs_each_in_its_own(tmp_path: Path) -> None:
    (tmp_path / "xy.toml").write_text(f'machine = "xy"\n[y.encoder]\n{NOISY}')
    bed = Both(tmp_path / "xy.toml", real=True)
    x, y = bed.settings.lives
    assert x.pitch < 0.5 * y.pitch
    assert bed.done(m.MovePoint({"x": 0.05, "y": 0.03})).outcome == m.DONE
    assert bed.place == pytest.approx((0.05, 0.03), abs=3.0 * y.pitch)
    x_twin, y_twin = (twin._measured(0.0) for twin in bed.twins)
    assert (x_twin, y_twin) == pytest.approx((0.05, 0.03), abs=3.0 * y.pitch)


def test_counts_are_whole_and_what_is_not_known_stays_so() -> None:
    assert shared_out(10.25, 1.0) == 10.25 and shared_out(10.0, 0.26) == 3.0
    assert math.isnan(shared_out(math.nan, 0.5)) and math.isnan(as_counts(0.0, math.nan).encoder)
    assert as_counts(1.0, -2.5)[:2] == (1.0, -2.0)
