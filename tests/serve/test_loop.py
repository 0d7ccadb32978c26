"""The loop process: safe on every way out, and before the next step where that is asked."""

from __future__ import annotations

import gc
import time
from collections.abc import Iterator

import pytest
from loop_parts import Scene

from macromicro.control.live import messages as m
from macromicro.serve.link import pack, receive
from macromicro.serve.requests import Order
from macromicro.serve.shared import COMMANDS, EMERGENCY, HEARTBEAT, SEEN, WRITTEN


@pytest.fixture
def scene() -> Iterator[Scene]:
    made = Scene()
    yield made
    made.ours.close()
    made.shared.close()


def test_a_motion_drives_the_motor_until_it_is_told_to_leave(scene: Scene) -> None:
    assert scene.run() == ["step", "on"] * 10 + ["safe"]


def test_an_emergency_stop_comes_before_the_next_step(scene: Scene) -> None:
    def press() -> None:
        scene.shared.cells[EMERGENCY] = 12345

    scene.bench.at[50] = press
    order = scene.run()
    assert order[:4] == ["safe", "EmergencyStop", "step", "safe"]
    assert "on" not in order
    assert int(scene.shared.cells[SEEN]) == 12345


def test_what_was_asked_before_the_first_period_is_not_forgotten(scene: Scene) -> None:
    scene.shared.cells[EMERGENCY] = 7
    scene.ours.send(pack(Order(41, m.Enable(), 8, 2**63 - 1)))
    scene.shared.cells[COMMANDS] = 1
    scene.run()
    assert int(scene.shared.cells[SEEN]) == 7
    assert receive(scene.ours)[0] == "begun"
    assert receive(scene.ours) == ("reply", 41, m.Accepted(0))


def test_an_emergency_stop_overrules_a_machine_that_goes_on(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scene.machine, "_end", lambda outcome, **_: ())
    scene.bench.at[50] = lambda: scene.shared.cells.__setitem__(EMERGENCY, 1)
    assert scene.run()[:4] == ["safe", "EmergencyStop", "step", "safe"]


def test_without_a_heartbeat_it_goes_safe_and_leaves(scene: Scene) -> None:
    scene.loop._settings = scene.settings._replace(parent_timeout=0.2)
    beats = iter(range(1, 200))

    def beat() -> None:
        time.sleep(0.01)
        scene.shared.cells[HEARTBEAT] = next(beats)

    for k in range(3, 50):
        scene.bench.at[k] = beat
    for k in range(50, 59):
        scene.bench.at[k] = lambda: time.sleep(0.1)
    order = scene.run()
    assert 1 <= order.count("on") <= 3
    assert order[-1] == "safe"
    assert scene.bench.steps < 60


def test_a_dead_parent_is_the_end_of_it_at_once(scene: Scene) -> None:
    scene.bench.at[55] = lambda: setattr(scene.loop, "orphaned", True)
    assert scene.run() == ["step", "on"] * 5 + ["safe"]


def test_a_clogged_socket_delays_messages_and_nothing_else(scene: Scene) -> None:
    for k in range(3, 50):
        scene.bench.at[k] = lambda: [
            scene.loop._outbox.send(("notice", "x" * 60_000)) for _ in range(3)
        ]
    assert scene.run() == ["step", "on"] * 10 + ["safe"]
    assert scene.loop._outbox._waiting
    scene.ours.setblocking(False)
    got = 0
    while True:
        try:
            while data := scene.ours.recv(1_000_000):
                got += len(data)
        except BlockingIOError:
            if not scene.loop._outbox._waiting:
                break
            scene.loop._outbox.flush()
    assert got >= 47 * 3 * 60_000


def test_the_guard_is_renewed_but_the_wires_stay_hot(scene: Scene) -> None:
    heats = []

    def fault() -> None:
        scene.machine.accept(m.SetGains(()))

    def clear() -> None:
        assert scene.rig.tripped
        heat = scene.rig.watch.heat._replace(idle=0.0)
        scene.rig.watch = scene.rig.watch._replace(
            heat=heat._replace(heating=type(heat.heating)(40.0, 40.0, 40.0))
        )
        heats.append(scene.rig.temperature)
        scene.loop._answer(1, m.ClearFault())
        heats.append(scene.rig.temperature)
        assert not scene.rig.tripped

    scene.bench.at[52] = fault
    scene.bench.at[55] = clear
    scene.run()
    assert heats[0] == heats[1] > 30.0
    assert not scene.rig.tripped
    assert scene.shared.status().fault == 0


def test_clearing_a_fault_that_is_none_renews_no_guard(scene: Scene) -> None:
    before = []

    def clear() -> None:
        before.append(scene.rig.watch)
        scene.loop._answer(1, m.ClearFault())
        before.append(scene.rig.watch)

    scene.bench.at[55] = clear
    scene.run()
    assert before[0] is before[1]


def test_a_period_leaves_no_garbage(scene: Scene) -> None:
    """The loop process runs for days with the collector switched off."""
    gc.collect()
    gc.freeze()  # what was there before is not looked through again
    gc.disable()
    try:
        scene.run()
        assert gc.collect() == 0
    finally:
        gc.enable()
        gc.unfreeze()


def test_a_request_that_the_machine_cannot_judge_is_refused(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = scene.machine.accept

    def accept(request: m.Request) -> tuple[m.Reply, tuple[m.Notice, ...]]:
        return real(request) if not isinstance(request, m.MoveBy) else 1 // 0  # type: ignore[return-value]

    monkeypatch.setattr(scene.machine, "accept", accept)
    scene.ours.send(pack(Order(41, m.MoveBy(1.0), 1, 2**62)))
    scene.ours.send(pack(Order(42, m.Enable(), 1, 2**62)))
    scene.shared.cells[COMMANDS] = 2
    assert scene.run()[-1] == "safe"  # it went on, and left when it was told to
    assert receive(scene.ours)[0] == "begun"
    reply = receive(scene.ours)
    assert reply[:2] == ("reply", 41) and isinstance(reply[2], m.Refused)
    assert "ZeroDivisionError" in reply[2].reason
    assert receive(scene.ours) == ("reply", 42, m.Accepted(0))


def test_an_answer_comes_behind_what_came_of_it(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Who has an answer and asks at once sees the events of the request, and its row."""
    said: list[tuple[str, int]] = []
    outbox, shared = scene.loop._outbox, scene.shared
    real = outbox.send

    def send(message: tuple[object, ...]) -> None:
        said.append((str(message[0]), int(shared.cells[WRITTEN])))
        real(message)

    monkeypatch.setattr(outbox, "send", send)
    scene.ours.send(pack(Order(41, m.Home(), 1, 2**62)))
    shared.cells[COMMANDS] = 1
    scene.run()
    rows = dict(said)
    assert [kind for kind, _ in said[:3]] == ["begun", "notice", "reply"]
    assert rows["reply"] == rows["begun"] + 1  # that of its own period
    replies = [kind for kind, _ in said].count("reply")
    assert replies == 1
