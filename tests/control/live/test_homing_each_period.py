"""Homing, period by period: what each is given, and what it makes of that."""

from __future__ import annotations

import math
from typing import Any

import pytest

from macromicro.control.live import _homing, edges, state
from macromicro.control.live import messages as m
from macromicro.control.live._effort import Efforts
from macromicro.control.live._homing import BACK, GIVE, PUSH, SEARCH
from macromicro.control.live.parameters import Homing, Live
from macromicro.control.live.state import NOWHERE, REST, Drive, Frame, LiveState, Search, Targets
from macromicro.control.live.survey import NOTHING
from macromicro.control.macro import Memory
from macromicro.types import Sample
from tests.control.errors import by_error

from .bench import DT, HALL_OUT, PITCH
from .follower import Follower

SLOWLY = Live(
    homing=Homing(
        speed=100.0, approach=250.0, quick=500.0, near=40.0, lead=90.0, stand=0.3,
        patience=20.0, back_off=150.0, coordinate=37.0,
    )
)  # fmt: skip


def searching(**work: Any) -> tuple[Follower, Search]:
    """Homing, one period after it was asked for, at count 700; `work`: what it is about."""
    f = Follower(encoder=700.0, live=SLOWLY)
    f.tick()
    f.ask(m.Enable())
    f.ask(m.Home())
    f.see(700.0)
    assert isinstance(f.s.work, Search)
    found = f.s.work._replace(**work)
    f.s = f.s._replace(work=found)
    return f, found


def reading(encoder: float) -> Sample:
    return Sample(0.0, encoder, HALL_OUT, 0.0, 1.0, 0.0)


def one(
    f: Follower, encoder: float = 700.0, standing: float = 0.0, **drive: Any
) -> tuple[LiveState, Efforts]:
    """One period of homing at this count, on which it has stood for so long."""
    s = f.s._replace(
        seen=f.s.seen._replace(encoder=encoder, standing=standing, speed=0.0),
        drive=f.s.drive._replace(**drive),
    )
    assert s.motion is not None and isinstance(s.work, Search)
    return _homing.step(f.p, s, s.motion, s.work, reading(encoder), DT)


def effort(s: LiveState, memory: Memory, error: float) -> float:
    """What the macro law wants [V] of an error [counts], within homing's volts."""
    most = SLOWLY.homing.volts
    return min(max(by_error(s.laws.macro, memory, error, DT)[1], -most), most)


# Memories of all laws that are not empty.
PUSHED = tuple(type(memory)(*[4.0] * len(memory)) for memory in REST)


@pytest.mark.parametrize(
    ("expected", "speed"),
    [(math.nan, 250.0), (100.0, 500.0), (690.0, 100.0), (1400.0, 250.0), (-700.0, 500.0)],
)
def test_the_reference_of_the_search_goes_down_at_its_pace(expected: float, speed: float) -> None:
    f, _ = searching(expected=expected, since=0.0, pace=0.0)
    s, given = one(f, macro_reference=698.0, memory=PUSHED)
    assert s.drive.macro_reference == pytest.approx(698.0 - speed * DT, abs=1e-9)
    motor = effort(f.s, PUSHED, s.drive.macro_reference - 700.0)
    assert given == Efforts(motor, 0.0, 1.0) and motor < 0.0
    assert isinstance(s.work, Search) and (s.work.phase, s.work.pace) == (SEARCH, speed)


def test_the_reference_of_the_search_is_no_farther_ahead_than_the_lead() -> None:
    f, _ = searching(expected=math.nan)
    s, _ = one(f, macro_reference=500.0)
    assert s.drive.macro_reference == 700.0 - SLOWLY.homing.lead


def test_a_search_that_becomes_slower_begins_anew_at_the_carriage() -> None:
    """Neither a reference far ahead nor the law's memory drives it on."""
    f, _ = searching(expected=690.0, pace=500.0)
    s, given = one(f, macro_reference=640.0, memory=PUSHED)
    assert s.drive.macro_reference == pytest.approx(700.0 - 100.0 * DT, abs=1e-9)
    assert given.motor == effort(f.s, REST, -100.0 * DT)
    f, _ = searching(expected=100.0, pace=100.0)  # one that becomes quicker does not
    s, _ = one(f, macro_reference=640.0)
    assert s.drive.macro_reference == pytest.approx(640.0 - 500.0 * DT, abs=1e-9)


@pytest.mark.parametrize(
    ("standing", "searched", "pushes"),
    [(0.4, 0.3, True), (0.3, 0.4, True), (0.2, 0.9, False), (0.9, 0.2, False)],
)
def test_the_push_follows_on_standing_during_the_search(
    standing: float, searched: float, pushes: bool
) -> None:
    f, _ = searching()
    f.s = f.s._replace(time=2.0, work=Search(SEARCH, 2.0 - searched, 700.0, 33.0))
    assert f.s.motion is not None
    f.s = f.s._replace(motion=f.s.motion._replace(began=1.0))
    s, _ = one(f, standing=standing)
    assert isinstance(s.work, Search)
    if pushes:
        assert s.work[:4] == (PUSH, 2.0, 700.0, 33.0)
    else:
        assert s.work[:4] == (SEARCH, 2.0 - searched, 700.0, 33.0)


@pytest.mark.parametrize("off", [GIVE, -GIVE, 1.05 * GIVE, -1.05 * GIVE])
def test_a_push_that_frees_the_carriage_is_searched_on(off: float) -> None:
    f, work = searching(phase=PUSH, origin=700.0 - off, since=0.0)
    s, given = one(f, memory=PUSHED, macro_reference=640.0)
    if abs(off) <= GIVE:
        assert given == Efforts(-SLOWLY.homing.volts, 0.0, 1.0)
        assert s.work == work and s.drive.macro_reference == 640.0
    else:
        assert given == Efforts(0.0, 0.0, 1.0)
        assert isinstance(s.work, Search) and (s.work.phase, s.work.since) == (SEARCH, s.time)
        assert math.isnan(s.work.origin)
        assert (s.drive.macro_reference, s.drive.memory) == (700.0, REST)


@pytest.mark.parametrize(
    ("standing", "pushed", "met"),
    [(0.4, 0.3, True), (0.3, 0.4, True), (0.2, 0.9, False), (0.9, 0.2, False)],
)
def test_a_stop_is_what_stands_under_the_push(standing: float, pushed: float, met: bool) -> None:
    f, _ = searching()
    f.s = f.s._replace(time=2.0, work=Search(PUSH, 2.0 - pushed, 700.0, math.nan, expected=9.0))
    assert f.s.motion is not None
    f.s = f.s._replace(motion=f.s.motion._replace(began=1.0))
    s, given = one(f, standing=standing, memory=PUSHED, macro_reference=640.0)
    if not met:
        assert given == Efforts(-SLOWLY.homing.volts, 0.0, 1.0)
        assert isinstance(s.work, Search)
        assert s.work._replace(lowest=state.NAN, rested=state.NAN) == f.s.work
        return
    assert given[:4] == (0.0, 0.0, 1.0, 0.0)
    (event,) = given.notices
    assert isinstance(event, m.Event) and event.cause == "end stop found"
    assert event.evidence == {"stop_raw_counts": 700.0}
    assert isinstance(s.work, Search) and math.isnan(s.work.since)
    assert (s.work.phase, s.work.stop, s.work.sure, s.work.expected) == (BACK, 700.0, False, 700.0)
    assert (s.drive.macro_reference, s.drive.memory) == (700.0, REST)


@pytest.mark.parametrize(
    ("before", "sure"),
    [(math.nan, False), (720.0, True), (680.0, True), (721.0, False), (679.0, False),
     (-700.0, False), (0.0, False)],
)  # fmt: skip
def test_a_stop_is_sure_that_is_felt_twice_at_one_place(before: float, sure: bool) -> None:
    f, _ = searching(phase=PUSH, since=-1.0, origin=700.0, stop=before)
    s, given = one(f, standing=1.0)
    (event,) = given.notices
    assert isinstance(event, m.Event) and isinstance(s.work, Search)
    assert event.cause == ("end stop confirmed" if sure else "end stop found")
    assert s.work.sure == sure and s.work.stop == 700.0
    # Near the coordinate 0 a place is as little known as anywhere.
    f, _ = searching(phase=PUSH, since=-1.0, origin=5.0, stop=before)
    _, given = one(f, 5.0, standing=1.0)
    assert isinstance(given.notices[0], m.Event)
    assert (given.notices[0].cause == "end stop confirmed") == (before == 0.0)


@pytest.mark.parametrize(("sure", "far"), [(True, 150.0), (False, 2.0 * GIVE)])
def test_backing_off_goes_up_slowly_to_its_goal(sure: bool, far: float) -> None:
    f, _ = searching(phase=BACK, stop=690.0, sure=sure, since=math.nan)
    s, given = one(f, macro_reference=715.0, memory=REST)
    assert s.drive.macro_reference == pytest.approx(715.0 + 100.0 * DT, abs=1e-9)
    assert given == Efforts(effort(f.s, REST, s.drive.macro_reference - 700.0), 0.0, 1.0)
    assert given.motor > 0.0
    assert s.work == f.s.work or (isinstance(s.work, Search) and math.isnan(s.work.since))
    f, _ = searching(phase=BACK, stop=700.0 - far + 20.0, sure=sure, since=math.nan)
    s, _ = one(f, macro_reference=725.0)
    assert s.drive.macro_reference == 720.0  # its goal, not beyond it
    f, _ = searching(phase=BACK, stop=690.0, sure=True, since=math.nan)
    s, _ = one(f, 690.0, macro_reference=830.0)
    assert s.drive.macro_reference == 690.0 + SLOWLY.homing.lead  # nor far ahead of the carriage


def test_a_stop_felt_once_is_felt_for_again() -> None:
    """From two gives above it, less the tolerance."""
    f, _ = searching(phase=BACK, stop=690.0, sure=False, since=math.nan)
    tolerance = f.s.laws.sequence.tolerance
    assert tolerance >= 1.0
    s, given = one(f, 730.0 - tolerance, macro_reference=640.0, memory=PUSHED)
    assert given == Efforts(0.0, 0.0, 1.0)
    assert isinstance(s.work, Search)
    assert (s.work.phase, s.work.since, s.work.stop) == (SEARCH, s.time, 690.0)
    assert math.isnan(s.work.origin)
    assert (s.drive.macro_reference, s.drive.memory) == (730.0 - tolerance, REST)
    s, _ = one(f, 729.0 - tolerance, macro_reference=640.0)
    assert isinstance(s.work, Search) and s.work.phase == BACK


@pytest.mark.parametrize("off", [0.0, 1.0, -1.0])
def test_within_the_tolerance_of_its_place_the_dwell_is_counted(off: float) -> None:
    f, _ = searching(phase=BACK, stop=550.0, sure=True, since=math.nan)  # its place: count 700
    q = f.s.laws.sequence
    s, _ = one(f, 700.0 + off * q.tolerance)
    assert isinstance(s.work, Search) and s.work.since == s.time  # from now
    s, _ = one(f, 700.0 + off * (q.tolerance + 1.0))
    assert isinstance(s.work, Search)
    assert s.work.since == s.time if off == 0.0 else math.isnan(s.work.since)
    f, _ = searching(phase=BACK, stop=550.0, sure=True, since=f.s.time - 0.8 * q.dwell)
    s, _ = one(f, 700.0 + off * q.tolerance)
    assert isinstance(s.work, Search)
    assert s.work.since == f.s.time - 0.8 * q.dwell  # go on counting, too short as yet
    f, _ = searching(phase=BACK, stop=550.0, sure=True, since=f.s.time - q.dwell)
    s, given = one(f, 700.0 + off * (q.tolerance + 1.0))  # out of it again
    assert (given.notices == ()) == (off != 0.0)


@pytest.mark.parametrize("off", [0.0, 2.0, -2.0])
def test_the_place_backed_off_to_is_named_and_told(off: float) -> None:
    f, _ = searching(phase=BACK, stop=550.0, sure=True)
    dwell = f.s.laws.sequence.dwell
    work = f.s.work
    assert isinstance(work, Search)
    f.s = f.s._replace(
        work=work._replace(since=f.s.time - dwell),
        frame=Frame(660.0, 17.0, False, 0.25, named=True),
    )
    s, given = one(f, 700.0 + off)
    offset = 700.0 - SLOWLY.homing.coordinate
    assert s.frame == Frame(offset, 0.0, True, 0.25, named=True)
    assert given[:4] == (0.0, 0.0, 0.0, 0.0) and s.work is None and s.motion is None
    trust, end, _ = given.notices
    found = {"offset_raw_counts": offset, "stop_raw_counts": 550.0, "shift_counts": offset - 660.0}
    assert isinstance(trust, m.Event) and isinstance(end, m.Finished)
    assert trust.evidence == {"trusted": True, **found}
    assert found.items() <= end.evidence.items() and end.outcome == m.DONE
    place = (SLOWLY.homing.coordinate + off) * SLOWLY.pitch + s.seen.fine
    assert end.position == pytest.approx(place, abs=1e-12)


def test_the_survey_learns_where_homing_has_put_the_coordinate() -> None:
    f, work = searching(phase=BACK, stop=550.0, sure=True)
    slope = edges.begin(0.0, 0.0, PITCH, 2e-4)._replace(aa=0.0, number=99)
    f.s = f.s._replace(
        survey=NOTHING._replace(phase=slope, half=1.0),
        work=work._replace(since=f.s.time - f.s.laws.sequence.dwell),
    )
    s, _ = one(f)
    q = SLOWLY.edges
    away = 2e-4 * PITCH * (700.0 - SLOWLY.homing.coordinate)
    assert s.survey.half == pytest.approx(q.laser + q.hall + q.factor * away, rel=1e-9)


@pytest.mark.parametrize(("phase", "patience"), [(SEARCH, 20.0), (PUSH, 20.0), (BACK, 23.0)])
@pytest.mark.parametrize("late", [False, True])
def test_homing_is_given_up_after_its_patience(phase: int, patience: float, late: bool) -> None:
    """And while it backs off after that of a macro move in addition."""
    f, _ = searching(
        phase=phase, origin=700.0, stop=650.0, sure=True, since=math.nan, lowest=math.nan
    )
    f.s = f.s._replace(time=50.0 + patience - (0.0 if late else DT))
    assert f.s.motion is not None
    f.s = f.s._replace(
        motion=f.s.motion._replace(began=50.0),
        laws=f.s.laws._replace(sequence=f.s.laws.sequence._replace(patience=3.0)),
    )
    s, given = one(f)
    assert (m.MODES[s.mode] == "stopped") == late and bool(given.notices) == late


def test_without_a_count_homing_waits() -> None:
    f, work = searching()
    s, given = one(f, math.nan)
    assert given == Efforts(macro_active=1.0) and s.work == work


def test_homing_begins_where_the_carriage_is() -> None:
    f = Follower(encoder=50.0, coordinate=0.0, trusted=True, live=SLOWLY)
    f.tick()
    f.ask(m.Enable())
    f.see(51.0)
    f.s = f.s._replace(
        target=Targets(1e-3),
        drive=f.s.drive._replace(macro_reference=7.0, memory=PUSHED, integral=1.0),
    )
    f.ask(m.Home())
    work, d = f.s.work, f.s.drive
    assert isinstance(work, Search)
    assert (work.phase, work.since, work.origin) == (SEARCH, f.s.time, 51.0)
    assert math.isnan(work.stop) and f.s.target == NOWHERE
    assert d == Drive(51.0, 0.0, REST, 0.0, False)
    assert not f.s.frame.trusted and f.s.motion is not None


def test_above_its_speed_homing_pushes_no_more_though_no_reference_moves() -> None:
    s = Follower().s
    s = s._replace(seen=s.seen._replace(speed=1.2))
    assert _homing._slow(Homing(fastest=1.0, volts=3.0), s, 4.0) == 0.0
