"""The station: who may do what, and what becomes of everything that was accepted."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from serve_parts import LEFT, MOTOR, Running, begun, causes, outcome

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Refused
from macromicro.errors import MacromicroError
from macromicro.serve import _background, persist
from macromicro.serve.station import Station
from tests.waiting import until

Make = Callable[..., Station]


def test_start_moves_nothing_and_stop_leaves_safe(station: Make, log: Any) -> None:
    machine = station()
    assert machine.snapshot().mode == "off"
    assert isinstance(machine.request("test", m.Stop()), Refused)
    assert math.isnan(machine.emergency())
    machine.start()
    machine.start()  # once is enough
    until(lambda: machine.snapshot().pace.periods > 50)
    now = machine.snapshot()
    assert (now.running, now.mode, now.motion, now.fault) == (True, "disabled", 0, None)
    assert log[MOTOR] == 0.0
    motion = begun(machine)
    until(lambda: log[MOTOR] == 1.0)
    machine.stop()
    assert (log[MOTOR], log[LEFT]) == (0.0, 1.0)
    assert outcome(machine, motion) == "stopped"
    assert machine.snapshot().mode == "off"
    assert causes(machine, "loop") == ["started", "stopped"]
    machine.start()
    assert machine.finished(1, 0.0) is None
    assert begun(machine) == 1  # numbers count from 1 again
    machine.stop()


def test_an_accepted_motion_ends_once_and_is_told_to_whoever_waits(running: Running) -> None:
    machine = running.station
    motion = begun(machine, 0.3)
    assert machine.finished(motion, 0.0) is None
    got: list[Any] = []
    waiting = [
        threading.Thread(target=lambda: got.append(machine.finished(motion))) for _ in range(3)
    ]
    for thread in waiting:
        thread.start()
    for thread in waiting:
        thread.join()
    assert [f.outcome for f in got] == ["done"] * 3
    assert machine.finished(motion + 1, 5.0) is None


def test_one_client_controls_the_others_watch_and_may_stop(running: Running) -> None:
    machine, log = running.station, running.log
    before = len(causes(machine, "control"))
    machine.connect("other")
    motion = begun(machine)
    for request in (m.MoveTo(0.1), m.Enable(), m.Fan(True), m.ClearFault(), m.SetGains(())):
        reply = machine.request("other", request)
        assert isinstance(reply, Refused)
        assert "test holds it" in reply.reason
    refused = machine.acquire("other")
    assert isinstance(refused, Refused)
    assert "test holds control" in refused.reason
    assert isinstance(machine.release("other"), Refused)
    now = machine.snapshot()
    assert (now.holder, now.clients, now.motion) == ("test", ("other", "test"), motion)
    assert machine.telemetry()[1].shape[1] > 0
    assert isinstance(machine.request("other", m.Stop()), Accepted)
    assert outcome(machine, motion) == "stopped"
    again = begun(machine)
    assert isinstance(machine.request("other", m.EmergencyStop()), Accepted)
    assert outcome(machine, again) == "emergency"
    until(lambda: log[MOTOR] == 0.0)
    assert isinstance(machine.release("test"), Accepted)
    assert isinstance(machine.acquire("other"), Accepted)
    assert causes(machine, "control")[before:] == ["acquired", "released", "acquired"]


@pytest.mark.parametrize("request_", [m.LinkLost(), None, "stop", 7])
def test_what_is_no_request_of_a_client_is_refused(request_: Any, station: Make) -> None:
    assert isinstance(station().request("test", request_), Refused)


def test_an_emergency_stop_is_measured(running: Running) -> None:
    machine, log = running.station, running.log
    motion = begun(machine)
    until(lambda: log[MOTOR] == 1.0)
    took = machine.emergency()
    assert took > 0.0
    assert log[MOTOR] == 0.0
    assert outcome(machine, motion) == "emergency"
    assert machine.snapshot().emergency_s == took


@pytest.mark.parametrize(
    ("gone", "action"),
    [
        pytest.param("silent", "stop", marks=pytest.mark.slow),
        ("disconnected", "stop"),
        ("disconnected", "hold"),
    ],
)
def test_a_lost_client_is_acted_upon_as_configured(action: str, gone: str, station: Make) -> None:
    machine = station(client_timeout=1.5 if gone == "silent" else 60.0, lost_client=action)
    machine.start()
    motion = begun(machine)
    if gone == "silent":
        for _ in range(20):  # alive as long as it says so
            time.sleep(0.1)
            machine.heartbeat("test")
            machine.heartbeat("other")
    assert machine.snapshot().holder == "test"
    if gone == "disconnected":
        machine.disconnect("test")
    assert outcome(machine, motion) == "lost"
    assert machine.snapshot().holder == ""
    assert causes(machine, "link") == [action]
    assert "client lost" in causes(machine, "control")
    assert isinstance(machine.acquire("other"), Accepted)


def test_a_lost_client_is_noticed_while_the_disk_is_slow(
    station: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    writing, go_on, real = threading.Event(), threading.Event(), persist.save

    def slow(path: Path, kept: persist.Kept) -> None:
        writing.set()
        go_on.wait(60.0)
        real(path, kept)

    monkeypatch.setattr(persist, "save", slow)
    machine = station(client_timeout=0.2)
    machine.start()
    try:
        assert writing.wait(60.0)
        machine.acquire("test")
        until(lambda: "client lost" in causes(machine, "control"), 20.0)
    finally:
        go_on.set()


def test_an_emergency_stop_needs_no_event_loop(station: Make) -> None:
    machine, go_on = station(), threading.Event()
    machine.start()
    _background.call_soon(lambda: go_on.wait(60.0))
    try:
        assert not math.isnan(machine.emergency("test"))
    finally:
        go_on.set()


def test_a_server_that_hangs_counts_as_silent(station: Make, log: Any) -> None:
    machine, go_on = station(parent_timeout=0.3), threading.Event()
    machine.start()
    _background.call_soon(lambda: go_on.wait(60.0))
    try:
        until(lambda: log[LEFT] == 1.0)
    finally:
        go_on.set()
    until(lambda: machine.snapshot().fault is not None)
    assert "the server was silent" in machine.snapshot().fault.evidence  # type: ignore[union-attr]


def test_events_and_telemetry_come_once(running: Running) -> None:
    machine = running.station
    last, first = machine.events()
    assert len(first) == last + 1
    assert machine.events(last)[1] == []
    machine.acquire("test")
    after, news = machine.events(last)
    assert [e.cause for e in news][-1:] == ["acquired"]
    assert after == last + len(news)
    row, block, names = machine.telemetry()
    until(lambda: machine.telemetry(row)[1].shape[1] > 20)
    _, more, _ = machine.telemetry(row)
    t = list(names).index("t")
    assert more[t, 0] - block[t, -1] == pytest.approx(1e-3, abs=1e-9)


def test_a_rig_that_is_not_there_is_an_error(tmp_path: Path, station: Make) -> None:
    machine = Station("no_such_module_here:rig", state=tmp_path / "other.json")
    with pytest.raises(MacromicroError, match="no_such_module_here"):
        machine.start()
    assert machine.snapshot().mode == "off"


def test_trust_survives_an_orderly_end_but_not_an_encoder_elsewhere(
    station: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine = station()
    machine.start()
    machine.acquire("test")
    machine.request("test", m.Home())
    until(lambda: machine.snapshot().trusted)
    until(lambda: machine.snapshot().trust == "homed")  # the words come behind the row
    machine.stop()
    machine.start()
    assert machine.snapshot().trusted
    until(lambda: "restored" in machine.snapshot().trust)
    machine.stop()
    monkeypatch.setenv("MACROMICRO_TEST_COUNT", "50")
    machine.start()
    assert not machine.snapshot().trusted
    until(lambda: "reads 50, was left at 0" in machine.snapshot().trust)
