"""Numbers of the live core that a run as a whole would let pass if they were wrong."""

from __future__ import annotations

import math
from typing import Any

import pytest

from macromicro.control.live import _moves, _programme, brake, edges, survey
from macromicro.control.live import messages as m
from macromicro.control.live import transitions as t
from macromicro.control.live.parameters import Live
from macromicro.control.live.state import REST, coordinate
from macromicro.control.live.survey import Moving, Survey
from macromicro.control.supervisor import begin
from macromicro.types import Sample

from .bench import PITCH, Bench, homed
from .follower import QUICK, ready

NAN = math.nan
Q = Live().edges
DT = 1e-3


@pytest.mark.parametrize(("speed", "way"), [(0.0, 25.0), (2000.0, 96.428571), (-2000.0, 96.428571)])
def test_the_way_of_a_stop(speed: float, way: float) -> None:
    """v^2 pitch / (2 * 2 m/s^2) and the margin."""
    assert brake.distance(homed().p, speed) == pytest.approx(way)


def test_a_stop_begins_with_empty_memories_at_the_present_speed() -> None:
    machine = homed()
    machine.ask(m.MoveMacro(2000))
    for k in range(100):
        machine.see(2.0 * k)
    assert machine.s.drive.memory != REST
    machine.ask(m.Stop())
    d, work = machine.s.drive, machine.s.work
    assert (d.memory, d.integral, d.micro_reference, d.reset) == (REST, 0.0, 0.0, False)
    assert d.macro_reference == work.origin == 198.0
    assert work.speed == pytest.approx(2000.0, rel=1e-3) and work.goal == 2000.0
    assert work.until - machine.s.time == pytest.approx(work.speed * PITCH / 2.0 + 1.0)
    # The law is damped from the first period on: its error is that of the moving reference.
    machine.see(200.0)
    less = 2.0 / PITCH * DT
    assert machine.s.work.speed == pytest.approx(work.speed - less)
    assert machine.command.macro_reference == pytest.approx(198.0 + machine.s.work.speed * DT)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_jog_slows_down_before_its_soft_limit(sign: float) -> None:
    limits = QUICK.limits._replace(macro_low=-150.0, macro_high=150.0)
    f = ready(live=QUICK._replace(limits=limits))
    f.ask(m.Jog("macro", sign * 0.05))
    most = f.p.settings.brake.deceleration / PITCH
    last, slowed = f.command.macro_reference, 0
    while not f.ends:
        f.tick()
        if f.mode != "moving-macro":
            continue
        reference = f.command.macro_reference
        left = 150.0 - sign * last
        speed = abs(reference - last) / DT
        braked = max(speed - 2.0 * most * DT, 0.0)  # two periods behind
        assert braked * braked <= 2.0 * most * left + 1e-6
        slowed += 0.0 < speed < 600.0 and left < 8.0
        last = reference
    assert slowed >= 5


def test_when_a_programmes_macro_move_has_arrived() -> None:
    machine = homed()
    q = machine.s.laws.sequence
    at = begin(0.0)._replace(macro_reference=500.0)
    since = at._replace(inside=7.0)

    def arrived(before: Any, encoder: float, time: float) -> bool:
        return _programme._has_arrived(machine.s, before, Sample(time, encoder, 0.0, 0.0, 0.0, 0.0))

    for off in (q.tolerance, -q.tolerance):
        assert arrived(since, 500.0 + off, 7.0 + q.dwell)
        assert not arrived(since, 500.0 + 1.01 * off, 7.0 + q.dwell)
    assert not arrived(since, 500.0, 7.0 + 0.9 * q.dwell)
    assert not arrived(at, 500.0, 99.0)  # it came within only now
    assert not arrived(since, NAN, 99.0)


@pytest.mark.parametrize("mode", [m.READY, m.STOPPED, m.DISABLED, m.FAULT, m.HOLDING])
def test_what_ends_is_switched_off_unless_it_is_held(mode: int) -> None:
    machine = homed()
    machine.ask(m.MoveTo(1.5e-3))
    machine.see(0.0, seconds=0.05)
    assert machine.s.motion is not None
    s = machine.s._replace(drive=machine.s.drive._replace(integral=1.2, micro_reference=1e-3))
    ended, _ = t.conclude(machine.p, s, mode, (m.DONE, t.ON_TARGET), {})
    held = mode == m.HOLDING
    assert ended.mode == mode and ended.motion is None
    assert ended.drive.integral == (1.2 if held else 0.0)
    assert ended.drive.micro_reference == (1e-3 if held else 0.0)
    assert math.isnan(ended.target.whole) != (held or mode == m.READY)


@pytest.mark.parametrize("laser", [4.9e-6, -4.9e-6, 5e-6, 5.1e-6, -5.1e-6, 1e-3])
def test_a_reset_of_the_laser(laser: float) -> None:
    v = Survey(phase=edges.begin(0.0, 0.0, PITCH, 2e-4), laser=laser, base=0.25)
    after = survey.reset_given(v)
    if abs(laser) <= 5e-6:
        assert (after.base, after.awaited) == (0.25 + laser, 0)
    else:
        assert (after.base, after.awaited) == (0.25, 200)
    assert survey.reset_given(v._replace(phase=None)) == v._replace(phase=None)


def crossing(**changed: Any) -> tuple[Survey, Survey]:
    """The survey before and after a slow crossing of the edge between the counts 10 and 11."""
    before = Survey(
        phase=edges.begin(0.0, 0.0, PITCH, 2e-4),
        counts=10.0,
        path=10.5 * PITCH,
        slow=3.0,
        edge=10.0,
    )
    before = before._replace(**{k[2:]: v for k, v in changed.items() if k.startswith("v_")})
    now = before._replace(counts=11.0, path=10.51 * PITCH)
    now = now._replace(**{k: v for k, v in changed.items() if not k.startswith("v_")})
    moving = Moving(0.0, 10.0, 0.0, 0.0)
    place = now.path - 0.5 * (now.counts + before.counts) * PITCH
    return now, survey._judged(Q, PITCH, before, now, place, moving, DT)


def test_an_edge_crossed_slowly_is_taken_with_its_noise() -> None:
    for slow, rocking in ((3.0, 0.0), (2.0, 0.0), (1.9, Q.rocking)):
        now, after = crossing(slow=slow)
        assert now.phase is not None
        width = 10.0 * PITCH * DT
        noise = width * width / 12.0 + Q.noise * Q.noise + rocking * rocking
        blurred = edges.blurred(now.phase, Q.drift * Q.drift * DT)
        assert after.phase == edges.taken(blurred, 11.0, now.path - 10.5 * PITCH, noise)
        assert after.phase.number == 1 and after.edge == 11.0


@pytest.mark.parametrize(
    "changed",
    [
        {"counts": 12.0},
        {"counts": 10.0},
        {"v_edge": 11.0, "edge": 11.0},
        {"slow": 0.0},
        {"awaited": 3},
        {"awaited": 1},
        {"v_anchor": 0.0, "anchor": 0.0},
    ],
)
def test_a_crossing_that_is_not_certain_is_left_out(changed: dict[str, Any]) -> None:
    now, after = crossing(**changed)
    assert now.phase is not None and after.phase is not None
    assert after.phase.number == 0
    assert (after.phase.a, after.phase.b) == (now.phase.a, now.phase.b)
    assert after.edge == changed.get("v_edge", 10.0)


def test_a_laser_that_has_the_stage_elsewhere_widens_what_is_told() -> None:
    v = Survey(phase=edges.begin(0.0, 0.0, PITCH, 2e-4), laser=0.01, counts=140.0)
    sure = v._replace(phase=v.phase._replace(aa=1e-12, bb=0.0) if v.phase else None)
    told = survey.whole(sure, PITCH, 0.0)
    for off in (0.4 * PITCH, -0.4 * PITCH):
        assert survey.contradiction(sure, told + off, PITCH, 0.0) == 0.0
    for off in (0.6 * PITCH, -0.6 * PITCH, 3.0 * PITCH):
        wide = survey.contradiction(sure, told + off, PITCH, 0.0)
        assert wide == pytest.approx(abs(off) + PITCH)
    assert survey.contradiction(v, told + 0.9 * PITCH, PITCH, 0.0) == 0.0  # phase unsure
    assert survey.contradiction(sure._replace(awaited=2), told + 1.0, PITCH, 0.0) == 0.0
    assert survey.contradiction(sure._replace(counts=NAN), told + 1.0, PITCH, 0.0) == 0.0
    assert survey.contradiction(Survey(), 1.0, PITCH, 0.0) == 0.0


@pytest.mark.parametrize(("fine", "held"), [(-0.01e-3, 0.0), (1.2e-3, 1.2e-3)])
def test_a_micro_stage_is_held_where_it_is_but_not_below_nothing(fine: float, held: float) -> None:
    machine = homed()
    machine.ask(m.MoveMicro(2e-3))
    s = machine.s._replace(seen=machine.s.seen._replace(fine=fine))
    s, _ = _moves.stay(machine.p, s, m.STOPPED_BY_REQUEST, t.STOP)
    assert s.drive.micro_reference == held


def test_homing_gives_the_place_the_name_that_is_set() -> None:
    own = Live()
    b = Bench(0.0, live=own._replace(homing=own.homing._replace(coordinate=37.0)))
    b.tick()
    b.ask(m.Enable())
    b.ask(m.Home())
    assert b.wait(30.0).outcome == "done"
    assert coordinate(b.s) == pytest.approx(37.0, abs=b.s.laws.sequence.tolerance)
    stop = b.ends[-1].evidence["stop_raw_counts"]
    assert b.s.frame.offset == stop + own.homing.back_off - 37.0
