"""A stage that is led: moves, stops, jogs, over a stage that follows its set point."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from macromicro.control.live import following as follow
from macromicro.control.live import guided, leading, state
from macromicro.control.live import messages as m
from macromicro.control.live.leading import Aim, Course, Seek
from macromicro.control.live.messages import Accepted, Finished, Refused
from macromicro.control.live.state import Braking, Search, Targets
from macromicro.motion import s_curve

from .led import ABSOLUTE, DT, PITCH, TOUCH, Stage, enabled


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
    assert stage.course == Course(origin=0.0)
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


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize(("search", "most"), [(0.05, 0.05), (0.02, 0.05), (0.08, 0.08)])
def test_before_the_place_is_known_no_speed_is_allowed_that_was_not_asked_for(
    way: float, search: float, most: float
) -> None:
    stage = enabled(touch=TOUCH._replace(speed=search))
    assert isinstance(stage.ask(m.Jog(m.MACRO, 0.05 * way)), Accepted)
    stage.run(200)
    assert stage.course.aim.velocity == pytest.approx(0.05 * way)
    assert stage.course.leant == math.inf  # without a time of its own: as the settings say
    assert stage.course.speed == pytest.approx(2.0 * most + 0.25 * stage.q.velocity)
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


def test_a_stage_that_does_not_come_to_its_set_point_is_let_go_after_its_patience() -> None:
    """One whose place is known is held at the set point until then."""
    stage = enabled()
    stage.stuck = True
    stage.ask(m.MoveTo(0.01))
    stage.run(300)
    before, stopped = stage.course.restart, stage.tick
    stage.ask(m.Stop())
    while stage.s.motion is not None:
        assert stage.course.aim == (0.01, 0.0, 0.0, 0.0) and stage.course.restart == before
        stage.run(1)
    patience = stage.p.settings.brake.patience + stage.q.arrival.patience
    assert (stage.tick - stopped) * 1e-3 == pytest.approx(patience, abs=3e-3)
    (end,) = (n for n in stage.notices if isinstance(n, Finished))
    assert end.outcome == m.STALLED and end.evidence["rest"] == "did not come to rest in time"
    assert stage.course.aim == (stage.place, 0.0, 0.0, 0.0) and stage.course.restart == before + 1


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


def test_one_that_springs_back_from_what_it_leaned_on_is_given_the_time_for_it() -> None:
    stage = enabled(touch=TOUCH, raw=0.003)
    stage.q = stage.q._replace(rubs=True)
    stage.ask(m.Jog(m.MACRO, -0.05))
    stage.run(60)
    stage.ask(m.Stop())
    stage.g = stage.g._replace(leaning=0.05)
    stage.run(1)
    stage.g, leant, stage.stuck = stage.g._replace(leaning=0.0), stage.s.time, True
    while stage.s.work is not None:
        stage.place += 0.5 * PITCH
        stage.run(1)
    assert stage.s.time - leant == pytest.approx(0.1, abs=2.0 * DT)


def test_one_that_knows_its_place_is_held_where_it_stops_whatever_it_leans_on() -> None:
    stage = enabled()
    stage.q = stage.q._replace(rubs=True)
    stage.ask(m.MoveTo(0.05))
    stage.run(100)
    stage.ask(m.Stop())
    stage.g = stage.g._replace(leaning=0.05)
    before = stage.course.restart
    stage.run(20)
    assert stage.course.restart == before and stage.course.aim.velocity > 0.0


HOLD = 0.05
FRAME = 0.03


def following() -> Stage:
    """A stage that follows a client's set points, whose encoder counts from elsewhere."""
    stage = Stage(place=FRAME)
    stage.s = state.begin(stage.p, 0.0, trusted=True)
    stage.run(1)
    assert stage.ask(m.Enable()) == Accepted(0)
    stage.run(2)
    assert stage.ask(m.Follow(m.MACRO, HOLD)) == Accepted(1)
    return stage


def put(stage: Stage, position: float, velocity: float = 0.0, periods: int = 1) -> None:
    for _ in range(periods):
        stage.s, notices = follow.take_set_point(stage.p, stage.s, position, velocity, 0.0)
        stage.notices += notices
        stage.run(1)


def ended(stage: Stage) -> Finished:
    while stage.s.motion is not None:
        stage.run(1)
    return next(n for n in stage.notices if isinstance(n, Finished))


def test_the_last_set_point_is_gone_to_however_long_that_takes() -> None:
    stage = following()
    assert stage.course.origin == pytest.approx(FRAME)
    put(stage, 0.001, periods=200)
    assert stage.place == pytest.approx(FRAME + 0.001, abs=PITCH)
    assert stage.s.motion is not None  # a client may stand
    put(stage, 0.099)
    began = stage.s.time
    assert stage.ask(m.EndFollow()) == Accepted(1)
    end = ended(stage)
    assert end.outcome == m.DONE and stage.s.time - began > ABSOLUTE.arrival.patience
    assert stage.place == pytest.approx(FRAME + 0.099, abs=PITCH)
    assert stage.s.target == Targets(0.099, 9900)
    assert abs(end.evidence["error_um"]) <= 0.5 * PITCH * 1e6


def test_a_stage_that_does_not_come_to_the_last_set_point_has_stalled() -> None:
    stage = following()
    put(stage, 0.001, periods=200)
    stage.stuck = True
    put(stage, 0.002, periods=100)
    assert stage.ask(m.EndFollow()) == Accepted(1)
    began = stage.s.time
    end = ended(stage)
    assert end.outcome == m.STALLED
    # The set point comes to rest first.
    assert 0.0 <= stage.s.time - began - ABSOLUTE.arrival.patience < 0.15
    assert end.evidence["error_um"] == pytest.approx(1000.0, abs=PITCH * 1e6)


def test_without_set_points_it_slows_down_from_where_it_is() -> None:
    stage = following()
    for k in range(200):
        put(stage, 0.05 * k * DT, 0.05)
    while not isinstance(stage.s.work, Braking):
        before = stage.course.aim
        stage.run(1)
    at_once = stage.course.aim
    assert at_once.position == pytest.approx(before.position + 0.05 * DT, rel=1e-3)
    assert 0.0 < at_once.velocity < before.velocity and at_once.acceleration < 0.0


def test_a_jog_without_its_client_slows_down_from_where_it_is() -> None:
    stage = enabled()
    stage.ask(m.Jog(m.MACRO, 0.05, hold=HOLD))
    before = stage.course.aim
    while not isinstance(stage.s.work, Braking):
        before = stage.course.aim
        stage.run(1)
    at_once = stage.course.aim
    assert at_once.position == pytest.approx(before.position + 0.05 * DT, rel=1e-2)
    assert at_once.velocity == before.velocity and at_once.acceleration < 0.0


def test_a_set_point_that_still_moves_comes_to_rest_before_it_follows() -> None:
    stage = following()
    stage.g = stage.g._replace(aim=Aim(stage.place, 0.1, 0.0, 0.0))
    speeds = []
    for _ in range(100):
        put(stage, -0.004)
        speeds.append(stage.course.aim.velocity)
    rests = speeds.index(0.0)
    assert rests > 10 and all(speed > 0.0 for speed in speeds[:rests])
    assert np.abs(np.diff(speeds)).max() <= ABSOLUTE.acceleration * DT * (1.0 + 1e-9)
    assert min(speeds) < 0.0  # and then it goes where it is asked to


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


def rubbing(place: float = 0.05) -> Stage:
    """A stage that friction holds, on a jog; its place can be lost."""
    stage = Stage(place=place)
    stage.q = stage.q._replace(rubs=True)
    stage.s = stage.s._replace(frame=stage.s.frame._replace(carriage=True))
    stage.ask(m.Enable())
    return stage


def dies(speed: float, *, dither: int = 0) -> tuple[Stage, float]:
    """It is stopped in a jog as its reading dies; and the way that its set point still goes."""
    stage, twin = rubbing(), rubbing()
    twin.q = twin.q._replace(rubs=False)  # it is held at its set point
    for each in (stage, twin):
        each.ask(m.Jog(m.MACRO, speed))
        each.run(150)
        each.ask(m.Stop())
    stage.told, stage.dither = stage.place, dither
    stage.run(1)
    asked = stage.g.asked
    stage.run(700)
    twin.run(701)
    return stage, abs(twin.course.aim.position - asked)


def lost(stage: Stage) -> list[Any]:
    return [n for n in stage.notices if getattr(n, "cause", "") == guided.DEAD]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_reading_that_dies_at_a_stop_drives_nothing_and_ends_trust(sign: float) -> None:
    stage, _ = dies(0.1 * sign)
    (end,) = [n for n in stage.notices if isinstance(n, Finished)]
    assert end.outcome == m.STOPPED_BY_REQUEST and "rest" not in dict(end.evidence)
    (event,) = lost(stage)
    assert dict(event.evidence)["trusted"] is False and not stage.s.frame.trusted
    assert stage.course.aim == leading.REST._replace(position=stage.s.seen.encoder * PITCH)
    assert abs(stage.place - stage.told) < 0.1 * 5 * DT  # m/s; it followed until its law began anew


def test_a_reading_counts_as_dead_after_a_quarter_of_the_dwell() -> None:
    stage = rubbing()
    stage.ask(m.Jog(m.MACRO, 0.1))
    stage.run(150)
    stage.ask(m.Stop())
    stage.told = stage.place
    stage.run(1)  # it changes for the last time
    stage.run(2)
    assert not lost(stage)
    stage.run(1)
    assert lost(stage)
    assert stage.course.aim == leading.REST._replace(position=stage.s.seen.encoder * PITCH)


def test_a_stage_may_stop_a_little_short_of_its_set_point() -> None:
    short = 1.5 * ABSOLUTE.arrival.tolerance + 0.5 * ABSOLUTE.acceleration * (2 * DT) ** 2
    ways = []
    for speed in np.linspace(0.008, 0.02, 25):
        stage, way = dies(float(speed))
        assert bool(lost(stage)) == (way > short), (speed, way)
        assert not lost(stage) or stage.course.restart > 0
        ways.append(way)
    near = np.abs(np.array(ways) - short)
    assert min(ways) < short < max(ways) and np.min(near) < 2e-6


def test_it_rests_once_its_reading_has_stood_for_the_dwell() -> None:
    stage = rubbing()
    stage.ask(m.Jog(m.MACRO, 0.0108))
    stage.run(150)
    stage.ask(m.Stop())
    stage.told = stage.place
    periods = 0
    while not any(isinstance(n, Finished) for n in stage.notices):
        stage.run(1)
        periods += 1
    assert stage.notices[-1].outcome == m.STOPPED_BY_REQUEST and stage.s.frame.trusted
    assert stage.course.aim.position == stage.s.seen.encoder * PITCH
    assert periods == 11  # the dwell, which is longer than the braking; not the patience


def test_it_does_not_rest_before_its_set_point_does() -> None:
    stage = rubbing()
    stage.q = stage.q._replace(arrival=stage.q.arrival._replace(tolerance=0.01))
    stage.ask(m.Jog(m.MACRO, 0.1))
    stage.run(150)
    stage.ask(m.Stop())
    stage.told = stage.place
    stage.run(45)  # of the 50 that it slows down for, far longer than the dwell
    assert not any(isinstance(n, Finished) for n in stage.notices)
    stage.run(10)
    assert any(isinstance(n, Finished) for n in stage.notices)


@pytest.mark.parametrize(("dither", "dead"), [(1, True), (2, False)])
def test_a_reading_that_stands_may_dither_by_a_count(dither: int, dead: bool) -> None:
    stage, _ = dies(0.1, dither=dither)
    assert bool(lost(stage)) == dead


def test_a_stage_that_its_law_has_to_hold_is_held_behind_a_stop() -> None:
    stage = Stage(place=0.02)
    stage.ask(m.Enable())
    stage.ask(m.Jog(m.MACRO, 0.1))
    stage.run(150)
    began = stage.course.restart
    stage.ask(m.Stop())
    stage.told = stage.place
    stage.run(300)
    assert not lost(stage) and stage.course.restart == began


def arrived(offset: float, dither: int = 0, *, rubs: bool = True) -> Stage:
    """Behind a move at whose end the reading stands this far short of the target."""
    stage = rubbing()
    stage.q = stage.q._replace(rubs=rubs)
    reply = stage.ask(m.MoveTo(0.03))
    while stage.s.mode != m.READY or stage.s.work is not None:
        if math.isnan(stage.told) and abs(stage.place - 0.03) < 1e-6:
            stage.told, stage.dither = 0.03 - offset, dither
        stage.run(1)
    assert isinstance(reply, Accepted)
    return stage


@pytest.mark.parametrize(("offset", "dither"), [(2e-5, 0), (2e-5, 1), (-2e-5, 0)])
def test_behind_a_move_it_is_let_go_once_where_it_rests(offset: float, dither: int) -> None:
    stage = arrived(offset, dither)
    began = stage.course.restart
    assert stage.course.aim.position == pytest.approx(0.03, abs=1e-12)
    stage.run(30)
    assert stage.course.restart == began + 1
    assert abs(stage.course.aim.position - stage.told) < (dither + 0.5) * PITCH
    stage.told += 2e-5  # whoever pushes it meets its law, which begins anew for nobody
    held = stage.course.aim.position
    stage.run(100)
    assert (stage.course.restart, stage.course.aim.position) == (began + 1, held)


def test_it_is_not_let_go_before_its_law_had_time_to_move_it() -> None:
    stage = arrived(2e-5)
    since, began = stage.g.stood_since, stage.course.restart
    while stage.course.restart == began:
        stage.run(1)
    assert stage.s.time - since == pytest.approx(2.5 * stage.q.arrival.dwell, abs=1.5 * DT)


def test_behind_a_move_one_that_its_law_has_to_hold_is_held() -> None:
    stage = arrived(2e-5, rubs=False)
    began = stage.course.restart
    stage.run(100)
    assert stage.course.restart == began


def test_a_set_point_that_still_slows_down_is_not_let_go() -> None:
    stage = rubbing()
    stage.ask(m.Jog(m.MACRO, 0.1))
    stage.run(150)
    stage.told = stage.place
    stage.run(40)  # the reading stands for longer than it is pushed behind a motion
    stage.s = stage.s._replace(work=None)
    began = stage.course.restart
    stage.run(45)
    assert stage.course.restart == began and stage.course.aim.velocity > 0.0
    stage.run(10)
    assert stage.course.restart == began + 1


@pytest.mark.parametrize("offset", [0.0, 1e-5])
def test_one_that_stands_where_its_set_point_is_keeps_its_law(offset: float) -> None:
    stage = arrived(offset)
    began = stage.course.restart
    stage.run(100)
    assert stage.course.restart == began and stage.g.calm
