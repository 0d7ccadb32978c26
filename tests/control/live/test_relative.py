"""Relative moves start from the last target, so that steps add up; docs/serve.md, "Motions"."""

from __future__ import annotations

import math
from typing import Any

import pytest

from macromicro.control.live import messages as m
from macromicro.control.live import targets
from macromicro.control.live.messages import Accepted

from .follower import Follower
from .test_moves import ready


def done(f: Follower, request: Any) -> None:
    reply = f.ask(request)
    assert isinstance(reply, Accepted), reply
    for _ in range(5000):
        if f.s.motion is None:
            break
        f.tick()
    assert f.ends[-1].outcome == "done"


def test_steps_of_the_macro_stage_add_up() -> None:
    """Each begins at the target, however far within its tolerance the carriage came to rest; and
    fractions of a count are not lost."""
    f = ready()
    done(f, m.MoveMacro(100))
    for k in range(1, 11):
        f.encoder -= 1.0  # pushed, within the tolerance
        f.tick()
        done(f, m.MoveMacroBy(10.4))
        assert f.s.target.macro == pytest.approx(100 + k * 10.4)
        sent = f.command.macro_reference - f.s.frame.offset
        assert sent == math.floor(100 + k * 10.4 + 0.5)


@pytest.mark.parametrize("kind", [m.MoveBy, m.MoveMacroBy, m.MoveMicroBy])
def test_no_number_is_no_reason_while_nothing_may_move(kind: Any) -> None:
    f = ready()
    f.ask(m.Disable())
    assert f.ask(kind("x")) == f.ask(kind(1.0))


def test_a_carriage_that_was_moved_by_hand_starts_from_where_it_is() -> None:
    """Its motor is off at rest."""
    f = ready()
    done(f, m.MoveMacro(100))
    f.encoder += 50.0
    f.tick()
    here = f.s.seen.encoder - f.s.frame.offset
    done(f, m.MoveMacroBy(10))
    assert f.s.target.macro == here + 10


def test_steps_of_the_micro_stage_add_up() -> None:
    f = ready()
    done(f, m.MoveMicro(0.5e-3))
    for k in range(1, 11):
        f.tick(noise=5e-6)  # what was read last is not where it was sent
        done(f, m.MoveMicroBy(10e-6))
        assert f.s.target.micro == pytest.approx(0.5e-3 + k * 10e-6, abs=1e-12)
    f.tick(noise=5e-6)
    assert targets.origin(f.p, f.s) == pytest.approx(
        (f.s.seen.encoder - f.s.frame.offset) * f.p.settings.pitch + 0.6e-3, abs=1e-12
    )


def test_one_that_replaces_another_starts_from_the_targets_of_that() -> None:
    f = ready()
    done(f, m.MoveTo(0.01))
    f.ask(m.MoveBy(0.01))
    f.run(0.005)
    done(f, m.MoveBy(0.01, replace=True))
    assert f.s.target.whole == pytest.approx(0.03, abs=1e-12)
    f.ask(m.MoveMacroBy(50))
    f.run(0.003)
    first = f.s.target.macro
    done(f, m.MoveMacroBy(50, replace=True))
    assert f.s.target.macro == first + 50


@pytest.mark.parametrize("cut", ["stop", "jog", "disable", "fault", "home"])
def test_what_was_not_reached_or_is_not_held_is_no_start(cut: str) -> None:
    """Then it is the present position."""
    f = ready()
    done(f, m.MoveTo(0.01))
    if cut == "stop":
        f.ask(m.MoveTo(0.03))
        f.run(0.005)
        f.ask(m.Stop())
        f.run(0.3)
    elif cut == "jog":
        f.ask(m.Jog("macro", 0.01))
        f.run(0.02)
        f.ask(m.Jog("macro", 0.0))
        f.run(0.3)
    elif cut == "disable":
        f.ask(m.Disable())
        f.ask(m.Enable())
    elif cut == "fault":
        f.fault()
        f.ask(m.ClearFault(True))
        f.ask(m.Enable())
    else:
        done(f, m.Home())
    f.tick()
    assert all(math.isnan(each) for each in f.s.target)
    assert targets.origin(f.p, f.s) == f.s.seen.position


@pytest.mark.parametrize("kind", [m.MoveMacroBy, m.MoveMicroBy])
@pytest.mark.parametrize("value", [math.nan, math.inf, "5", None, True, 1e9, -1e9, 1e308])
def test_no_distance_is_refused(kind: Any, value: Any) -> None:
    f = ready()
    assert isinstance(f.ask(kind(value)), m.Refused) and f.s.motion is None


def test_targets_are_those_of_the_homed_frame() -> None:
    f = ready(coordinate=25.0)
    f.ask(m.MoveMacro(100))
    assert f.s.target.macro == 100.0
