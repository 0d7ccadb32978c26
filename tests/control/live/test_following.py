"""Set points that a client streams, and jogs that it must renew: the two-stage machine."""

from __future__ import annotations

import math

import pytest

from macromicro.control.live import following
from macromicro.control.live import messages as m
from macromicro.control.live.leading import REST, Aim
from macromicro.control.live.messages import Accepted, Finished, Refused
from macromicro.control.live.state import Followed

from .bench import DT, PITCH
from .follower import Follower, ready

HOLD = 0.05


def put(f: Follower, position: float, velocity: float = 0.0, age: float = 0.0) -> None:
    f.s, notices = following.take_set_point(f.p, f.s, position, velocity, age)
    f.note(notices)


def ended(f: Follower, seconds: float = 3.0) -> Finished:
    known = len(f.ends)
    for _ in range(round(seconds / DT)):
        if len(f.ends) > known:
            return f.ends[-1]
        f.tick()
    raise AssertionError(f.s)


def streamed(f: Follower, stage: str, goal: float, seconds: float) -> None:
    assert f.ask(m.Follow(stage, HOLD)) == Accepted(1)
    for _ in range(round(seconds / DT)):
        put(f, goal)
        f.tick()


@pytest.mark.parametrize(("stage", "goal"), [("macro", 60 * PITCH), ("micro", 0.4e-3)])
def test_a_stage_goes_to_the_last_set_point_and_ends_there(stage: str, goal: float) -> None:
    f = ready()
    streamed(f, stage, goal, 0.4)
    assert f.mode == f"moving-{stage}"
    assert f.ask(m.EndFollow()) == Accepted(1)
    end = ended(f)
    assert end.outcome == m.DONE and end.evidence["set_points"] == 400
    assert f.mode == {"macro": "ready", "micro": "holding"}[stage]
    place = f.s.seen.fine if stage == "micro" else f.s.seen.encoder * PITCH
    assert place == pytest.approx(goal, abs=2.5 * PITCH if stage == "macro" else 1e-5)


@pytest.mark.parametrize("stage", m.STAGES)
def test_without_a_set_point_for_the_hold_time_it_comes_to_rest(stage: str) -> None:
    f = ready()
    streamed(f, stage, 60 * PITCH if stage == "macro" else 0.4e-3, 0.1)
    f.run(HOLD - DT)
    assert f.s.motion is not None and f.mode == f"moving-{stage}"
    f.run(3 * DT)
    assert f.mode == {"macro": "stopped", "micro": "holding"}[stage]
    told = next(e for e in f.events if e.cause == "hold time over")
    assert told.kind == "mode"
    end = f.ends[-1] if f.ends else ended(f)
    assert end.outcome == m.LOST and end.evidence["hold_s"] == HOLD
    put(f, 1.0)  # it comes too late
    f.run(0.2)
    assert f.s.motion is None


def test_it_ends_with_a_stop_and_with_another_motion() -> None:
    f = ready()
    streamed(f, "macro", 0.01, 0.1)
    assert isinstance(f.ask(m.MoveMacro(20)), Refused)
    assert isinstance(f.ask(m.Follow("macro", HOLD)), Refused)
    assert f.ask(m.MoveMacro(20, replace=True)) == Accepted(2)
    assert f.ends[-1].outcome == m.SUPERSEDED
    f.run(1.0)
    assert f.ask(m.Follow("macro", HOLD)) == Accepted(3)
    f.run(0.02)
    f.ask(m.Stop())
    assert ended(f).outcome == m.STOPPED_BY_REQUEST


def test_set_points_beyond_the_soft_limits_are_clipped_and_told_once() -> None:
    f = ready()
    most = f.p.settings.limits.micro_high
    assert f.ask(m.Follow("micro", 1.0)) == Accepted(1)
    for _ in range(400):
        put(f, 0.01, 5.0)
        f.tick()
        assert f.s.drive.micro_reference <= most
    told = [e for e in f.events if e.kind == "follow"]
    assert [e.cause for e in told] == ["set point clipped to the soft limits"]
    assert told[0].evidence["position_mm"] == 10.0
    assert told[0].evidence["high_mm"] == pytest.approx(most * 1e3)
    f.ask(m.Stop())
    f.ask(m.Follow("micro", 1.0))
    f.run(0.01)
    f.ask(m.EndFollow())
    assert ended(f).outcome == m.DONE  # without any set point it rests where it is


def test_only_a_stage_that_follows_takes_set_points() -> None:
    f = ready()
    f.ask(m.Jog("macro", 0.01))
    f.tick()
    assert following.take_set_point(f.p, f.s, 0.001, 0.0, 0.0) == (f.s, ())
    f.ask(m.Stop())
    f.run(1.0)
    f.ask(m.Follow("macro", HOLD))
    f.tick()
    low, high = following.bounds(f.p, f.s, f.s.motion)  # type: ignore[arg-type]
    limits = f.p.settings.limits
    assert (low, high) == (limits.macro_low * PITCH, limits.macro_high * PITCH)
    f.s, notices = following.take_set_point(f.p, f.s, 0.001, 0.0, 0.0)
    assert notices == ()  # within the limits
    f.ask(m.EndFollow())
    assert following.take_set_point(f.p, f.s, 0.002, 0.0, 0.0) == (f.s, ())


def test_a_late_set_point_goes_on_with_its_velocity() -> None:
    f = ready()
    f.ask(m.Follow("macro", 0.5))
    f.tick()
    put(f, 0.001, 0.02, age=0.1)
    work = f.s.work
    aim = following.target(work, f.s.time + 0.05, -1.0, 1.0, 0.0)  # type: ignore[arg-type]
    assert aim.position == pytest.approx(0.001 + 0.02 * 0.15)
    assert tuple(aim[1:]) == (0.02, 0.0, 0.0)
    assert following.target(work, f.s.time, -1.0, 0.002, 0.0) == REST._replace(position=0.002)  # type: ignore[arg-type]
    ending = work._replace(ending=True)  # type: ignore[union-attr]
    assert following.target(ending, f.s.time, -1.0, 1.0, 0.0) == REST._replace(position=0.001)
    put(f, 0.001, 0.02, age=9.0)  # never older than the hold time
    assert f.s.time - f.s.work.since == pytest.approx(0.5)  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("request_", "said"),
    [
        (m.Follow("arm", 0.1), 'name "macro" or "micro"'),
        (m.Follow("x", 0.1), "use the stage that it has"),
        (m.Follow("all", 0.1), "use the stage that it has"),
        (m.Follow("macro", 0.0), "from 0.01 to 1 s"),
        (m.Follow("macro", 2.0), "from 0.01 to 1 s"),
        (m.Follow("macro", math.nan), "from 0.01 to 1 s"),
        (m.EndFollow(), "begin with follow"),
        (m.Jog("macro", 0.01, -1.0), "from 0 to 10 s"),
        (m.Jog("macro", 0.01, 11.0), "from 0 to 10 s"),
    ],
)
def test_what_is_accepted_is_told(request_: m.Request, said: str) -> None:
    reply = ready().ask(request_)
    assert isinstance(reply, Refused) and reply.remedy == said


def test_a_machine_that_is_not_homed_does_not_follow() -> None:
    reply = ready(trusted=False).ask(m.Follow("macro", 0.1))
    assert isinstance(reply, Refused) and reply.remedy == "home first"


@pytest.mark.parametrize(("stage", "speed"), [("macro", 0.01), ("micro", 3e-4)])
def test_a_jog_ends_unless_it_is_renewed(stage: str, speed: float) -> None:
    f = ready()
    assert f.ask(m.Jog(stage, speed, 0.05)) == Accepted(1)
    for _ in range(5):
        f.run(0.04)
        f.s = following.renew(f.s)
    assert f.ask(m.Jog(stage, 0.5 * speed, 0.05)) == Accepted(1)  # renews it as well
    f.run(0.04)
    assert f.s.motion is not None and not f.ends
    f.run(0.02)
    end = f.ends[-1] if f.ends else ended(f)
    assert end.outcome == m.LOST and end.evidence["hold_s"] == 0.05
    assert any(e.cause == "hold time over" for e in f.events)


def test_a_jog_without_a_hold_time_goes_on() -> None:
    f = ready()
    f.ask(m.Jog("macro", 0.01))
    f.run(0.5)
    assert f.s.motion is not None
    assert following.renew(f.s).motion == f.s.motion


@pytest.mark.parametrize("offset", [-0.7, 0.3])
@pytest.mark.parametrize("goal", [-0.5, 0.004, 0.5])
def test_a_stage_is_led_alike_whatever_frame_its_encoder_has(offset: float, goal: float) -> None:
    """Its soft limits and set points are those of the homed frame, its own way is the encoder's."""
    rates, ends = (0.2, 2.0, 100.0), (-0.01, 0.02)
    works = [Followed(HOLD, 0.0, goal, 0.01, 0.0)] * 2
    here = [Aim(each, 0.0, 0.0, 0.0) for each in (0.025, 0.025 + offset)]
    for k in range(400):
        for n, off in enumerate((0.0, offset)):
            works[n], seen, here[n], _ = following.led(
                works[n], rates, ends, here[n], k * DT, DT, off
            )
            assert ends[0] - 1e-12 <= seen.position - off <= ends[1] + 1e-12
        assert here[1].position - offset == pytest.approx(here[0].position, abs=1e-9)
        assert -0.01 - 1e-9 <= here[0].position <= 0.025 + 1e-9
    near = min(max(goal + 0.01 * 400 * DT, -0.01), 0.02)
    assert here[0].position == pytest.approx(near, abs=1e-4)


def test_before_the_first_set_point_a_stage_is_led_nowhere() -> None:
    here, rates = Aim(0.3, 0.0, 0.0, 0.0), (0.2, 2.0, 100.0)
    _, goal, aim, _ = following.led(Followed(HOLD, 0.0), rates, (-1.0, 1.0), here, 0.0, DT, 0.3)
    assert goal == aim == REST._replace(position=0.3)


def test_a_place_without_a_speed_is_one_to_stand_at_and_a_jog_goes_on() -> None:
    assert m.SetPoint(0.01).velocity == 0.0 == m.Jog("macro", 0.01).hold
