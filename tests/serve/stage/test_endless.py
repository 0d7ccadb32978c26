"""A served axis that turns on: its place from where it is switched on, or from a mark of a turn."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from tests.serve.stage.test_lines import Bed

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Refused

TURN = 2.0 * math.pi
START = 'machine = "rotary"\n[load]\nends = "none"\n[travel]\nlow = "-20 turn"\nhigh = "20 turn"\n'
MARK = START + '[encoder]\nat = "load"\ncounts = 40000\nindex_pulse = "mark"\n'


def bed(folder: Path, text: str) -> Bed:
    file = folder / "endless.toml"
    file.write_text(text, encoding="utf-8")
    return Bed(file)


@pytest.mark.slow
def test_it_moves_turn_after_turn_without_a_homing(tmp_path: Path) -> None:
    one = bed(tmp_path, START)
    assert not one.machine.searches
    assert isinstance(one.ask(m.Home()), Refused)
    assert isinstance(one.ask(m.Enable()), Accepted)
    for turns in (5.25, -3.0):
        assert one.end(m.MoveTo(turns * TURN)).outcome == m.DONE and one.fault is None
        assert one.rig._states[0].x == pytest.approx(turns * TURN, abs=1e-3)  # no lines: the axis'
    assert isinstance(one.ask(m.MoveTo(21.0 * TURN)), Refused)


@pytest.mark.slow
def test_a_mark_names_its_place_and_it_stays_there(tmp_path: Path) -> None:
    one = bed(tmp_path, MARK)
    assert isinstance(one.ask(m.Enable()), Accepted)
    assert isinstance(one.ask(m.MoveTo(TURN)), Refused)  # not homed
    end = one.end(m.Home())
    assert end.outcome == m.DONE and one.fault is None, end
    at = one.place / TURN  # which of the marks it was is not known, nor asked
    assert at == pytest.approx(round(at), abs=1e-3) and abs(at) < 1.5
    assert one.end(m.MoveTo(2.5 * TURN)).outcome == m.DONE
    assert one.place / TURN == pytest.approx(round(at) + 2.5, abs=1e-3)
