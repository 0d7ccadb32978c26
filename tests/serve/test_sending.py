"""The order in which things are done that are asked for at the same time."""

from __future__ import annotations

import math
import os
import signal
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from serve_parts import MOTOR, PID, STEPS, Running, begun, outcome

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Refused
from macromicro.serve import persist
from macromicro.serve._sending import Sender
from macromicro.serve.persist import Kept
from macromicro.serve.shared import EMERGENCY, SAFE_SINCE, SEEN, Shared
from macromicro.serve.station import Station
from tests.systems import posix
from tests.waiting import until

Make = Callable[..., Station]


def sender(shared: Shared, alive: Callable[[], bool]) -> Sender:
    none: Any = None
    made = Sender(1.0, alive, print)
    made.begin(none, shared, none, none)
    return made


def test_an_emergency_stop_has_succeeded_though_another_one_follows() -> None:
    shared = Shared.create(16)
    cells = shared.cells

    def loop() -> bool:
        stamp = int(cells[EMERGENCY])
        cells[SAFE_SINCE], cells[SEEN], cells[EMERGENCY] = stamp + 70, stamp, stamp + 50
        return True

    assert sender(shared, loop).emergency("one") == pytest.approx(70e-9)


def test_stamps_only_grow_so_that_none_waits_for_ever() -> None:
    shared = Shared.create(16)
    later = 2**62  # one that was taken later and stored earlier
    shared.cells[EMERGENCY] = later

    def loop() -> bool:
        shared.cells[SEEN] = shared.cells[EMERGENCY]
        return True

    assert not math.isnan(sender(shared, loop).emergency("one"))
    assert int(shared.cells[EMERGENCY]) > later


def test_many_emergency_stops_at_a_time_all_succeed(running: Running) -> None:
    machine = running.station
    took: list[float] = []
    threads = [
        threading.Thread(target=lambda: took.extend(machine.emergency() for _ in range(60)))
        for _ in range(3)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(took) == 180
    assert not any(math.isnan(t) for t in took)
    assert machine.snapshot().running


def test_who_pressed_the_emergency_stop_is_told(running: Running) -> None:
    machine = running.station
    for press in (
        lambda: machine.request("other", m.EmergencyStop()),
        lambda: machine.emergency("other"),
    ):
        motion = begun(machine)
        press()
        finished = machine.finished(motion, 60.0)
        assert finished is not None
        assert finished.evidence == {"client": "other"}


def test_trust_and_file_say_why_it_is_gone(running: Running) -> None:
    machine = running.station
    motion = begun(machine)
    machine.request("test", m.Home())
    until(lambda: machine.snapshot().trusted)
    machine.emergency()
    assert outcome(machine, motion) == "emergency"
    why = "emergency stop on the way"
    until(lambda: machine.snapshot().trust == why)

    def kept() -> bool:
        found = persist.load(running.state)
        return isinstance(found, Kept) and (found.trusted, found.why) == (False, why)

    until(kept)


OVERTAKE: dict[str, Callable[[Station], Any]] = {
    "stop": lambda s: s.request("other", m.Stop()),
    "emergency": lambda s: s.emergency(),
    "disconnect": lambda s: s.disconnect("test"),
    "release": lambda s: (s.release("test"), s.acquire("other")),
    "release and again": lambda s: (s.release("test"), s.acquire("test")),
}


@pytest.mark.parametrize("how", OVERTAKE)
@pytest.mark.parametrize("request_", [m.MoveTo(600.0), m.Jog("macro", 0.01)])
def test_what_overtakes_a_motion_prevents_it(
    how: str, request_: Any, running: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine, log = running.station, running.log
    machine.acquire("test")
    writing, go_on, real = threading.Event(), threading.Event(), persist.save

    def slow(path: Path, kept: Kept) -> None:
        if kept.moving:
            writing.set()
            go_on.wait(60.0)
        real(path, kept)

    monkeypatch.setattr(persist, "save", slow)
    replies: list[Any] = []
    asking = threading.Thread(target=lambda: replies.append(machine.request("test", request_)))
    asking.start()
    assert writing.wait(60.0)
    OVERTAKE[how](machine)
    go_on.set()
    asking.join()
    assert isinstance(replies[0], Refused), replies
    steps = log[STEPS]
    until(lambda: log[STEPS] > steps + 20)
    assert (machine.snapshot().motion, log[MOTOR]) == (0, 0.0)


@posix
def test_of_what_a_silent_loop_was_sent_only_a_stop_is_done_later(station: Make, log: Any) -> None:
    machine = station(reply_timeout=0.1)
    machine.start()
    machine.acquire("test")

    def asked(request: Any) -> Any:
        os.kill(int(log[PID]), signal.SIGSTOP)
        try:
            return machine.request("test", request)
        finally:
            os.kill(int(log[PID]), signal.SIGCONT)

    assert isinstance(asked(m.MoveTo(600.0)), Refused)
    steps = log[STEPS]
    until(lambda: log[STEPS] > steps + 20)
    assert (machine.snapshot().motion, log[MOTOR]) == (0, 0.0)
    motion = begun(machine)
    assert isinstance(asked(m.Stop()), Refused)  # nobody answered
    assert outcome(machine, motion) == "stopped"


def test_a_jog_ends_when_its_client_releases_control(running: Running) -> None:
    machine = running.station
    machine.acquire("test")
    jog = machine.request("test", m.Jog("macro", 0.01))
    assert isinstance(jog, Accepted)
    machine.release("test")
    assert outcome(machine, jog.id) == "stopped"
    motion = begun(machine)  # any other motion goes on
    machine.release("test")
    until(lambda: machine.snapshot().motion == motion)
    assert machine.finished(motion, 0.2) is None


def test_a_refused_motion_is_not_written(station: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    machine = station()
    machine.start()
    machine.acquire("test")
    until(lambda: isinstance(persist.load(machine._connection._path), Kept))
    real, written = persist.save, []

    def noted(path: Path, kept: Kept) -> None:
        written.append(kept.moving)
        real(path, kept)

    monkeypatch.setattr(persist, "save", noted)
    for value in (-1.0, math.nan):
        assert isinstance(machine.request("test", m.MoveTo(value)), Refused)
    assert written == []
    machine.request("test", m.MoveTo(0.05))
    assert written[0] is True
