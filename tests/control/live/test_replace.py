"""A motion that may replace the one under way: only where its request says so."""

from __future__ import annotations

import pytest

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Refused

from .bench import Bench, homed


@pytest.mark.parametrize(
    "request_",
    [m.MoveTo(0.02), m.MoveBy(0.01), m.MoveMacro(500), m.MoveMacro(-5)],
    ids=lambda r: type(r).__name__,
)
def test_a_move_replaces_another_only_where_it_says_so(request_: m.Request) -> None:
    machine = homed()
    machine.ask(m.MoveMacro(1500))
    machine.see(20.0, seconds=0.05)
    refused = machine.ask(request_)
    assert isinstance(refused, Refused) and "under way" in refused.reason
    assert not machine.ends and machine.s.motion is not None
    assert machine.ask(request_._replace(replace=True)) == Accepted(2)
    assert [(e.id, e.outcome) for e in machine.ends] == [(1, "superseded")]
    assert machine.s.motion.id == 2


@pytest.mark.parametrize("what", ["yes", 1, None, [True]])
def test_what_is_not_true_replaces_nothing(what: object) -> None:
    machine = homed()
    machine.ask(m.MoveMacro(1500))
    assert isinstance(machine.ask(m.MoveMacro(9, "", what)), Refused)  # type: ignore[arg-type]


def test_neither_homing_nor_braking_is_replaced() -> None:
    machine = homed()
    machine.ask(m.Home())
    assert isinstance(machine.ask(m.MoveTo(0.02, replace=True)), Refused)
    machine = homed()
    machine.ask(m.MoveMacro(1500))
    for k in range(60):
        machine.see(2.0 * k)
    machine.ask(m.Stop())
    assert machine.mode == "stopped" and not machine.ends
    assert isinstance(machine.ask(m.MoveTo(0.02, replace=True)), Refused)


@pytest.mark.parametrize("aim", [900.0, 400.0, -100.0])
def test_whenever_it_comes_no_soft_limit_is_overrun(aim: float) -> None:
    for k in (0, 2):
        b = Bench(0.02, coordinate=200.0, trusted=True)
        b.tick()
        b.ask(m.Enable())
        own = b.p.settings.limits
        b.ask(m.SetLimits(own._replace(macro_low=-110.0, macro_high=910.0)))
        b.ask(m.MoveMacro(905))
        b.run(0.05 + 0.1 * k)
        if b.ends:
            break
        assert b.ask(m.MoveMacro(aim, replace=True)) == Accepted(2)
        low = high = b.s.seen.encoder - b.s.frame.offset
        while len(b.ends) < 2:
            b.tick()
            at = b.s.seen.encoder - b.s.frame.offset
            low, high = min(low, at), max(high, at)
        assert [(e.id, e.outcome) for e in b.ends] == [(1, "superseded"), (2, "done")]
        assert low >= -110.0 and high <= 910.0
        assert abs(at - aim) <= b.s.laws.sequence.tolerance
    assert k == 2
