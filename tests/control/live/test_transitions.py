"""The table of transitions is whole: no mode is a trap, every way off is open."""

from __future__ import annotations

import pytest

from macromicro.control import macro
from macromicro.control.live import following
from macromicro.control.live import messages as m
from macromicro.control.live.state import Drive
from macromicro.control.live.transitions import TRANSITIONS, idle

from ...frozen.record import frozen
from .follower import ready

MODES = range(len(m.MODES))


def reached(start: int) -> set[int]:
    found = {start}
    while more := {b for a, b, _ in TRANSITIONS if a in found} - found:
        found |= more
    return found


def test_no_row_twice_and_every_row_known() -> None:
    assert len(set(TRANSITIONS)) == len(TRANSITIONS)
    assert {a for a, _, _ in TRANSITIONS} == {b for _, b, _ in TRANSITIONS} == set(MODES)
    assert all(cause for _, _, cause in TRANSITIONS)


@pytest.mark.parametrize("mode", MODES)
def test_every_mode_can_be_reached_and_left(mode: int) -> None:
    assert mode in reached(m.DISABLED)
    assert m.READY in reached(mode)


def test_every_mode_can_fault_and_every_enabled_one_can_be_switched_off() -> None:
    for mode in set(MODES) - {m.FAULT}:
        assert (mode, m.FAULT, "fault") in TRANSITIONS
    for mode in set(MODES) - {m.FAULT, m.DISABLED}:
        assert (mode, m.DISABLED, "emergency stop") in TRANSITIONS
        assert (mode, m.DISABLED, "disable") in TRANSITIONS


def test_a_fault_is_left_only_by_clearing_it() -> None:
    assert [row for row in TRANSITIONS if row[0] == m.FAULT] == [
        (m.FAULT, m.DISABLED, "fault cleared")
    ]
    assert [row for row in TRANSITIONS if row[0] == m.DISABLED] == [
        (m.DISABLED, m.READY, "enable"),
        (m.DISABLED, m.FAULT, "fault"),
    ]


def test_idle_is_off_with_empty_memories() -> None:
    left = tuple(type(memory)(*[3.0] * len(memory)) for memory in macro.rest(0.0))
    driven = Drive(5.0, 1.0, left, 1.4, True)
    assert idle(driven) == Drive(5.0, 0.0, macro.rest(0.0), 0.0, True)


def test_the_table_is_what_was_agreed_on() -> None:
    frozen("live-transitions", sorted(TRANSITIONS))


def test_a_micro_stage_that_has_followed_has_its_last_set_point_as_its_target() -> None:
    """There a relative move starts."""
    f = ready()
    f.ask(m.Follow("micro", 1.0))
    f.s, _ = following.take_set_point(f.p, f.s, 0.2e-3, 0.0, 0.0)
    f.ask(m.EndFollow())
    f.until("holding")
    assert f.ends[0].outcome == m.DONE
    assert f.s.target.micro == pytest.approx(0.2e-3, abs=1e-9)
