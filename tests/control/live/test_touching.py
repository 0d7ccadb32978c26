"""Homing of a stage that is led: the stop that is met twice at one place names it."""

from __future__ import annotations

import math

import pytest

from macromicro.control.live import messages as m
from macromicro.control.live.state import Frame
from macromicro.motion import s_curve

from .led import LIMITS, PITCH, TOUCH, enabled


@pytest.mark.parametrize("raw", [0.0, 0.0123, -0.04])
def test_homing_names_the_place_of_the_stop(raw: float) -> None:
    stage = enabled(touch=TOUCH, place=0.03, raw=raw)
    stage.wall = TOUCH.place
    end = stage.end(m.Home())
    assert end.outcome == m.DONE
    assert end.position == pytest.approx(LIMITS.whole_low, abs=2 * PITCH)
    assert stage.place == pytest.approx(LIMITS.whole_low, abs=2 * PITCH)
    assert stage.s.frame.trusted and stage.s.frame.offset == pytest.approx(-raw / PITCH, abs=1.0)
    stage.run(1)
    assert stage.course.low + stage.raw == pytest.approx(-0.008, abs=PITCH)
    assert stage.course.effort == math.inf
    causes = [n.cause for n in stage.notices if isinstance(n, m.Event)]
    assert causes.count("end stop found") == 1 and causes.count("end stop confirmed") == 1
    offset, stop = round(-raw / PITCH), round((TOUCH.place - raw) / PITCH)
    found = end.evidence
    assert found["offset_raw_counts"] == pytest.approx(offset, abs=1.0)
    assert found["stop_raw_counts"] == pytest.approx(stop, abs=1.0)
    # It had taken the place of its first reading for 0.
    first = round((0.03 - raw) / PITCH)
    assert found["shift_counts"] == pytest.approx(offset - first, abs=1.0)
    # Another number than before for the law that had pushed against the stop, twice.
    assert stage.course.restart == 3
    assert stage.end(m.MoveTo(0.05)).position == pytest.approx(0.05, abs=1e-9)


def test_what_gives_way_between_two_touches_is_no_stop() -> None:
    stage = enabled(touch=TOUCH, place=0.03)
    stage.wall = 0.01
    stage.ask(m.Home())
    while not any(getattr(n, "cause", "") == "end stop found" for n in stage.notices):
        stage.run(1)
    touched = stage.place
    stage.wall, farthest = TOUCH.place, touched
    while stage.place > touched - 1e-3:
        stage.run(1)
        farthest = max(farthest, stage.place)
    # It backs off, and comes again slowly.
    assert farthest == pytest.approx(touched + TOUCH.back, abs=2e-4)
    assert stage.course.aim.velocity == pytest.approx(-TOUCH.slow)
    while stage.s.mode == m.HOMING:
        stage.run(1)
    assert stage.s.frame.offset == pytest.approx(0.0, abs=1.0)
    causes = [getattr(n, "cause", "") for n in stage.notices]
    assert causes.count("end stop found") == 2 and "end stop confirmed" in causes


def test_homing_that_finds_nothing_stalls() -> None:
    stage = enabled(touch=TOUCH._replace(patience=0.5))
    end = stage.end(m.Home())
    assert end.outcome == m.STALLED and not stage.s.frame.trusted


def test_an_obstacle_farther_down_than_the_first_is_no_stop_either() -> None:
    """Above or below: only what is met twice at the same place is the stop."""
    stage = enabled(touch=TOUCH, place=0.03)
    stage.ask(m.Home())
    for wall in (0.01, 0.008, TOUCH.place):
        stage.wall = wall
        events = len(stage.notices)
        while not any("end stop" in getattr(n, "cause", "") for n in stage.notices[events:]):
            stage.run(1)
        assert stage.notices[-1].cause == "end stop found"
    while stage.s.mode == m.HOMING:
        stage.run(1)
    assert stage.s.frame.offset == pytest.approx(0.0, abs=1.0)


def test_a_stage_that_creeps_has_not_met_a_stop() -> None:
    stage = enabled(touch=TOUCH, place=0.03)
    stage.ask(m.Home())
    stage.wall = 0.02
    for _ in range(1500):  # more than `give` within `stand`, though it holds the set point back
        stage.wall -= 2.0 * TOUCH.give / TOUCH.stand * 1e-3
        stage.run(1)
    assert stage.course.aim.position == pytest.approx(stage.place - TOUCH.lead, abs=2e-5)
    assert not any("end stop" in getattr(n, "cause", "") for n in stage.notices)


def test_it_stands_for_its_time_before_it_is_believed() -> None:
    stage = enabled(touch=TOUCH, place=0.03)
    stage.wall = 0.02
    stage.ask(m.Home())
    while stage.place > 0.02 + 1e-9:
        stage.run(1)
    before = stage.tick
    while stage.notices[-1].cause != "end stop found":
        stage.run(1)
    # The set point has to get ahead first, which takes lead / speed.
    took = (stage.tick - before) * 1e-3
    assert took == pytest.approx(TOUCH.lead / TOUCH.speed + TOUCH.stand, abs=0.01)
    # Then it rests where it is, under a law that has forgotten the push.
    assert stage.course.aim.position == pytest.approx(0.02) and stage.course.restart == 2
    assert stage.fastest == pytest.approx(TOUCH.speed)


def test_a_search_begins_anew_where_it_was_stopped() -> None:
    stage = enabled(touch=TOUCH, place=0.03)
    stage.ask(m.Home())
    stage.wall = 0.02
    while stage.g.since == 0.0 or stage.place > 0.02:
        stage.run(1)
    stage.ask(m.Stop())
    stage.run(200)
    assert stage.s.motion is None
    stage.ask(m.Home())
    stage.wall = TOUCH.place
    while stage.s.mode == m.HOMING:
        stage.run(1)
    assert stage.s.frame.trusted and stage.s.frame.offset == pytest.approx(0.0, abs=1.0)


def test_the_ways_of_a_homing_take_as_long_as_its_speeds_say() -> None:
    """Back and out at the speed of the search; it has rested before it goes on."""
    stage = enabled(touch=TOUCH, place=0.03)
    dwell = 0.2
    stage.q = stage.q._replace(arrival=stage.q.arrival._replace(dwell=dwell))
    stage.wall = TOUCH.place
    stage.run(5000)
    stage.ask(m.Home())

    def until(cause: str) -> float:
        began = stage.tick
        while not any(getattr(n, "cause", "") == cause for n in stage.notices):
            stage.run(1)
        return (stage.tick - began) * 1e-3

    def takes(way: float) -> float:
        q = stage.q
        return s_curve(way, TOUCH.speed, q.acceleration, q.jerk, start=0.0).duration

    until("end stop found")
    touched = until("end stop confirmed")
    # Back, rest, down again from standing, ahead of the stage, and the stand against the stop.
    down = TOUCH.back / TOUCH.slow + TOUCH.lead / TOUCH.slow + TOUCH.stand
    assert touched == pytest.approx(takes(TOUCH.back) + dwell + down, abs=0.02)
    left = until("homed")
    assert left == pytest.approx(takes(LIMITS.whole_low - TOUCH.place) + dwell, abs=0.004)
    offset = stage.s.frame.offset
    assert stage.s.frame == Frame(offset, 0.0, True, 0.0, named=True)


def test_a_search_is_given_its_patience_from_its_begin() -> None:
    stage = enabled(touch=TOUCH._replace(patience=0.5))
    stage.run(1000)
    began = stage.tick
    assert stage.end(m.Home()).outcome == m.STALLED
    # Then it comes to rest from 50 mm/s.
    assert (stage.tick - began) * 1e-3 == pytest.approx(0.5 + 0.025, abs=0.02)


def test_a_stage_that_hangs_behind_its_set_point_is_watched_for_the_whole_stand() -> None:
    stage = enabled(touch=TOUCH, place=0.03)
    stage.wall = TOUCH.place
    stage.end(m.Home())
    stage.run(10)
    stage.stuck = True
    ahead = stage.g.aim.position + 2.0 * TOUCH.lead
    stage.g = stage.g._replace(aim=stage.g.aim._replace(position=ahead))
    before, seen = stage.tick, len(stage.notices)
    stage.ask(m.Home())
    while not any("end stop" in getattr(n, "cause", "") for n in stage.notices[seen:]):
        stage.run(1)
    assert (stage.tick - before) * 1e-3 >= TOUCH.stand


@pytest.mark.parametrize(
    ("stuck", "leaning", "found"),
    [(True, 0.0189, 0), (True, 0.02, 1), (False, 0.021, 0), (False, 0.0989, 0), (False, 0.1, 1)],
)
def test_a_push_is_a_stop_at_once_where_nothing_has_moved(
    stuck: bool, leaning: float, found: int
) -> None:
    """A stage that has moved on this way is pushed for the whole stand; the set point need not
    have got ahead of either."""
    assert TOUCH.stand == 0.1
    stage = enabled(touch=TOUCH._replace(reveal=0.02), place=0.03)
    stage.stuck = stuck
    stage.ask(m.Home())
    stage.run(5 if stuck else 100)
    assert stuck or stage.place < 0.03 - 10.0 * TOUCH.give
    stage.g = stage.g._replace(leaning=leaning)
    stage.run(1)
    causes = [getattr(n, "cause", "") for n in stage.notices]
    assert causes.count("end stop found") == found
