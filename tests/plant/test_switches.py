"""Switches trip at their place, let go behind their hysteresis, and scatter; index pulses."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.plant import switches
from macromicro.plant.switches import Contact, Index, Switch

FREE = Contact(0.0, 0.0)
LOW = Switch(1, 1.0, -2e-3, math.inf, 50e-6, 5e-6)
HIGH = Switch(1, -1.0, 3e-3, math.inf, 50e-6, 5e-6)
CAM = Switch(1, 1.0, 10e-3, 2e-3, 50e-6, 5e-6)


def along(p, places, draw=0.0, s=FREE):
    found = []
    for x in places:
        s = switches.moved(p, s, x, draw)
        found.append(s.on)
    return found


@pytest.mark.parametrize(("p", "sign"), [(LOW, 1.0), (HIGH, -1.0)])
def test_a_limit_switch_trips_at_its_place_and_lets_go_behind_its_hysteresis(p, sign):
    places = [p.place + sign * d for d in (1e-3, 1e-9, -1e-9, -1.0, 49e-6, 51e-6, 1e-9)]
    assert along(p, places) == [0, 0, 1, 1, 1, 0, 0]


def test_a_cam_is_on_over_its_width_and_its_hysteresis():
    down = [13e-3, 10.001e-3, 9.999e-3, 8.001e-3, 7.951e-3, 7.949e-3]
    assert along(CAM, down) == [0, 0, 1, 1, 1, 0]
    up = [7.999e-3, 8.001e-3, 10.049e-3, 10.051e-3]
    assert along(CAM, up) == [0, 1, 1, 0]


def test_what_is_not_there_reads_nothing():
    assert along(LOW._replace(there=0), [0.0, -1.0]) == [0, 0]


@pytest.mark.parametrize(("p", "sign"), [(LOW, 1.0), (HIGH, -1.0)])
def test_it_trips_at_another_place_each_time_drawn_when_it_lets_go(p, sign):
    on = switches.moved(p, FREE, p.place - sign * 1e-3, 3.0)
    assert on == Contact(1.0, 0.0)  # nothing is drawn on the way in
    off = switches.moved(p, on, p.place + sign * 1e-3, 2.0)
    assert off == Contact(0.0, pytest.approx(10e-6))
    assert switches.moved(p, off, p.place + sign * 2e-3, 5.0) == off  # nor while it is free
    # 10 um before its place now, and it lets go as much earlier or later.
    near = [p.place + sign * d for d in (10.1e-6, 9.9e-6, 59e-6, 61e-6)]
    assert along(p, near, s=off) == [0, 1, 1, 0]


TURNS = Index(1, 0.3e-3, 2e-3)
MARK = Index(1, 0.3e-3, 0.0)


@pytest.mark.parametrize(
    ("before", "after", "found"),
    [
        (0.0, 0.29e-3, math.nan),
        (0.29e-3, 0.31e-3, 0.3e-3),
        (0.31e-3, 0.29e-3, 0.3e-3),
        (0.31e-3, 2.29e-3, math.nan),
        (0.31e-3, 4.5e-3, 4.3e-3),  # the last one up
        (4.5e-3, 0.31e-3, 2.3e-3),  # the last one down
        (-1.69e-3, -1.71e-3, -1.7e-3),
    ],
)
def test_pulses_of_turns(before, after, found):
    assert switches.passed(TURNS, before, after) == pytest.approx(found, nan_ok=True)


@given(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1))
def test_a_mark_is_passed_either_way_and_no_other(before, after):
    found = switches.passed(MARK, before, after)
    crossed = min(before, after) < 0.3e-3 <= max(before, after)
    assert (found == 0.3e-3) if crossed else math.isnan(found)
    assert math.isnan(switches.passed(MARK._replace(there=0), before, after))


@given(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1))
def test_the_last_pulse_is_on_the_way_and_within_a_turn_of_its_end(before, after):
    found = switches.passed(TURNS, before, after)
    if math.isnan(found):
        assert abs(after - before) <= 2e-3 + 1e-12
    else:
        assert min(before, after) - 1e-12 <= found <= max(before, after) + 1e-12
        assert abs(found - after) <= 2e-3 + 1e-12
        turn = (found - 0.3e-3) / 2e-3
        assert turn == pytest.approx(round(turn), abs=1e-9)
