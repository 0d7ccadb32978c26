"""A stage that is led: moves, stops, jogs, over a stage that follows its set point."""

from __future__ import annotations

import math

import pytest

from macromicro.control.live import guided, state
from macromicro.control.live import messages as m
from macromicro.control.live.leading import Aim, Course, Seek
from macromicro.control.live.messages import Accepted, Finished, Refused
from macromicro.control.live.state import Search
from macromicro.motion import s_curve

from .led import PITCH, TOUCH, Stage, enabled


def test_it_is_off_until_it_is_enabled_and_then_held_where_it_is() -> None:
    stage = Stage(place=0.02)
    stage.run(5)
    assert not stage.course.on
    stage.ask(m.Enable())
    stage.run(5)
    assert stage.course.on and stage.s.mode == m.READY
    assert stage.course.aim == (0.02, 0.0, 0.0, 0.0)
    assert (stage.course.low, stage.course.high) == (-0.008, 0.108)
    before = stage.course.restart
    stage.ask(m.Disable())
    stage.run(3)
    assert stage.course == Course()
    stage.ask(m.Enable())
    stage.run(1)
    assert stage.course.restart == before + 1  # a law that was off begins anew


def test_a_move_arrives_within_the_limits_and_is_held() -> None:
    stage = enabled()
    end = stage.end(m.MoveTo(0.05))
    assert end.outcome == m.DONE and end.position == pytest.approx(0.05, abs=1e-9)
    assert 0.15 < stage.fastest <= 0.2000001
    assert abs(end.evidence["error_um"]) <= 30.0
    stage.run(100)
    assert stage.course.on and stage.course.aim.position == pytest.approx(0.05)
    assert stage.end(m.MoveBy(-0.01)).position == pytest.approx(0.04, abs=1e-9)
    modes = [n.to_mode for n in stage.notices if isinstance(n, m.Event) and n.kind == "mode"]
    assert modes[:4] == ["ready", "moving-macro", "settling", "ready"]


def test_a_stage_that_does_not_follow_has_stalled_after_its_patience() -> None:
    stage = enabled()
    stage.stuck = True
    end = stage.end(m.MoveTo(0.01))
    assert end.outcome == m.STALLED and end.evidence["error_um"] == pytest.approx(1e4)
    # 10 mm take 0.16 s, then the patience for the arrival. Behind it nothing pushes any more.
    assert end.evidence["seconds"] == pytest.approx(0.66, abs=0.02)
    assert stage.tick * 1e-3 == pytest.approx(0.66 + 0.01, abs=0.02)
    assert stage.s.mode == m.STOPPED
    assert stage.course.on and stage.course.aim.position == stage.place


def test_a_stage_that_heats_is_let_go_when_it_is_stopped() -> None:
    """Not held, and not braked for: its effort is off until the next motion."""
    stage = enabled()
    stage.q = stage.q._replace(heats=True)
    assert stage.end(m.MoveTo(0.01)).outcome == m.DONE
    stage.run(10)
    assert stage.course.on  # where it has arrived it is held
    stage.ask(m.MoveTo(0.05))
    stage.run(100)
    assert stage.ask(m.Stop()) == Accepted(0)
    stage.run(3)
    assert stage.s.mode == m.STOPPED and stage.s.motion is None and not stage.course.on
    assert stage.end(m.MoveTo(0.02)).outcome == m.DONE
    assert stage.course.on


@pytest.mark.parametrize("seconds", [0.0, 0.029, 0.031])
def test_a_jog_that_is_blocked_ends_once_a_free_stage_had_moved(seconds: float) -> None:
    stage = enabled(touch=TOUCH._replace(reveal=0.03))
    stage.ask(m.Jog(m.MACRO, 0.05))
    stage.run(50)
    stage.g = stage.g._replace(leaning=seconds)
    stage.run(20)
    ends = [n for n in stage.notices if isinstance(n, Finished)]
    assert [e.outcome for e in ends] == ([m.STALLED] if seconds > 0.03 else [])
    assert not ends or "pushes and the reading does not change" in ends[0].evidence["reason"]


def test_before_the_place_is_known_no_speed_is_allowed_that_was_not_asked_for() -> None:
    stage = enabled(touch=TOUCH)
    stage.ask(m.Jog(m.MACRO, 0.1))
    stage.run(200)
    assert stage.course.leant == math.inf  # without a time of its own: as the settings say
    assert stage.course.speed == pytest.approx(2.0 * 0.05 + 0.25 * stage.q.velocity)
    known = enabled()
    known.ask(m.Jog(m.MACRO, 0.05))
    known.run(50)
    assert known.course.speed == math.inf


@pytest.mark.parametrize(("phase", "allowed"), [(0, 0.2), (1, 0.03), (2, 0.03)])
def test_a_stage_that_leaves_the_stop_must_move_sooner_than_one_that_leans(
    phase: int, allowed: float
) -> None:
    touch = TOUCH._replace(reveal=0.03)
    work = Search(phase, 0.0, 0.0, math.nan)
    assert guided.leans(touch, work) == pytest.approx(allowed)
    assert guided.leans(touch, None) == pytest.approx(0.13)
    seek = Seek("home", above=False, pulse=False, spacing=0.0, margin=1e-4, rise=0.01)
    assert guided.leans(touch._replace(seek=seek), work) == pytest.approx(0.2)


def test_a_stop_decelerates_and_the_stage_is_held() -> None:
    stage = enabled()
    assert isinstance(stage.ask(m.MoveTo(0.1)), Accepted)
    stage.run(250)
    assert stage.s.mode == m.MOVING_MACRO and stage.course.aim.velocity == pytest.approx(0.2)
    at_stop = stage.place
    stage.ask(m.Stop())
    stage.run(130)
    assert stage.s.mode == m.STOPPED and stage.s.motion is None
    way = stage.place - at_stop
    assert way == pytest.approx(0.2**2 / (2.0 * 2.0), rel=0.05)
    ends = [n for n in stage.notices if isinstance(n, Finished)]
    assert [e.outcome for e in ends] == [m.STOPPED_BY_REQUEST]
    assert ends[0].evidence["way_counts"] == pytest.approx(way / PITCH, abs=30.0)
    stage.run(50)
    assert stage.course.on and stage.course.aim.velocity == 0.0


@pytest.mark.parametrize(("speed", "limit"), [(0.1, 0.1), (-0.1, -0.005)])
def test_a_jog_ends_at_its_soft_limit(speed: float, limit: float) -> None:
    stage = enabled()
    end = stage.end(m.Jog(m.MACRO, speed))
    assert end.outcome == m.LIMIT
    assert stage.place == pytest.approx(limit, abs=2e-4) and abs(stage.place) <= abs(limit) + 1e-5
    assert isinstance(stage.ask(m.Jog(m.MACRO, 0.11)), Refused)


def test_a_jog_ends_when_it_is_asked_to() -> None:
    stage = enabled()
    assert isinstance(stage.ask(m.Jog(m.MACRO, 0.05)), Accepted)
    stage.run(300)
    assert stage.course.aim.velocity == pytest.approx(0.05)
    stage.ask(m.Jog(m.MACRO, 0.02))
    stage.run(100)
    assert stage.course.aim.velocity == pytest.approx(0.02)
    stage.ask(m.Jog(m.MACRO, 0.0))
    stage.run(100)
    assert stage.s.mode == m.STOPPED and stage.s.motion is None


def test_without_its_place_it_creeps_gently_and_stalls_at_an_obstacle() -> None:
    stage = enabled(touch=TOUCH, raw=0.003)
    assert stage.course.effort == 1.5 and stage.course.low == -math.inf
    assert isinstance(stage.ask(m.MoveTo(0.01)), Refused)
    stage.wall = -0.002
    end = stage.end(m.Jog(m.MACRO, -0.05))
    assert end.outcome == m.STALLED
    # It is let go: the set point has not stayed behind the wall.
    assert stage.course.aim.position + stage.raw == pytest.approx(-0.002, abs=PITCH)


def test_a_missing_reading_before_the_first_one_moves_nothing() -> None:
    stage = Stage(touch=TOUCH)
    stage.s = state.begin(stage.p)
    assert isinstance(stage.ask(m.Enable()), Refused) and not stage.course.on


@pytest.mark.parametrize("raw", [0.0123, -0.04])
def test_a_homed_stage_has_its_limits_in_its_own_frame(raw: float) -> None:
    stage = enabled(touch=TOUCH, place=0.01, raw=raw)
    stage.wall = TOUCH.place
    assert stage.end(m.Home()).outcome == m.DONE
    stage.run(1)
    assert stage.course.low + raw == pytest.approx(-0.008, abs=PITCH)
    assert stage.course.high + raw == pytest.approx(0.108, abs=PITCH)
    for speed, limit in ((0.1, 0.1), (-0.1, -0.005)):
        began = stage.tick
        end = stage.end(m.Jog(m.MACRO, speed))
        assert end.outcome == m.LIMIT and stage.place == pytest.approx(limit, abs=2e-4)
        # It slows down no sooner than its deceleration needs.
        assert (stage.tick - began) * 1e-3 < 0.105 / 0.1 + 0.1 / 2.0 + 0.2


def test_an_untrusted_jog_is_braked_before_it_is_let_go() -> None:
    stage = enabled(touch=TOUCH)
    assert isinstance(stage.ask(m.Jog(m.MACRO, 0.05)), Accepted)
    stage.run(300)
    before, place = stage.course.restart, stage.place
    stage.ask(m.Stop())
    stage.run(10)
    assert 0.02 < stage.course.aim.velocity < 0.05
    stage.run(200)
    assert stage.s.motion is None and stage.course.restart == before
    assert stage.place - place == pytest.approx(0.05**2 / (2.0 * 2.0), rel=0.2)


def test_what_leaned_on_something_is_let_go_once() -> None:
    stage = enabled(touch=TOUCH, raw=0.003)
    stage.wall = -0.002
    before = stage.course.restart
    assert before == 1
    assert stage.end(m.Jog(m.MACRO, -0.05)).outcome == m.STALLED
    assert stage.course.restart == before + 1


def test_a_set_point_without_work_comes_to_rest() -> None:
    stage = enabled()
    stage.g = stage.g._replace(aim=Aim(0.0, 0.1, 0.0, 0.0))
    stage.run(200)
    assert stage.s.mode == m.READY and stage.course.aim.velocity == 0.0
    assert stage.course.aim.position == pytest.approx(0.1**2 / (2.0 * 2.0), rel=0.05)


def test_a_move_tells_how_long_it_took() -> None:
    stage = enabled()
    stage.run(700)
    end = stage.end(m.MoveTo(0.05))
    q = stage.q
    takes = s_curve(0.05, q.velocity, q.acceleration, q.jerk, start=0.0).duration
    took = takes + q.arrival.dwell
    assert end.evidence["seconds"] == pytest.approx(took, abs=3e-3)


def test_a_jog_is_no_slower_towards_its_limit_than_it_can_be_stopped() -> None:
    stage = enabled()
    stage.ask(m.Jog(m.MACRO, 0.1))
    speeds = {}
    while stage.s.mode == m.MOVING_MACRO:
        stage.run(1)
        speeds[round(1e4 * (0.1 - stage.course.aim.position))] = stage.course.aim.velocity
    for left, speed in speeds.items():
        if 3 <= left <= 20:
            # One period's way is kept in hand, and the acceleration lags by a period.
            assert speed == pytest.approx(math.sqrt(2.0 * 2.0 * left * 1e-4), rel=0.1)


def test_a_stop_within_the_tolerance_begins_its_rest_anew() -> None:
    stage = enabled()
    stage.q = stage.q._replace(arrival=stage.q.arrival._replace(dwell=0.2))
    stage.ask(m.MoveTo(0.01))
    while math.isnan(stage.g.inside):
        stage.run(1)
    stage.run(150)
    assert stage.s.mode == m.MOVING_MACRO
    stage.ask(m.Stop())
    stage.run(150)
    assert stage.s.motion is not None
    stage.run(60)
    assert stage.s.motion is None
