"""The loop and what comes at a bad time: late requests, counts lost behind a fault."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from loop_parts import Scene

from macromicro.control.live import messages as m
from macromicro.rig import codes
from macromicro.serve.link import pack, receive
from macromicro.serve.requests import OVERTAKEN, TOO_LATE, Order
from macromicro.serve.shared import COMMANDS, EMERGENCY


@pytest.fixture
def scene() -> Iterator[Scene]:
    made = Scene()
    yield made
    made.ours.close()
    made.shared.close()


@pytest.mark.parametrize(
    ("order", "reply"),
    [
        (Order(41, m.MoveTo(5.0), 6, 2**63 - 1), OVERTAKEN),
        (Order(41, m.MoveTo(5.0), 8, 9), TOO_LATE),
        (Order(41, m.MoveTo(5.0), 8, 2**63 - 1, trial=True), m.Accepted(0)),
        (Order(41, m.MoveTo(-5.0), 8, 2**63 - 1, trial=True), m.Refused),
    ],
)
def test_what_is_void_and_what_is_a_trial_is_answered_and_not_done(
    order: Order, reply: object, scene: Scene
) -> None:
    def send() -> None:
        scene.ours.send(pack(order))
        scene.shared.cells[COMMANDS] += 1

    scene.bench.at[48] = lambda: scene.shared.cells.__setitem__(EMERGENCY, 7)
    scene.bench.at[49] = send
    assert "on" not in scene.run()
    said = [receive(scene.ours) for _ in range(3)]
    _, serial, got = next(s for s in said if s[0] == "reply")
    assert (serial, scene.machine.motion) == (41, 0)
    assert got == reply or type(got) is reply


def test_a_stop_is_never_too_late(scene: Scene) -> None:
    def send() -> None:
        scene.ours.send(pack(Order(41, m.Stop(), 8, 9)))
        scene.shared.cells[COMMANDS] += 1

    scene.bench.at[50] = send
    assert scene.run()[:3] == ["Stop", "step", "safe"]


def _trusted(scene: Scene, counts: dict[int, float]) -> tuple[bool, list[str]]:
    """A fault at reading 52, then these counts: is the place trusted, and what was told?"""

    def count(n: float) -> Callable[[], None]:
        return lambda: setattr(scene.bench, "count", n)

    def begin() -> None:
        scene.machine.trusted = True

    scene.bench.at[51] = begin
    scene.bench.at[52] = lambda: scene.machine.accept(m.SetGains(())) and None
    scene.bench.at.update({k: count(n) for k, n in counts.items()})
    scene.bench.at[58] = lambda: scene.loop._answer(1, m.ClearFault())
    scene.run()
    told: list[list[Any]] = []
    while not told or told[-1][1:] != ["the end"]:
        scene.loop._outbox.send(("notice", "the end"))
        told.append(list(receive(scene.ours)))
    events = [t[1] for t in told if isinstance(t[1], m.Event) and t[1].kind == "trust"]
    return scene.machine.trusted, [e.cause for e in events]


@pytest.mark.parametrize(
    ("counts", "why"),
    [
        ({54: 5000.0}, "jumped"),
        ({54: 5000.0, 55: 0.0}, "jumped"),
        ({54: math.nan, 55: 0.0}, "no reading"),
        ({54: 1.0, 55: 2.0, 56: 1.0}, ""),  # pushed by hand, and counted
    ],
)
def test_counts_lost_behind_another_fault_cost_trust(
    counts: dict[int, float], why: str, scene: Scene
) -> None:
    trusted, told = _trusted(scene, counts)
    assert trusted is (not why)
    assert len(told) == bool(why)
    assert all(why in t for t in told)


def test_a_jump_while_a_fault_is_cleared_is_one(scene: Scene) -> None:
    def clear() -> None:
        scene.loop._answer(1, m.ClearFault())
        scene.bench.count = 5000.0

    scene.bench.at[52] = lambda: scene.machine.accept(m.SetGains(())) and None
    scene.bench.at[55] = clear
    scene.run()
    assert scene.rig.watch.fault == codes.ENCODER_JUMP


def test_an_emergency_stop_that_only_ends_the_fan_is_told(scene: Scene) -> None:
    scene.bench.at[50] = lambda: scene.machine.accept(m.Stop()) and None
    scene.bench.at[51] = lambda: scene.machine.accept(m.Fan(True)) and None
    scene.bench.at[53] = lambda: scene.shared.cells.__setitem__(EMERGENCY, 1)
    scene.run()
    assert scene.shared.last() is not None
    said = [receive(scene.ours) for _ in range(2)]
    assert said[-1][1].kind == "fan"
    assert said[-1][1].cause == "emergency stop"
    assert said[-1][1].evidence == {"on": False, "client": ""}
