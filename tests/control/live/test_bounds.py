"""Soft limits of a running machine: narrower ones for all, never wider ones."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Refused

from .follower import QUICK, Follower, ready

OWN = QUICK.limits
NARROW = OWN._replace(
    macro_low=-40.0,
    macro_high=60.0,
    micro_low=0.2e-3,
    micro_high=1e-3,
    whole_low=0.0,
    whole_high=4e-3,
)


def narrowed() -> Follower:
    f = ready()
    assert f.ask(m.SetLimits(NARROW, "somebody")) == Accepted()
    return f


def test_they_hold_for_every_way_to_move() -> None:
    f = narrowed()
    for request in (
        m.MoveTo(5e-3), m.MoveBy(5e-3), m.MoveMacro(61), m.MoveMicro(1.1e-3), m.MoveMicro(0.1e-3),
    ):  # fmt: skip
        reply = f.ask(request)
        assert isinstance(reply, Refused) and reply.beyond, request
    f.ask(m.Jog("macro", 0.05))
    f.run(1.0)
    assert f.ends[-1].outcome == "limit"
    assert f.s.seen.encoder == pytest.approx(60.0, abs=2.0)


def test_the_change_is_told_and_taken_back() -> None:
    f = narrowed()
    assert f.s.limits == NARROW
    told = f.events[-1]
    assert (told.kind, told.cause) == ("limits", "set limits")
    assert told.evidence["macro_high"] == {"old": OWN.macro_high, "new": 60.0}
    assert f.ask(m.SetLimits()) == Accepted()
    assert f.s.limits == OWN
    assert isinstance(f.ask(m.MoveMacro(61)), Accepted)


@pytest.mark.parametrize("wrong", [
    "none", (0, 1), OWN._replace(macro_low=OWN.macro_low - 1.0), OWN._replace(whole_high=1.0),
    OWN._replace(micro_high=math.nan), OWN._replace(macro_low=50.0, macro_high=50.0),
    OWN._replace(micro_low=2e-3, micro_high=1e-3), OWN._replace(macro_low=True),
    OWN._replace(macro_high="60"), OWN._replace(whole_low=-math.inf),
])  # fmt: skip
def test_wider_or_senseless_ones_change_nothing(wrong: Any) -> None:
    f = ready()
    before = f.s
    reply = f.ask(m.SetLimits(wrong))
    assert isinstance(reply, Refused) and reply.remedy
    assert f.s is before


def test_a_refusal_reads_in_the_unit_of_a_person() -> None:
    f = ready()
    reply = f.ask(m.SetLimits(OWN._replace(whole_low=5e-3, whole_high=2e-3)))
    assert isinstance(reply, Refused)
    assert reply.reason == "soft limits of 5 to 2 mm for the whole positioner"
    ends = f"{OWN.whole_low * 1e3:g} to {OWN.whole_high * 1e3:g} mm"
    assert reply.remedy == f"give them from {ends}, the lower one first"
    reply = f.ask(m.MoveTo(0.9))
    assert isinstance(reply, Refused) and reply.remedy == f"give one from {ends}"
    assert reply.reason == "position 900 mm is beyond the soft limits"


def test_not_while_something_moves() -> None:
    f = ready()
    f.ask(m.MoveMacro(100))
    f.tick()
    assert isinstance(f.ask(m.SetLimits(NARROW)), Refused)
    assert f.s.limits == OWN


def test_what_stands_outside_stays_and_may_come_in() -> None:
    f = ready()
    f.ask(m.MoveMacro(100))
    f.until("ready")
    f.ask(m.SetLimits(NARROW))
    f.run(0.1)
    assert f.s.seen.encoder == pytest.approx(100.0, abs=2.0)
    assert isinstance(f.ask(m.Jog("macro", 0.01)), Refused)
    assert isinstance(f.ask(m.MoveMacro(50)), Accepted)
    f.until("ready")
    assert f.ends[-1].outcome == "done"


@given(
    low=st.floats(OWN.macro_low, 0.0), high=st.floats(1.0, OWN.macro_high),
    counts=st.integers(-200, 3100),
)  # fmt: skip
def test_a_target_is_accepted_exactly_within(low: float, high: float, counts: int) -> None:
    f = ready()
    assert f.ask(m.SetLimits(OWN._replace(macro_low=low, macro_high=high))) == Accepted()
    assert isinstance(f.ask(m.MoveMacro(counts)), Accepted) == (low <= counts <= high)


def test_what_is_no_number_is_shown_in_forty_characters() -> None:
    f = ready()
    odd: Any = "x" * 100
    reply = f.ask(m.SetLimits(f.s.limits._replace(macro_low=odd)))
    assert isinstance(reply, m.Refused)
    assert reply.reason.startswith("soft limits of '" + "x" * 36 + "... to ")


@pytest.mark.parametrize(
    ("wider", "asked", "most"),
    [
        ({"macro_high": OWN.macro_high + 1.0}, f"{OWN.macro_high + 1.0:g} counts", "counts"),
        ({"micro_high": OWN.micro_high + 1e-3}, f"{OWN.micro_high * 1e3 + 1.0:g} mm", "mm"),
        ({"whole_high": OWN.whole_high + 1.0}, f"{OWN.whole_high * 1e3 + 1e3:g} mm", "mm"),
    ],
)
def test_a_refusal_reads_in_the_units_of_the_stage(
    wider: dict[str, float], asked: str, most: str
) -> None:
    reply = ready().ask(m.SetLimits(OWN._replace(**wider)))
    assert isinstance(reply, Refused) and reply.beyond
    assert f" to {asked} for the " in reply.reason
    ((name, _),) = wider.items()
    scale = 1.0 if most == "counts" else 1e3
    low = getattr(OWN, name.replace("high", "low"))
    bounds = f"give them from {low * scale:.9g} to {getattr(OWN, name) * scale:.9g} {most}, "
    assert reply.remedy.startswith(bounds)
