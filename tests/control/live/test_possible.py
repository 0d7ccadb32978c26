"""What a client may offer in a mode is what the machine does not refuse for the mode."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.control.live import messages as m
from macromicro.control.live.accept import accept
from macromicro.control.live.alone import possible
from macromicro.control.live.messages import Accepted
from macromicro.control.live.parameters import Live
from macromicro.control.supervisor import Plan

from .bench import Machine, homed

PLAN = Plan(np.array([np.nan]), np.array([0]), np.array([30.0]), np.array([0.0]), np.nan)
SAMPLES = (
    m.Enable(), m.Disable(), m.Home(), m.Zero(), m.Stop(), m.EmergencyStop(), m.Fan(True),
    m.MoveTo(0.02), m.MoveBy(0.02), m.MoveMacro(200), m.MoveMicro(1e-3), m.Programme(PLAN),
    m.ClearFault(True), m.SetLimits(None),
)  # fmt: skip


def check(machine: Machine) -> None:
    """Every request with sensible values, against what is offered."""
    s = machine.s
    offered = possible(
        s.mode,
        moving=s.motion is not None,
        trusted=s.frame.trusted,
        supersede=machine.p.settings.supersede == 1,
    )
    for request in SAMPLES:
        _, reply, _ = accept(machine.p, s, request)
        assert isinstance(reply, Accepted) == (type(request) in offered), (machine.mode, request)
    jog = m.Jog("macro", 0.005)
    _, reply, _ = accept(machine.p, s, jog)
    own = s.motion is not None and s.motion.kind == "jog macro"
    assert own or isinstance(reply, Accepted) == (m.Jog in offered), machine.mode


@pytest.mark.parametrize("supersede", [0, 1])
def test_offered_is_what_is_not_refused_for_the_mode(supersede: int) -> None:
    seen = set()

    def look(machine: Machine) -> None:
        check(machine)
        seen.add(machine.mode)

    def fresh() -> Machine:
        return homed(live=Live(supersede=supersede))

    fallen = Machine(live=Live(supersede=supersede))
    fallen.see()
    look(fallen)  # disabled, not trusted
    fallen.ask(m.Enable())
    look(fallen)  # ready, not trusted
    fallen.ask(m.Home())
    fallen.see()
    look(fallen)
    fallen.ask(m.Stop())
    fallen.see()
    look(fallen)  # stopped, and coming to rest
    machine = fresh()
    look(machine)
    machine.ask(m.MoveTo(0.02))
    machine.see()
    look(machine)
    machine.see(seconds=0.01)
    machine.ask(m.Stop())
    look(machine)
    machine.see(seconds=0.5)
    look(machine)  # at rest
    machine = fresh()
    machine.ask(m.MoveMicro(1e-3))
    machine.see()
    look(machine)
    machine.ask(m.Stop())
    look(machine)  # holding
    machine = fresh()
    machine.ask(m.MoveMacro(1))
    machine.see(encoder=1.0, seconds=0.3)
    look(machine)
    machine.fault()
    look(machine)
    machine = fresh()
    machine.ask(m.Disable())
    look(machine)
    assert seen >= set(m.MODES) - {"settling"}


XY = ("x", "y")


def test_several_stages_are_offered_points_and_nothing_of_one_place() -> None:
    offered = possible(m.READY, moving=False, trusted=True, stages=XY)
    assert {m.MovePoint, m.MoveAxis, m.Jog, m.Home, m.Programme} <= offered
    assert not {m.MoveTo, m.MoveMacro, m.Zero, m.Fan, m.SetLimits} & offered
    untrusted = possible(m.READY, moving=False, trusted=False, stages=XY)
    assert m.Home in untrusted and not {*m.AXES_MOVES, *m.ONE_MOVES} & untrusted


@pytest.mark.parametrize(
    ("mode", "trusted", "supersede", "offered"),
    [
        (m.MOVING_MACRO, True, True, True),
        (m.SETTLING, True, True, True),
        (m.MOVING_MACRO, True, False, False),
        (m.MOVING_MACRO, False, True, False),
        (m.HOMING, True, True, False),
    ],
)
def test_a_move_of_several_stages_may_be_replaced(
    mode: int, trusted: bool, supersede: bool, offered: bool
) -> None:
    found = possible(mode, moving=True, trusted=trusted, supersede=supersede, stages=XY)
    assert (m.MovePoint in found) is offered


def test_only_a_stage_that_moves_can_end_a_stream() -> None:
    def ends(mode: int, moving: bool) -> bool:
        return m.EndFollow in possible(mode, moving=moving, trusted=True)

    assert ends(m.MOVING_MACRO, True) and ends(m.MOVING_MICRO, True)
    assert not ends(m.SETTLING, True) and not ends(m.READY, False)
