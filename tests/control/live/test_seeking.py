"""Homing of a stage that is led, on a switch or an index pulse; and the way off a limit switch."""

from __future__ import annotations

import math
from typing import Any

import pytest

from macromicro.control.live import _seeking, guided
from macromicro.control.live import messages as m
from macromicro.control.live.leading import NEVER, Course, Seek, at
from macromicro.types import QUIET, Lines, Sample

from .led import DT, LIMITS, PITCH, TOUCH, Stage

LEAVE, RISE = 0.01, 0.005
EDGE = -0.006  # of the limit switch, between stop and lowest target; of a home switch, see below
SEEK = Seek("limit_low", above=False, pulse=False, spacing=0.0, margin=2e-4, rise=0.02)
SLOW = 0.005


class Lined(Stage):
    """With a lower limit switch, a home switch, index pulses and an enable line."""

    def __init__(self, seek: Seek, *, place: float = 0.03, raw: float = 0.0, edge: float = EDGE):
        self.edge, self.width, self.low = edge, math.inf, EDGE
        self.pulses: tuple[float, ...] = ()
        self.before, self.lines, self.cut = place, QUIET, False
        self.high, self.quickest = math.inf, math.inf
        known = edge
        touch = TOUCH._replace(slow=SLOW, back=1e-3, place=known, seek=seek)
        super().__init__(touch=touch, place=place, raw=raw)
        self.q = self.q._replace(leave=LEAVE, rise=RISE)
        self.wall = TOUCH.place

    def sense(self) -> Lines:
        passed = [
            x
            for x in self.pulses
            if min(self.before, self.place) < x <= max(self.before, self.place)
        ]
        index = math.nan if not passed else float(round((passed[-1] - self.raw) / PITCH))
        on = self.edge - self.width <= self.place <= self.edge and not self.cut
        return QUIET._replace(
            limit_low=float(self.place <= self.low),
            limit_high=float(self.place >= self.high),
            home=float(on),
            index_count=index,
        )

    def run(self, periods: int) -> None:
        for _ in range(periods):
            self.lines = self.sense()
            self.before = self.place
            counts = float(math.floor((self.place - self.raw) / PITCH + 0.5))
            sample = Sample(self.tick * DT, counts, *[math.nan] * 4)
            self.s, self.g, self.course, notices = guided.step(
                self.p, self.q, self.s, self.g, sample, DT, lines=self.lines
            )
            self.notices += notices
            if self.course.on and not self.course.waiting and not self.stuck:
                wanted = max(at(self.course.aim, DT).position + self.raw, self.wall)
                most = self.quickest * DT  # it drags
                self.place += min(max(wanted - self.place, -most), most)
                self.fastest = max(self.fastest, abs(self.course.aim.velocity))
            self.tick += 1
            assert self.tick < 60_000, self.s

    def causes(self) -> list[str]:
        return [n.cause for n in self.notices if isinstance(n, m.Event) and n.kind == "move"]

    def until(self, cause: str) -> None:
        while cause not in self.causes():
            self.run(1)


def enabled(seek: Seek = SEEK, **given: Any) -> Lined:
    stage = Lined(seek, **given)
    assert stage.ask(m.Enable()) == m.Accepted(0)
    stage.run(10)
    return stage


def homed(stage: Lined) -> m.Finished:
    end = stage.end(m.Home())
    assert end.outcome == m.DONE, end
    assert stage.s.frame.trusted
    assert stage.place == pytest.approx(LIMITS.whole_low, abs=3 * PITCH)
    return end


@pytest.mark.parametrize("raw", [0.0, 0.0123, -0.04])
@pytest.mark.parametrize("place", [0.03, -0.008])
def test_the_limit_switch_names_the_place(raw: float, place: float) -> None:
    stage = enabled(place=place, raw=raw)
    end = homed(stage)
    assert stage.s.frame.offset == pytest.approx(-raw / PITCH, abs=1.5)
    assert end.evidence["stop_raw_counts"] == pytest.approx((EDGE - raw) / PITCH, abs=1.5)
    assert stage.causes() == ["switch found", "switch confirmed", "place found"]
    assert stage.place > EDGE
    assert stage.fastest == pytest.approx(TOUCH.speed) or (place < EDGE and stage.fastest > 0.02)
    assert not stage.course.homing


def test_it_touches_the_switch_again_slowly_from_its_way_back() -> None:
    stage = enabled()
    stage.ask(m.Home())
    stage.until("switch found")
    assert stage.course.homing and stage.course.effort == TOUCH.effort
    deepest, highest, last = stage.place, -1.0, 0.0
    while "place found" not in stage.causes():
        stage.run(1)
        deepest, highest = min(deepest, stage.place), max(highest, stage.place)
        last = stage.course.aim.velocity or last
    # Down it turns at the motion's acceleration, and off the switch it is no faster than `rise`.
    braked = TOUCH.speed**2 / (2.0 * stage.q.acceleration)
    assert EDGE - 1.5 * braked - 1e-4 < deepest < EDGE - 0.5 * braked
    assert EDGE + 1e-3 < highest < EDGE + 1e-3 + 5e-4
    assert last == pytest.approx(-SLOW)


def test_a_switch_that_bounces_on_the_way_off_is_left_anew() -> None:
    stage = enabled(SEEK._replace(line="home"), edge=0.02)
    stage.ask(m.Home())
    stage.until("switch found")
    while stage.place < 0.02 + 5e-4:
        stage.run(1)
    stage.edge = stage.place + 1e-4
    again = stage.edge
    stage.run(30)
    highest = stage.place
    while "place found" not in stage.causes():
        stage.run(1)
        highest = max(highest, stage.place)
    assert highest > again + 1e-3


def test_its_patience_counts_from_its_order() -> None:
    stage = enabled()
    stage.run(20_500)
    assert stage.s.time > TOUCH.patience
    homed(stage)


def test_a_stage_that_drags_behind_its_set_point_does_not_stand() -> None:
    """It is held back all the way, and moves by more than a stop gives within that time."""
    stage = enabled(SEEK._replace(line="home", above=True), place=0.0, edge=-0.004)
    stage.quickest = 0.02
    homed(stage)
    assert stage.causes() == ["switch found", "switch confirmed", "place found"]


def test_a_limit_switch_ends_the_way_before_the_stop() -> None:
    stage = enabled(SEEK._replace(line="home", above=True), place=0.01, edge=0.03)
    stage.width, deepest = 0.005, 1.0
    stage.run(5)
    stage.ask(m.Home())
    while "switch found" not in stage.causes():
        stage.run(1)
        deepest = min(deepest, stage.place)
    assert stage.causes() == ["end of travel", "switch found"]
    braked = TOUCH.speed**2 / (2.0 * stage.q.acceleration)
    assert EDGE - 2.0 * braked < deepest < EDGE


def test_what_pushed_against_the_stop_is_forgotten() -> None:
    stage = enabled(SEEK._replace(line="home", above=True), place=0.0, edge=0.03)
    stage.width, stage.low = 0.005, -math.inf
    stage.run(5)
    stage.ask(m.Home())
    stage.run(100)
    before = stage.g.restart
    stage.until("end of travel")
    assert stage.g.restart == before + 1
    assert stage.place == TOUCH.place and stage.g.aim.velocity == 0.0


def test_the_law_begins_anew_where_the_place_was_found() -> None:
    stage = enabled()
    stage.ask(m.Home())
    stage.until("switch found")
    before = stage.g.restart
    stage.until("place found")
    assert stage.g.restart == before + 1 and math.isnan(stage.g.there)
    assert stage.g.aim.velocity == 0.0 and stage.g.motion == NEVER


@pytest.mark.parametrize("place", [0.03, 0.015, -0.008, 0.0195])
def test_a_home_switch_that_is_on_below_its_place(place: float) -> None:
    stage = enabled(SEEK._replace(line="home"), place=place, edge=0.02)
    homed(stage)
    assert stage.s.frame.offset == pytest.approx(0.0, abs=1.5)
    assert stage.causes() == ["switch found", "switch confirmed", "place found"]


@pytest.mark.parametrize(
    ("place", "turns"), [(0.03, False), (0.019, False), (0.01, True), (-0.004, True)]
)
def test_a_cam_is_found_from_below_after_the_end_of_the_way(place: float, turns: bool) -> None:
    stage = enabled(SEEK._replace(line="home", above=True), place=place, edge=0.02)
    stage.width = 2e-3
    stage.run(5)
    homed(stage)
    assert stage.s.frame.offset == pytest.approx(0.0, abs=1.5)
    assert ("end of travel" in stage.causes()) == turns


def test_a_cam_above_the_stop_is_found_without_a_limit_switch() -> None:
    stage = enabled(SEEK._replace(line="home", above=True), place=0.01, edge=0.02)
    stage.width, stage.low = 2e-3, -1.0
    stage.run(5)
    homed(stage)
    assert stage.s.frame.offset == pytest.approx(0.0, abs=1.5)
    assert "end of travel" in stage.causes()


TURN = 4e-3
PULSES = ["index pulse found", "again"]  # a pulse counts that comes twice


def turning(edge: float, above: float, raw: float = 0.0, line: str = "home") -> Lined:
    """With pulses a turn apart, of which one is so far above the switch."""
    seek = SEEK._replace(line=line, pulse=True, spacing=TURN)
    stage = enabled(seek, edge=edge, raw=raw)
    first = edge + above
    stage.pulses = tuple(sorted(first + k * TURN for k in range(-5, 6)))
    assert stage.q.touch is not None
    stage.q = stage.q._replace(touch=stage.q.touch._replace(place=first))
    return stage


@pytest.mark.parametrize("above", [3e-4, 2e-3, 3.7e-3])
@pytest.mark.parametrize("raw", [0.0, 0.0123])
def test_the_first_pulse_above_the_switch_names_the_place_to_a_count(
    above: float, raw: float
) -> None:
    stage = turning(0.02, above, raw)
    end = homed(stage)
    assert stage.causes() == ["switch found", *["switch confirmed"] * 2, *PULSES, "place found"]
    assert end.evidence["stop_raw_counts"] == round((0.02 + above - raw) / PITCH)
    assert stage.s.frame.offset == round(-raw / PITCH)


@pytest.mark.parametrize(("above", "near"), [(1e-4, 100.0), (3.9e-3, 100.0), (TURN, 0.0)])
def test_a_pulse_too_near_to_the_switch_is_ambiguous(above: float, near: float) -> None:
    stage = turning(0.02, above)
    end = stage.end(m.Home())
    assert end.outcome == m.STALLED and not stage.s.frame.trusted
    assert end.evidence["index_from_switch_um"] == pytest.approx(near, abs=20.0)
    assert "uncertain by 0.2 mm: move the switch" in end.evidence["reason"]


def test_no_pulse_within_a_turn_and_a_half() -> None:
    stage = turning(0.02, 2e-3)
    stage.pulses = ()
    end = stage.end(m.Home())
    assert end.outcome == m.STALLED and "no index pulse" in end.evidence["reason"]
    assert stage.place == pytest.approx(0.02 + 1.5 * TURN, abs=5e-4)


def test_a_mark_has_no_turn_and_is_looked_for_as_long_as_there_is_way() -> None:
    stage = turning(0.02, 2e-3)
    assert stage.q.touch is not None and stage.q.touch.seek is not None
    seek = stage.q.touch.seek._replace(spacing=0.0)
    stage.pulses = (0.05,)
    stage.q = stage.q._replace(touch=stage.q.touch._replace(seek=seek, place=0.05))
    homed(stage)
    assert stage.s.frame.offset == 0.0


@pytest.mark.parametrize(("place", "turns"), [(0.03, False), (0.01, True)])
@pytest.mark.parametrize("low", [EDGE, -1.0])
@pytest.mark.parametrize("spacing", [0.0, TURN])
def test_a_mark_alone(place: float, turns: bool, low: float, spacing: float) -> None:
    """Without a switch no other pulse is in question, however near one may be."""
    seek = SEEK._replace(line="", pulse=True, spacing=spacing)
    stage = enabled(seek, place=place, edge=0.02)
    stage.pulses, stage.low = (0.02,), low
    homed(stage)
    assert stage.s.frame.offset == 0.0
    assert stage.causes() == [*(["end of travel"] if turns else []), *PULSES, "place found"]


def test_a_mark_is_passed_downwards_by_the_way_back_before_it_is_looked_for_again() -> None:
    stage = enabled(SEEK._replace(line="", pulse=True), place=0.03, edge=0.02)
    stage.pulses = (0.02,)
    stage.ask(m.Home())
    stage.until("index pulse found")
    assert stage.place == pytest.approx(0.02, abs=1e-4)
    stage.until("again")
    assert stage.place == pytest.approx(0.02 - 1e-3, abs=1e-4)


def test_a_mark_next_to_the_stop_is_looked_for_again_from_there() -> None:
    mark = TOUCH.place + 5e-4  # half of the way back
    stage = enabled(SEEK._replace(line="", pulse=True), place=0.0, edge=mark)
    stage.pulses, stage.low = (mark,), -1.0
    homed(stage)
    assert stage.causes() == [*PULSES, "place found"] and stage.s.frame.offset == 0.0


@pytest.mark.parametrize(("off", "again"), [(2, False), (-2, False), (3, True), (-3, True)])
def test_a_pulse_comes_again_within_two_counts(off: int, again: bool) -> None:
    stage = enabled(SEEK._replace(line="", pulse=True), place=0.03, edge=0.02)
    stage.pulses = (0.02,)
    stage.ask(m.Home())
    stage.until("index pulse found")
    stage.pulses = (0.02 + off * PITCH,)
    stage.until("place found")
    assert stage.causes() == [*PULSES, *(PULSES if again else []), "place found"]


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize(("apart", "times"), [(0.0, 1), (1.9e-4, 1), (2.2e-4, 2)])
def test_an_edge_is_the_same_within_its_margin(way: float, apart: float, times: int) -> None:
    stage = enabled(SEEK._replace(line="home"), edge=0.02)
    stage.ask(m.Home())
    stage.until("switch confirmed")
    stage.edge += way * apart
    stage.until("place found")
    assert stage.causes().count("switch confirmed") == times


def test_a_switch_that_never_comes_is_told_with_the_reason() -> None:
    stage = enabled(SEEK)
    stage.low = -1.0
    end = stage.end(m.Home())
    assert end.outcome == m.STALLED and "no switch was on" in end.evidence["reason"]
    assert stage.place == pytest.approx(TOUCH.place, abs=1e-4)
    stage = enabled(SEEK._replace(line="home"), place=0.03, edge=0.02)
    stage.ask(m.Home())
    stage.until("switch found")
    stage.run(200)
    stage.cut = True
    stage.run(8000)
    ends = [n for n in stage.notices if isinstance(n, m.Finished)]
    assert ends[0].outcome == m.STALLED and not stage.s.frame.trusted
    assert ends[0].evidence["reason"] == "it came to rest before the switch was on again"


def test_a_switch_that_stays_on_while_it_stands_is_told() -> None:
    stage = enabled(SEEK)
    stage.ask(m.Home())
    stage.until("switch found")
    stage.stuck = True
    stage.run(1000)
    ends = [n for n in stage.notices if isinstance(n, m.Finished)]
    assert [e.outcome for e in ends] == [m.STALLED]
    assert ends[0].evidence["reason"] == "it came to rest with the switch still on"


def test_a_search_is_given_its_patience() -> None:
    stage = enabled(SEEK)
    assert stage.q.touch is not None
    stage.q = stage.q._replace(touch=stage.q.touch._replace(patience=0.3))
    began = stage.tick
    assert stage.end(m.Home()).outcome == m.STALLED
    assert (stage.tick - began) * DT == pytest.approx(0.3 + TOUCH.speed / 2.0, abs=0.02)


def test_the_drive_is_given_its_time_before_the_law_begins() -> None:
    stage = Lined(SEEK)
    stage.ask(m.Enable())
    stage.ask(m.Jog("macro", 0.05))
    seen = []
    for _ in range(12):
        stage.run(1)
        seen.append(stage.course.waiting)
        if stage.course.waiting:  # it sinks meanwhile
            stage.place -= 1e-3
    assert seen == [True] * 5 + [False] * 7
    assert stage.course.aim.position == pytest.approx(0.026, abs=2e-4)  # where it was seen last
    assert stage.place > 0.0255
    stage.ask(m.Disable())
    stage.run(2)
    assert stage.course == Course()


@pytest.mark.parametrize("raw", [0.0, 0.0123])
def test_off_a_limit_switch_it_goes_slowly_until_it_is_within_its_soft_limits(raw: float) -> None:
    stage = enabled(SEEK, raw=raw)
    homed(stage)
    stage.ask(m.Disable())
    stage.run(1)
    stage.place = -0.009  # on the switch, below the soft limit of -8 mm
    stage.low = -0.0085
    stage.run(1)
    stage.ask(m.Enable())
    stage.run(10)
    assert stage.course.low == -math.inf and stage.course.high < math.inf
    stage.fastest = 0.0
    stage.ask(m.Jog("macro", 0.1))
    while stage.place < -0.0082:
        stage.run(1)
    assert stage.lines.limit_low == 0.0 and stage.fastest == pytest.approx(LEAVE)
    assert stage.course.low == -math.inf  # the switch has let go, and it is still too low
    while stage.place < -0.0075:
        stage.run(1)
    assert stage.course.low + raw == pytest.approx(-0.008, abs=PITCH)
    stage.run(300)
    assert stage.fastest > 2.0 * LEAVE
    # A move all the way, from the switch on.
    stage.ask(m.Disable())
    stage.run(1)
    stage.place = -0.009
    stage.run(1)
    stage.ask(m.Enable())
    stage.run(10)
    stage.fastest = 0.0
    assert stage.end(m.MoveTo(0.01)).outcome == m.DONE
    assert stage.fastest == pytest.approx(LEAVE)
    stage.fastest = 0.0
    assert stage.end(m.MoveTo(0.08)).outcome == m.DONE
    assert stage.fastest > 10.0 * LEAVE


def test_the_upper_limit_switch_likewise() -> None:
    stage = enabled(SEEK)
    homed(stage)
    high = QUIET._replace(limit_high=1.0)
    g = guided._mark_limit(stage.q, stage.s, stage.g._replace(lines=high), 0.11)
    assert g.off_high and not g.off_low
    g = guided._mark_limit(stage.q, stage.s, g._replace(lines=QUIET), 0.1081)
    assert g.off_high and guided.slow_limits(stage.q, g).velocity == LEAVE
    g = guided._mark_limit(stage.q, stage.s, g._replace(lines=QUIET), 0.1079)
    assert not g.off_high and guided.slow_limits(stage.q, g) == stage.q
    stage.ask(m.Disable())
    stage.run(1)
    stage.place, stage.high = 0.109, 0.1085
    stage.run(1)
    stage.ask(m.Enable())
    stage.run(10)
    stage.fastest = 0.0
    stage.ask(m.Jog("macro", -0.1))
    while stage.place > 0.1081:
        stage.run(1)
    assert stage.fastest == pytest.approx(LEAVE) and stage.course.high == math.inf
    lost = stage.s._replace(frame=stage.s.frame._replace(trusted=False))
    g = guided._mark_limit(stage.q, lost, g._replace(off_high=True, off_low=True), 0.2)
    assert not g.off_high and not g.off_low


def test_what_stood_before_the_switch_was_on_has_its_time_anew() -> None:
    stage = enabled(SEEK)
    stage.ask(m.Home())
    stage.run(100)
    stage.stuck = True
    stage.run(round((TOUCH.lead / TOUCH.speed + 0.9 * TOUCH.stand) / DT))
    stage.low = stage.place  # tripped from here on
    stage.run(5)
    assert stage.causes() == ["switch found"]
    stage.run(60)
    stage.stuck = False
    stage.low = EDGE
    stage.run(20)
    assert stage.s.mode == m.HOMING


@pytest.mark.parametrize("trusted", [True, False])
@pytest.mark.parametrize("off", [True, False])
@pytest.mark.parametrize("beyond", [True, False])
def test_only_a_stage_that_was_on_a_switch_is_on_its_way_back(
    trusted: bool, off: bool, beyond: bool
) -> None:
    """Until it is within soft limits that are known; beyond them alone it is not slow."""
    stage = enabled()
    s = stage.s._replace(frame=stage.s.frame._replace(trusted=trusted))
    g = stage.g._replace(off_low=off, off_high=off, lines=QUIET)
    inside = 0.5 * (stage.q.low + stage.q.high)
    low = guided._mark_limit(stage.q, s, g, stage.q.low - 1e-3 if beyond else inside)
    high = guided._mark_limit(stage.q, s, g, stage.q.high + 1e-3 if beyond else inside)
    assert low.off_low == high.off_high == (trusted and off and beyond)
    assert not low.off_high and not high.off_low


def test_a_stage_that_is_pushed_while_its_drive_switches_on_is_held_where_it_is() -> None:
    stage = Lined(SEEK)
    assert stage.ask(m.Enable()) == m.Accepted(0)
    stage.run(2)
    assert stage.course.waiting
    before = stage.course.restart
    stage.place += 1e-3
    stage.run(1)
    assert stage.course.waiting and stage.course.restart == before + 1
    assert stage.course.aim.position + stage.raw == pytest.approx(stage.place, abs=PITCH)


def spiked(stage: Lined, looks: int) -> None:
    """Home with one spike of some looks on the switch's line, on the slow way to its edge."""
    stage.ask(m.Home())
    stage.until("switch found")
    while getattr(stage.s.work, "phase", None) != _seeking.EDGE:
        stage.run(1)
    stage.run(3)
    edge, stage.edge = stage.edge, 1.0
    stage.run(looks)
    stage.edge = edge


@pytest.mark.parametrize("looks", [1, 2, 3, 30])
def test_a_spike_on_the_line_of_the_switch_names_no_place(looks: int) -> None:
    """A short one is not seen; a long one is an edge that is not found a second time."""
    stage = enabled(SEEK._replace(line="home"), edge=0.02)
    spiked(stage, looks)
    stage.run(8000)
    ends = [n for n in stage.notices if isinstance(n, m.Finished)]
    assert [e.outcome for e in ends] == [m.DONE]
    assert stage.s.frame.offset == pytest.approx(0.0, abs=1.5)
    assert stage.causes().count("switch confirmed") == (1 if looks < 4 else 2)


def test_an_edge_that_is_never_where_it_was_is_told() -> None:
    stage = enabled(SEEK._replace(line="home"), edge=0.02)
    stage.ask(m.Home())
    stage.until("switch found")
    found = 0
    while stage.s.mode == m.HOMING:
        stage.run(1)
        if stage.causes().count("switch confirmed") > found:
            found, stage.edge = found + 1, stage.edge - 1e-3
    stage.run(600)
    end = next(n for n in stage.notices if isinstance(n, m.Finished))
    assert end.outcome == m.STALLED and not stage.s.frame.trusted
    assert "check the switch and its wires" in end.evidence["reason"]
    assert "at places 1 mm apart, which is more than 0.2 mm" in end.evidence["reason"]
    assert found == 4


def test_a_pulse_that_is_none_names_no_place() -> None:
    """A spike on the line of the index pulse, on the way to the mark."""
    stage = enabled(SEEK._replace(line="", pulse=True), place=0.03)
    stage.pulses = (0.02, 0.025)
    stage.ask(m.Home())
    stage.until("index pulse found")
    stage.pulses = (0.02,)
    stage.until("index pulse not confirmed")
    assert stage.place == pytest.approx(0.025 + 1e-3, abs=1e-4)
    stage.run(12000)
    ends = [n for n in stage.notices if isinstance(n, m.Finished)]
    assert [e.outcome for e in ends] == [m.DONE], ends
    assert ends[0].evidence["stop_raw_counts"] == round(0.02 / PITCH)


def test_pulses_that_never_come_again_are_told() -> None:
    stage = enabled(SEEK._replace(line="", pulse=True), place=0.03)
    stage.pulses, found, missed = (0.028,), 0, 0
    stage.ask(m.Home())
    while stage.s.mode == m.HOMING:
        stage.run(1)
        causes = stage.causes()
        if causes.count("index pulse found") > found:
            found, stage.pulses = found + 1, ()
        if causes.count("index pulse not confirmed") > missed:
            missed, stage.pulses = missed + 1, (stage.place - 3e-3,)
    stage.run(600)
    end = next(n for n in stage.notices if isinstance(n, m.Finished))
    assert end.outcome == m.STALLED
    assert end.evidence["reason"] == "an index pulse came only once"
    assert (found, missed) == (5, 4)


def test_a_pulse_above_the_switch_that_is_none_names_no_place() -> None:
    stage = turning(0.02, 2e-3)
    stage.pulses = tuple(sorted((*stage.pulses, 0.0212)))
    stage.ask(m.Home())
    stage.until("index pulse found")
    stage.pulses = tuple(x for x in stage.pulses if x != 0.0212)
    stage.run(12000)
    ends = [n for n in stage.notices if isinstance(n, m.Finished)]
    assert [e.outcome for e in ends] == [m.DONE], ends
    assert ends[0].evidence["stop_raw_counts"] == round(0.022 / PITCH)


@pytest.mark.parametrize("shift", [1e-4, -1e-4])
def test_pulses_at_changing_places_are_told(shift: float) -> None:
    stage = turning(0.02, 2e-3)
    stage.ask(m.Home())
    found = 0
    while stage.s.mode == m.HOMING:
        stage.run(1)
        if stage.causes().count("index pulse found") > found:
            found += 1
            stage.pulses = tuple(x + shift for x in stage.pulses)
    stage.run(600)
    end = next(n for n in stage.notices if isinstance(n, m.Finished))
    assert end.outcome == m.STALLED and "varying positions" in end.evidence["reason"]
    assert found == 4


def test_a_stage_that_shows_no_motion_is_not_pushed_for_the_whole_stand() -> None:
    stage = enabled(SEEK._replace(line="home"), place=0.03, edge=0.02)
    assert stage.q.touch is not None
    stage.q = stage.q._replace(touch=stage.q.touch._replace(reveal=0.02))
    stage.ask(m.Home())
    stage.stuck = True
    stage.run(30)
    assert stage.s.mode == m.HOMING
    stage.g = stage.g._replace(leaning=0.021)
    stage.run(1)
    assert stage.s.mode == m.STOPPED
