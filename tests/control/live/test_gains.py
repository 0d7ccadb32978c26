"""Gains of a running machine."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Change, Refused
from macromicro.control.supervisor import Plan
from macromicro.schema.par import entries

from .follower import QUICK, QUICK_CONTROL, ready


def test_new_values_are_in_force_and_old_ones_told() -> None:
    f = ready()
    reply = f.ask(m.SetGains((("pd_tuned.now", 0.02), ("sequence.wait", 1))))
    assert reply == Accepted(
        0, (Change("pd_tuned.now", 0.0124593, 0.02), Change("sequence.wait", 0.01, 1.0))
    )
    assert f.s.laws.macro.own.now == 0.02 and f.s.laws.sequence.wait == 1.0
    assert f.s.control.pd_tuned.now == 0.02
    assert f.events[-1].evidence["pd_tuned.now"] == {"old": 0.0124593, "new": 0.02}
    f.ask(m.MoveMacro(100))
    assert f.tick().motor == pytest.approx(3.0 + 0.02 * 100.0)


@pytest.mark.parametrize("changes", [
    (), None, 5, [("pd_tuned.now", 0.02)],
    "pd_tuned.now", ("pd_tuned.now", 1.0), (("pd_tuned.now",),), (("nothing", 1.0),),
    ((None, 1.0),), (("pd_tuned.now", math.nan),), (("pd_tuned.now", math.inf),),
    (("pd_tuned.now", "0.01"),), (("pd_tuned.now", True),), (("dead_zone", -0.1),),
    (("dead_zone", 5.1),), (("sequence.patience", 0.0),), (("sequence.park", 0.5),),
    (("macro_law", "fuzzy"),), (("macro_law", 1),), (("p.ki", 0.1),),
    (("pi_antiwindup.low", 2.0),), (("pd_tuned.now", 0.02), ("dead_zone", 9.0)),
    (("pid.kp", 1e300),), (("sequence.tolerance", 1e308),), (("sequence.patience", 1e-300),),
])  # fmt: skip
def test_what_cannot_be_changes_nothing(changes: Any) -> None:
    f = ready()
    before = f.s
    reply = f.ask(m.SetGains(changes))
    assert isinstance(reply, Refused) and reply.reason and reply.remedy
    assert f.s is before


def test_a_limit_beyond_the_other_is_told_with_the_others_value() -> None:
    reply = ready().ask(m.SetGains((("pi_antiwindup.low", 4.0),)))
    assert isinstance(reply, Refused)
    assert reply.reason == "pi_antiwindup.low: 4 V does not fit the others"
    assert reply.remedy == "accepted: below pi_antiwindup.high (1.9 V)"


def test_two_limits_may_pass_each_other_together() -> None:
    f = ready()
    both = (("pi_antiwindup.low", 2.0), ("pi_antiwindup.high", 3.0))
    assert isinstance(f.ask(m.SetGains(both)), Accepted)


def test_a_motion_refuses_them_unless_configured() -> None:
    change = m.SetGains((("pd_tuned.now", 0.02),))
    for allowed in (0, 1):
        f = ready(live=QUICK._replace(gains_while_moving=allowed))
        f.ask(m.MoveMacro(100))
        f.tick()
        assert isinstance(f.ask(change), Accepted) == bool(allowed)
        assert isinstance(f.ask(m.SetGains((("macro_law", "pid"),))), Refused)


def test_a_new_gain_does_not_move_a_held_stage() -> None:
    f = ready()
    f.ask(m.MoveMicro(1e-3))
    f.until("holding")
    f.ask(m.SetGains((("pi_antiwindup.low", 0.0), ("pi_antiwindup.high", 5.0))))
    f.fine = 0.9e-3
    before = f.tick()
    error = f.s.drive.micro_reference - f.s.seen.fine
    assert error > 0.01e-3
    expected = f.s.laws.micro.kp * error + f.s.drive.integral
    f.ask(m.SetGains((("pi_antiwindup.kp", 6e3),)))
    assert f.s.laws.micro.kp * error + f.s.drive.integral == pytest.approx(expected)
    assert 0.0 < before.ctrl < 5.0


def test_a_law_without_an_integral_keeps_none() -> None:
    f = ready()
    f.ask(m.MoveMicro(1e-3))
    f.until("holding")
    assert f.s.drive.integral != 0.0
    f.ask(m.SetGains((("micro_law", "p"),)))
    assert f.s.drive.integral == 0.0 and f.s.laws.micro.ki == 0.0


@pytest.mark.parametrize("wanted", [0, 1])
@pytest.mark.parametrize("moving", [False, True])
def test_parking_or_not_moves_no_carriage(wanted: int, moving: bool) -> None:
    """Pushed by hand while it was parked, or held against a push: it is held where it is."""
    q = QUICK_CONTROL.sequence._replace(park=1 - wanted)
    f = ready(live=QUICK._replace(gains_while_moving=1), control=QUICK_CONTROL._replace(sequence=q))
    f.ask(m.MoveMicro(1e-3))
    f.until("moving-micro" if moving else "holding")
    for _ in range(42):
        f.encoder += 1.0
        f.out = f.out._replace(motor=0.0)  # stronger than the motor
        f.tick()
        if moving and f.mode != "moving-micro":
            f.ask(m.MoveMicro(2e-3 if f.fine < 1.5e-3 else 1e-3))
    f.out = f.out._replace(motor=0.0)
    there = f.encoder
    assert there == pytest.approx(42.0, abs=2.0)
    assert isinstance(f.ask(m.SetGains((("sequence.park", wanted),))), Accepted)
    for _ in range(20):
        assert f.tick().motor == 0.0
        assert f.command.macro_reference == there or wanted == 1
    assert f.encoder == there


def test_the_tolerance_leaves_what_the_micro_stage_can_make_up_for() -> None:
    """Twice 3.5 mm, at 14 counts a millimetre."""
    f = ready()
    reply = f.ask(m.SetGains((("sequence.tolerance", 98.1),)))
    assert isinstance(reply, Refused)
    assert reply.reason == "sequence.tolerance: 98.1 count is above 98 count"
    assert isinstance(f.ask(m.SetGains((("sequence.tolerance", 97.9),))), Accepted)


def test_the_memory_of_a_micro_stage_that_is_off_stays_empty() -> None:
    f = ready()
    f.run(0.003)
    f.ask(m.SetGains((("pi_antiwindup.kp", 1e3),)))
    assert f.s.drive.integral == 0.0


@pytest.mark.parametrize("moving", [True, False])
def test_parking_concerns_nothing_but_a_carriage_under_the_micro_stage(moving: bool) -> None:
    f = ready(live=QUICK._replace(gains_while_moving=1))
    if moving:
        f.ask(m.Jog("macro", 0.03))
    f.run(0.02)
    before = f.s.drive
    f.encoder += 3.0
    assert isinstance(f.ask(m.SetGains((("sequence.park", 0),))), Accepted)
    assert f.s.drive == before


def test_a_programme_keeps_its_macro_target_when_parking_is_changed() -> None:
    f = ready(live=QUICK._replace(gains_while_moving=1))
    nan = math.nan
    columns = ([nan, nan], [0, 1], [60.0, 1e-3], [0.0, 0.001])
    f.ask(m.Programme(Plan(*(np.array(c) for c in columns), nan)))
    while math.isnan(f.s.work.over):
        f.tick()
    f.encoder -= 1.0
    f.tick()
    f.ask(m.SetGains((("sequence.park", 0),)))
    f.tick()
    assert f.command[:2] == (60.0, 1.0) and f.out.motor > 0.0


def test_a_gain_that_makes_the_loop_unstable_is_refused_in_its_own_unit() -> None:
    f = ready()
    reply = f.ask(m.SetGains((("pi.ki", 1e9),)))
    ki = next(entry.par for entry in entries(f.s.control) if entry.path == "pi.ki")
    assert isinstance(reply, Refused)
    assert reply.reason == f"pi.ki: {ki.spoken(1e9)} does not fit the others"
