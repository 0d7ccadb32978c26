"""A programme of a led stage: the way to its beginning, its moves, and what ends it."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from tests.control.live.led import ABSOLUTE, DT, PITCH, SETTINGS

from macromicro.control.live import accept, guided, state
from macromicro.control.live import messages as m
from macromicro.control.live.leading import Course, Guided, at
from macromicro.control.live.messages import Accepted, Finished, Refused
from macromicro.control.live.parameters import prepare
from macromicro.control.live.state import Played, Targets
from macromicro.machines.sequence import Plan
from macromicro.motion import s_curve
from macromicro.serve.stage import _playing
from macromicro.types import Sample

NAN = math.nan


def plan(
    targets: list[float],
    origin: float | None = None,
    hold: float = 0.02,
    start: list[float] | None = None,
    end: float = NAN,
) -> Plan:
    """Moves within the limits of the stage of `led`."""
    origin = targets[0] if origin is None else origin
    before, pieces, first, length = origin, [], [0], []
    for target in targets:
        made = s_curve(target - before, 0.2, 2.0, 100.0, start=before)
        own = np.array(made.segments).reshape(-1, 5)
        begins = np.cumsum(own[:, 0]) - own[:, 0]
        pieces.append(np.column_stack((begins, own[:, 1:5])))
        length.append(float(own[:, 0].sum()))
        first.append(first[-1] + len(own))
        before = target
    n = len(targets)
    return Plan(
        start=np.array([NAN] * n if start is None else start),
        target=np.array(targets),
        hold=np.full(n, hold),
        length=np.array(length),
        first=np.array(first, np.int64),
        pieces=np.concatenate(pieces),
        origin=origin,
        end=end,
    )


class Stage:
    """A live machine over a stage that follows at once, `frame` off its encoder's zero."""

    def __init__(self, place: float = 0.0, frame: float = 0.0) -> None:
        self.p = prepare(SETTINGS, stages=(m.MACRO,))
        self.q = ABSOLUTE
        self.s = state.begin(self.p, round(place / PITCH), trusted=True)
        self.g, self.course, self.place = Guided(), Course(), place + frame
        self.behind, self.tick = 0.0, 0
        self.notices: list[Any] = []
        self.aims: list[tuple[float, float, float, float]] = []
        self.courses: list[Course] = []
        self.run(1)
        self.s, reply, _ = self._accept(m.Enable())
        assert reply == Accepted(0)
        self.run(2)

    def _accept(self, request: Any) -> Any:
        return accept.accept(self.p, self.s, request)

    def play(self, made: Plan) -> int:
        found = _playing.motion(self.s, made, PITCH)
        self.s, reply, notices = accept.begin(
            self.p, self.s, found, lambda s, motion: _playing.start(s, motion, made)
        )
        assert isinstance(reply, Accepted), reply
        self.notices += notices
        return reply.id

    def run(self, periods: int) -> None:
        works = {**guided.WORKS, Played: _playing.step}
        for _ in range(periods):
            counts = float(math.floor((self.place - self.behind) / PITCH + 0.5))
            sample = Sample(self.tick * DT, counts, *[NAN] * 4)
            self.s, self.g, self.course, notices = guided.step(
                self.p, self.q, self.s, self.g, sample, DT, works=works
            )
            self.notices += notices
            aim = self.course.aim
            self.aims.append(tuple(aim))
            self.courses.append(self.course)
            if self.course.on:
                self.place = at(aim, DT).position
            self.tick += 1

    def end(self, number: int, periods: int = 10_000) -> Finished:
        for _ in range(periods):
            self.run(1)
            for notice in self.notices:
                if isinstance(notice, Finished) and notice.id == number:
                    return notice
        raise AssertionError(self.s)

    def events(self, cause: str) -> list[m.Event]:
        return [n for n in self.notices if isinstance(n, m.Event) and n.cause == cause]


@pytest.mark.parametrize("frame", [0.0, 0.03])
def test_it_goes_to_where_it_begins_and_visits_every_target(frame: float) -> None:
    stage = Stage(place=0.05, frame=frame)
    stage.behind = 2e-5  # of what the tolerance allows: 3e-5 m
    end = stage.end(stage.play(plan([0.01, 0.06, 0.02])))
    assert end.outcome == m.DONE and end.evidence["moves"] == 3
    assert stage.place - frame == pytest.approx(0.02, abs=PITCH)
    assert [e.evidence["target_mm"] for e in stage.events("next move") if e.kind == "move"] == (
        pytest.approx([10.0, 60.0, 20.0])
    )
    assert max(p for p, *_ in stage.aims) == pytest.approx(0.06 + frame, abs=1e-6)
    first = next(k for k, (_, v, *_) in enumerate(stage.aims) if v != 0.0)
    assert stage.aims[first][0] == pytest.approx(0.05 + frame)  # from where it stood
    assert stage.s.mode == m.READY and stage.g.aim.velocity == 0.0
    assert stage.s.target == Targets(0.02, round(0.02 / PITCH))
    assert end.evidence["error_um"] == pytest.approx(20.0, abs=0.6 * PITCH * 1e6)
    steps = np.diff([p for p, *_ in stage.aims[3:]])
    assert np.max(np.abs(steps)) <= 0.2 * DT * 1.001  # never a jump
    modes = [n.cause for n in stage.notices if isinstance(n, m.Event) and n.kind == "mode"]
    moves = ["arrived", "next move"] * 2
    assert modes == ["programme", *moves, "arrived", "programme done"]


@pytest.mark.parametrize(("targets", "frame"), [([0.01, 0.0173], 0.0), ([0.0013], 0.03)])
def test_the_set_point_goes_on_from_period_to_period_where_pieces_end_between(
    targets: list[float], frame: float
) -> None:
    stage = Stage(place=0.01, frame=frame)
    stage.end(stage.play(plan(targets, origin=0.0)))
    assert any(course.later for course in stage.courses)
    for before, after in pairwise(stage.courses[3:]):
        begin, last = ((0.0, before.aim), *before.later)[-1]
        extended = at(last, DT - begin)
        assert extended.position == pytest.approx(after.aim.position, abs=1e-12)
        assert extended.velocity == pytest.approx(after.aim.velocity, abs=1e-9)


def test_its_clock_starts_in_the_period_after_it_has_come_to_its_beginning() -> None:
    stage = Stage()
    stage.play(plan([0.01, 0.02]))
    while math.isnan(stage.s.work.start):
        stage.run(1)
    assert stage.s.work.start == pytest.approx(stage.s.time + DT)
    stage.run(1)
    assert stage.s.work.progress.began == 0.0 and stage.s.work.progress.move == 0


def test_a_move_that_arrives_at_once_is_reported_like_any_other() -> None:
    stage = Stage()
    stage.q = stage.q._replace(arrival=stage.q.arrival._replace(dwell=0.0))
    end = stage.end(stage.play(plan([0.0, 0.0, 0.01], hold=0.0)))
    assert end.outcome == m.DONE and end.evidence["moves"] == 3


def test_the_set_point_is_smooth_with_its_derivatives() -> None:
    stage = Stage()
    stage.end(stage.play(plan([0.0, 0.04, 0.0])))
    p, v, a, j = np.array(stage.aims).T
    expected = p[:-1] + DT * (v[:-1] + DT * (a[:-1] / 2.0 + DT * j[:-1] / 6.0))
    # Where a piece ends within a period its jerk is that of the next one for the rest.
    off = np.abs(expected - p[1:]) > 1e-12
    assert np.count_nonzero(off) <= 2 * 7 and np.max(np.abs(expected - p[1:])) < 100.0 * DT**3
    assert np.max(np.abs(v)) == pytest.approx(0.2, rel=1e-3)
    assert np.max(np.abs(np.diff(v))) <= 2.0 * DT * 1.001
    assert np.max(np.abs(j)) == pytest.approx(100.0)


def test_a_target_is_held_for_its_time_before_the_next() -> None:
    stage = Stage()
    begun: list[float] = []
    stage.play(plan([0.0, 0.01, 0.02], hold=0.2))
    for _ in range(1500):
        stage.run(1)
        begun += [stage.s.time] * (
            len([e for e in stage.events("next move") if e.kind == "move"]) - len(begun)
        )
    length = s_curve(0.01, 0.2, 2.0, 100.0).duration
    dwell = stage.q.arrival.dwell
    assert np.diff(begun)[1] == pytest.approx(length + dwell + 0.2, abs=3.0 * DT)


def test_a_schedule_is_kept_from_where_it_begins() -> None:
    stage = Stage()
    number = stage.play(plan([0.0, 0.01, 0.02], start=[0.0, 0.5, 1.0], end=1.5, hold=math.inf))
    began = stage.s.time
    end = stage.end(number)
    assert end.outcome == m.DONE
    assert stage.s.time - began == pytest.approx(1.5 + stage.q.arrival.dwell, abs=5.0 * DT)


def test_a_move_that_does_not_arrive_stalls_the_programme() -> None:
    stage = Stage()
    number = stage.play(plan([0.0, 0.01, 0.02]))
    stage.run(60)
    stage.behind = 1e-3  # the stage is off its set point for good
    end = stage.end(number)
    assert end.outcome == m.STALLED and end.evidence["move"] == 1
    assert end.evidence["error_um"] == pytest.approx(1000.0, abs=15.0)


def test_a_beginning_that_is_not_reached_stalls_the_programme() -> None:
    stage = Stage()
    number = stage.play(plan([0.05]))
    stage.behind = 1e-3
    end = stage.end(number)
    assert end.outcome == m.STALLED and end.evidence["move"] == -1
    assert end.evidence["error_um"] == pytest.approx(1000.0, abs=15.0)


@pytest.mark.parametrize(("later", "end_s"), [(0.6, 1.2), (2.0, 3.0)])  # cut off; out of patience
def test_a_scheduled_move_that_is_cut_off_is_told_and_the_schedule_goes_on(
    later: float, end_s: float
) -> None:
    stage = Stage()
    schedule = [0.0, 0.1, later]
    number = stage.play(plan([0.0, 0.01, 0.02], start=schedule, end=end_s, hold=math.inf))
    stage.run(150)
    stage.behind = 1e-3
    while not stage.events("cut off"):
        stage.run(1)
    stage.behind = 0.0
    end = stage.end(number)
    assert end.outcome == m.STALLED and stage.place == pytest.approx(0.02, abs=1e-4)
    assert end.evidence["cut_off_move"] == 1 and end.evidence["moves"] == 3
    assert len(stage.events("cut off")) == 1


def test_the_first_move_that_was_cut_off_is_told_at_the_end() -> None:
    stage = Stage()
    number = stage.play(plan([0.0, 0.01, 0.02], start=[0.0, 0.1, 0.6], end=1.2, hold=math.inf))
    stage.run(150)
    stage.behind = 1e-3
    end = stage.end(number)
    assert len(stage.events("cut off")) == 2 and end.evidence["cut_off_move"] == 1


def test_an_end_before_its_last_moves_is_told() -> None:
    stage = Stage()
    number = stage.play(plan([0.0, 0.01, 0.02], start=[0.0, 0.3, 9.0], end=1.0, hold=math.inf))
    end = stage.end(number)
    assert end.outcome == m.STALLED and end.evidence["moves_left"] == 1


def test_a_stop_ends_it_on_the_way() -> None:
    stage = Stage()
    number = stage.play(plan([0.0, 0.08]))
    stage.run(250)
    assert stage.g.aim.velocity > 0.1 and stage.s.mode == m.MOVING_MACRO
    stage.s, _, notices = stage._accept(m.Stop())
    stage.notices += notices
    end = stage.end(number)
    assert end.outcome == m.STOPPED_BY_REQUEST and 0.01 < stage.place < 0.07
    stage.run(10)
    assert stage.g.aim.velocity == 0.0


@pytest.mark.parametrize("wrong", [None, 5, plan([0.0])._replace(target=np.empty(0))])
def test_what_is_no_plan_is_refused(wrong: Any) -> None:
    found = _playing.motion(Stage().s, wrong, PITCH)
    assert isinstance(found, Refused) and "no programme" in found.reason


@pytest.mark.parametrize("made", [
    plan([0.0, 0.1001]), plan([-0.0052]), plan([0.0], origin=0.11),
    plan([0.0, 0.01])._replace(pieces=np.add(plan([0.0, 0.01]).pieces, [0, 0.2, 0, 0, 0])),
])  # fmt: skip
def test_what_leaves_the_soft_limits_is_refused(made: Plan) -> None:
    found = _playing.motion(Stage().s, made, PITCH)
    assert isinstance(found, Refused) and "beyond the soft limits" in found.reason
    assert found.remedy == "stay within -5 to 100 mm"


def test_all_of_the_soft_limits_may_be_used() -> None:
    half = 0.5 * PITCH  # soft limits are whole counts
    found = _playing.motion(Stage().s, plan([-0.005 - half, 0.1 + half]), PITCH)
    assert not isinstance(found, Refused) and found.kind == "programme" and found.id == 1
