"""A stage led by set points follows those that a client streams."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.control.live import messages as m
from macromicro.control.live.leading import at
from macromicro.control.live.messages import Accepted, Event, Finished

from .test_machine import Machine

DT, HOLD = 1e-3, 0.05


@pytest.fixture
def screw() -> Machine:
    machine = Machine()
    assert isinstance(machine.ask(m.MoveTo(0.02)), Accepted)
    machine.run(1500)
    return machine


def put(machine: Machine, position: float, velocity: float = 0.0) -> None:
    machine.notices += machine.led.heard(((position, velocity),), 0.0)
    machine.run(1)


def ended(machine: Machine, number: int, periods: int = 3000) -> Finished:
    for _ in range(periods):
        ends = [n for n in machine.notices if isinstance(n, Finished) and n.id == number]
        if ends:
            return ends[0]
        machine.run(1)
    raise AssertionError(machine.led.state)


def test_a_sine_is_followed_and_ended_at_its_last_point(screw: Machine) -> None:
    w, size = 2.0 * math.pi, 5e-3
    assert screw.ask(m.Follow("macro", HOLD)) == Accepted(2)
    off = []
    for k in range(2000):
        t = k * DT
        put(screw, 0.02 + size * math.sin(w * t), size * w * math.cos(w * t))
        off.append(screw.led.state.seen.position - 0.02 - size * math.sin(w * t))
    assert np.abs(off[500:]).max() < 0.02 * size
    put(screw, 0.021, 0.05)
    assert screw.ask(m.EndFollow()) == Accepted(2)
    put(screw, 0.03)  # behind the end there are none
    end = ended(screw, 2)
    assert end.outcome == m.DONE and end.evidence["set_points"] == 2001
    assert end.position == pytest.approx(0.021, abs=2e-5)
    assert screw.led.view().target == pytest.approx(0.021, abs=1e-6)


def test_it_rests_within_hold_and_braking(screw: Machine) -> None:
    guide = screw.led.guide
    screw.ask(m.Follow("macro", HOLD))
    for k in range(400):
        put(screw, 0.02 + 0.05 * k * DT, 0.05)
    assert screw.led.course.aim.velocity == pytest.approx(0.05, rel=0.05)
    screw.run(round(HOLD / DT) - 2)
    assert screw.led.state.mode == m.MOVING_MACRO  # until then it goes on with the velocity
    screw.run(4 + math.ceil(0.05 / guide.acceleration / DT) + 1)
    assert screw.led.course.aim.velocity == 0.0
    assert ended(screw, 2).outcome == m.LOST
    assert [n.cause for n in screw.notices if isinstance(n, Event) and n.kind == "mode"][-1] == (
        "hold time over"
    )


def test_a_move_may_take_its_place_at_any_speed(screw: Machine) -> None:
    screw.ask(m.Follow("macro", HOLD))
    for k in range(200):
        put(screw, 0.02 + 0.05 * k * DT, 0.05)
    assert screw.ask(m.MoveTo(0.01, replace=True)) == Accepted(3)
    assert ended(screw, 2).outcome == m.SUPERSEDED
    assert ended(screw, 3).outcome == m.DONE
    screw.ask(m.MoveTo(0.05))
    screw.run(200)
    assert screw.ask(m.Stop()) == Accepted(0)


anything = st.floats(allow_nan=False, allow_infinity=False, width=32)
points = st.lists(
    st.tuples(st.integers(1, 45), anything | st.floats(-0.1, 0.2), anything | st.floats(-0.5, 0.5)),
    min_size=1,
    max_size=8,
)
SCREW: list[Machine] = []


@settings(max_examples=25, deadline=None)
@given(points, st.sampled_from([m.Stop(), m.EndFollow(), None]))
def test_whatever_is_streamed_keeps_the_limits(
    asked: list[tuple[int, float, float]], last: m.Request | None
) -> None:
    if not SCREW:
        SCREW.append(Machine())
    machine, guide = SCREW[0], SCREW[0].led.guide
    reply = machine.ask(m.Follow("macro", HOLD))
    assert isinstance(reply, Accepted)
    low, high = _travel(machine)

    def look() -> None:
        course = machine.led.course
        begins = [0.0, *(begin for begin, _ in course.later), DT]
        aims = [course.aim, *(aim for _, aim in course.later)]
        for aim, begin, end in zip(aims, begins[:-1], begins[1:], strict=True):
            for h in (0.0, end - begin):
                found = at(aim, h)
                # One that was let go at rest stands, and comes back, from where its encoder reads.
                back = found.velocity * (0.5 * (low + high) - found.position) >= 0.0
                slack = machine.led.pitch if back else 1e-9
                assert low - slack <= found.position <= high + slack
                assert abs(found.velocity) <= guide.velocity * (1.0 + 1e-6)
                assert abs(found.acceleration) <= guide.acceleration * (1.0 + 1e-6)

    for count, position, velocity in asked:
        for _ in range(count):
            put(machine, position, velocity)
            look()
    if last is not None:
        machine.ask(last)
    for _ in range(4000):
        machine.run(1)
        look()
        if machine.led.state.motion is None:
            break
    assert ended(machine, reply.id).outcome in (m.STOPPED_BY_REQUEST, m.DONE, m.LOST)


def _travel(machine: Machine) -> tuple[float, float]:
    limits, pitch = machine.led.view().limits, machine.led.pitch
    offset = machine.led.state.frame.offset * pitch
    return limits.macro_low * pitch + offset, limits.macro_high * pitch + offset
