"""ophyd, Bluesky and pyepics, unmodified, before a real server."""

from __future__ import annotations

import contextlib
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("caproto")
sys.path.insert(0, str(Path(__file__).parent))
import epics_parts as parts
from epics_parts import PREFIX
from tests.serve.quick import TEXT

epics = pytest.importorskip("epics")
ophyd = pytest.importorskip("ophyd")
bluesky = pytest.importorskip("bluesky")


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with parts.serving(tmp_path_factory.mktemp("epics"), TEXT):
        yield


def get(name: str) -> Any:
    return epics.caget(f"{PREFIX}:{name}", use_monitor=False, connection_timeout=30.0)


def put(name: str, value: Any = 1) -> None:
    assert (
        epics.caput(f"{PREFIX}:{name}", value, wait=True, timeout=60.0, connection_timeout=30.0)
        == 1
    )


@pytest.fixture
def ready(served: None) -> None:
    """Enabled, homed, at rest."""
    if get("mode") in ("disabled", "fault"):
        put("clear") if get("mode") == "fault" else None
        put("enable")
    if not get("trusted"):
        put("home")


@pytest.fixture
def motor(served: None) -> Iterator[Any]:
    made = ophyd.EpicsMotor(f"{PREFIX}:whole", name="stage")
    made.wait_for_connection(timeout=20.0)
    yield made
    made.destroy()


def settled(motor: Any) -> None:
    deadline = time.monotonic() + 20.0
    while motor.moving or get("whole.DMOV") == 0:
        assert time.monotonic() < deadline
        time.sleep(0.02)


@pytest.mark.slow
def test_a_disabled_machine_fails_a_move(motor: Any) -> None:
    put("disable")
    status = motor.set(10.0)
    with pytest.raises(Exception, match="failed"):
        status.wait(20.0)
    assert "disabled" in get("failure") and get("whole.LVIO") == 1
    put("enable")
    put("home")
    assert get("trusted") == 1 and get("mode") == "ready"


@pytest.mark.slow
def test_the_news_of_an_end_come_before_its_put_is_answered(ready: None) -> None:
    """Else the end of a homing is taken for that of the move behind it."""
    seen: list[int] = []
    # Not of the record that ophyd uses, whose channel it would share in this process.
    done = epics.PV(f"{PREFIX}:macro.DMOV", callback=lambda value, **_: seen.append(value))
    assert done.wait_for_connection(20.0)
    for _ in range(2):
        seen.clear()
        put("home")
        assert seen[-1:] == [1] and 0 in seen
    done.disconnect()


@pytest.mark.slow
def test_ophyd_sets_and_waits(ready: None, motor: Any) -> None:
    status = motor.set(12.5)
    status.wait(60.0)
    assert status.success and motor.position == pytest.approx(12.5, abs=0.02)
    assert get("whole.LVIO") == 0 and motor.user_readback.alarm_severity == 0
    low, high = motor.limits
    assert low < 0.0 and high > 150.0 and get("whole.EGU") == "mm"
    with pytest.raises(ophyd.utils.LimitError):
        motor.set(high + 1.0)
    with pytest.raises(ophyd.utils.LimitError):
        motor.set(low - 1.0)


def test_a_move_that_is_stopped_has_failed_and_the_next_one_has_not(
    ready: None, motor: Any
) -> None:
    away = 150.0 if motor.position < 75.0 else 10.0
    status = motor.set(away)
    time.sleep(0.2)
    motor.stop()
    with pytest.raises(Exception, match="failed"):
        status.wait(20.0)
    settled(motor)
    assert abs(motor.position - away) > 1.0
    assert (get("whole.STOP"), get("whole.MISS")) == (0, 1)
    assert motor.user_readback.alarm_severity == 2 and get("failure") == "it ended as stopped"
    status = motor.set(20.0)
    status.wait(60.0)
    assert status.success and motor.user_readback.alarm_severity == 0 and get("failure") == ""


@pytest.mark.slow
def test_a_new_target_replaces_the_one_under_way(ready: None, motor: Any) -> None:
    seen: list[int] = []
    motor.motor_done_move.subscribe(lambda value, **_: seen.append(value), run=False)
    motor.user_setpoint.put(120.0, wait=False)
    time.sleep(0.2)
    status = motor.set(30.0)
    settled(motor)
    deadline = time.monotonic() + 5.0
    while seen[-1:] != [1] and time.monotonic() < deadline:  # the monitor's news come by a thread
        time.sleep(0.02)
    assert motor.position == pytest.approx(30.0, abs=0.02) and seen[seen.index(0) :].count(1) == 1
    assert motor.user_readback.alarm_severity == 0
    del status  # of the second set, which saw no begin of its own


def test_pyepics_moves_waits_and_sees_failures(ready: None) -> None:
    motor = epics.Motor(f"{PREFIX}:whole")
    assert motor.move(25.0, wait=True, timeout=60.0) == 0
    assert motor.get_position(readback=True) == pytest.approx(25.0, abs=0.02)
    assert motor.move(900.0, wait=True) == -12  # beyond the limits: not attempted
    assert motor.move(900.0, wait=True, ignore_limits=True) == -4  # refused
    motor.move(150.0)
    time.sleep(0.2)
    motor.stop()
    deadline = time.monotonic() + 20.0
    while get("whole.DMOV") == 0:
        assert time.monotonic() < deadline
        time.sleep(0.02)
    assert get("whole.LVIO") == 1
    put("disable")
    assert motor.move(26.0, wait=True) == -4
    put("enable")
    assert motor.move(26.0, wait=True, timeout=60.0) == 0


@pytest.mark.slow
def test_both_stages_have_records_of_their_own(ready: None) -> None:
    put("whole", 30.0)
    put("micro", 0.5)
    assert get("micro.RBV") == pytest.approx(0.5, abs=0.02)
    put("macro", 40.0)
    pitch = 1e3 * 7.14286e-5
    assert get("macro.RBV") == pytest.approx(40.0, abs=2 * pitch)


def test_state_and_traces_are_channels(ready: None) -> None:
    assert get("fault") == "" and get("trust") and get("holder") == "epics"
    assert 10.0 < get("temperature") < 120.0 and 0.0 < get("uncertainty") < 0.2
    time_s, place = get("trace:time"), get("trace:position")
    assert len(time_s) == len(place) > 100
    assert np.all(np.diff(time_s) > 0.0) and np.ptp(time_s) < 11.0
    put("emergency")
    deadline = time.monotonic() + 20.0
    while get("mode") != "disabled":
        assert time.monotonic() < deadline
        time.sleep(0.02)
    put("enable")


@pytest.mark.parametrize("field", ["RBV", "DMOV", "MSTA", "MOVN", "DRBV"])
def test_writes_to_what_only_tells_are_refused(ready: None, field: str) -> None:
    pv = epics.PV(f"{PREFIX}:micro.{field}")
    assert pv.wait_for_connection(20.0) and not pv.write_access
    with pytest.raises(Exception, match=r"[Ww]rit"):
        epics.ca.put(pv.chid, 7, wait=True, timeout=5.0)
    assert pv.get(use_monitor=False) != 7
    pv.disconnect()


@pytest.mark.slow
def test_a_pause_lets_a_move_go_on_later(ready: None) -> None:
    put("whole", 20.0)
    epics.caput(f"{PREFIX}:whole", 150.0)
    deadline = time.monotonic() + 20.0
    while get("mode") != "moving-macro":
        assert time.monotonic() < deadline
        time.sleep(0.02)
    put("whole.SPMG", "Pause")
    while get("whole.DMOV") == 0:
        assert time.monotonic() < deadline
        time.sleep(0.02)
    place = get("whole.RBV")
    assert place < 149.0 and get("whole") == 150.0
    put("whole", 25.0)
    assert get("whole.RBV") == pytest.approx(place, abs=1.0)
    put("whole.SPMG", "Go")
    assert get("whole.RBV") == pytest.approx(25.0, abs=0.02) and get("whole.SPMG") == 3


@pytest.mark.slow
def test_a_jog_by_channel_access(ready: None) -> None:
    put("whole", 20.0)
    epics.caput(f"{PREFIX}:whole.JOGF", 1)
    deadline = time.monotonic() + 20.0
    while get("whole.RBV") < 21.0:
        assert time.monotonic() < deadline
        time.sleep(0.02)
    epics.caput(f"{PREFIX}:whole.JOGF", 0)
    while get("whole.DMOV") == 0:
        assert time.monotonic() < deadline
        time.sleep(0.02)
    assert get("whole.LVIO") == 0 and get("whole.RBV") < 150.0
    assert get("whole") == pytest.approx(get("whole.RBV"), abs=0.2)


def test_a_client_that_crashes_is_lost(ready: None) -> None:
    """Its circuit closes; this process, which has ordered something, goes on."""
    put("whole", 20.0)
    code = (
        "import epics, time\n"
        f"epics.caput('{PREFIX}:whole.JOGF', 1, connection_timeout=30.0)\n"
        "time.sleep(60.0)\n"
    )
    with subprocess.Popen([sys.executable, "-c", code]) as process:
        try:
            deadline = time.monotonic() + 30.0
            while get("mode") != "moving-macro":
                assert time.monotonic() < deadline
                time.sleep(0.02)
        finally:
            process.kill()
    while get("holder") or get("mode") == "moving-macro":
        assert time.monotonic() < deadline
        time.sleep(0.02)
    assert get("whole.RBV") < 140.0
    put("whole", 22.0)  # others go on, and take control anew
    assert get("holder") == "epics"


def test_a_circuit_that_speaks_another_protocol_is_closed(ready: None) -> None:
    for data in (b"POST / HTTP/1.1\r\n\r\n", b"\x16\x03\x01\x02", b"x" * 100_000):
        where = "127.0.0.1", int(parts.SERVER)
        with (
            socket.create_connection(where, timeout=10.0) as stranger,
            contextlib.suppress(ConnectionError),
        ):
            stranger.sendall(data)
            assert stranger.recv(100) == b""
    assert get("mode")


@pytest.mark.slow
def test_bluesky_scans_with_a_detector(ready: None, motor: Any) -> None:
    from bluesky.plans import scan
    from ophyd.sim import det

    engine = bluesky.RunEngine({}, call_returns_result=True)
    documents: list[tuple[str, dict[str, Any]]] = []
    engine.subscribe(lambda name, document: documents.append((name, document)))
    engine(scan([det], motor, 10.0, 14.0, 3))
    places = [d["data"]["stage"] for name, d in documents if name == "event"]
    assert places == pytest.approx([10.0, 12.0, 14.0], abs=0.02)
    put("disable")
    with pytest.raises(Exception, match="success=False"):
        engine(scan([det], motor, 10.0, 14.0, 3))
    put("enable")
