"""The whole way: PyVISA, the server, the station, the loop process, the twin."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.systems import posix
from tests.waiting import until

from macromicro.recording import Recording
from macromicro.serve.scpi import Server
from macromicro.serve.settings import LiveSettings
from macromicro.serve.station import Station

pyvisa = pytest.importorskip("pyvisa")
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("scpi")


@pytest.fixture(scope="module")
def running(folder: Path) -> Iterator[tuple[Station, Server]]:
    settings = LiveSettings()
    # Machines that run tests are busy: nothing stops for lateness.
    serve = settings.serve._replace(miss_share=1.0, parent_timeout=5.0)
    station = Station(settings=settings._replace(serve=serve), state=folder / "position.json")
    with station, Server(station, port=0, folder=folder) as server:
        yield station, server


@pytest.fixture
def instrument(running: tuple[Station, Server]) -> Iterator[Any]:
    host, port = running[1].address
    manager = pyvisa.ResourceManager("@py")
    resource = manager.open_resource(
        f"TCPIP::{host}::{port}::SOCKET",
        read_termination="\n",
        write_termination="\n",
        timeout=60_000,
    )
    yield resource
    resource.close()
    manager.close()
    until(lambda: not running[0].snapshot().clients)


def homed(instrument: Any) -> None:
    """In control, homed, nothing wrong."""
    assert instrument.query("SYST:LOCK:REQ?") == "1"
    if instrument.query("ENAB?") == "0":
        instrument.write("ENAB")
    if instrument.query("POS?").endswith(",0"):
        assert instrument.query("HOME;*OPC?") == "1"
    assert instrument.query("SYST:ERR:ALL?;:POS:TRUS?").startswith('0,"No error";1,')


def test_nothing_moves_until_it_is_told_to(instrument, running) -> None:
    before = instrument.query("STAG:POS?")
    assert instrument.query("MODE?;:MOVE:NUMB?") == '"disabled";0'
    instrument.query("SYST:LOCK:REQ?")
    instrument.write("ENAB")
    instrument.write("MOVE:ABS 20 MM")  # never homed
    assert instrument.query("SYST:ERR?").startswith("-221,")
    assert instrument.query("STAG:POS?") == before
    assert instrument.query("MODE?") == '"ready"'


def test_home_and_move(instrument, running, folder) -> None:
    homed(instrument)
    instrument.write('REC ON,"visa"')
    assert instrument.query("MOVE:ABS 12.5 MM;*OPC?") == "1"
    assert instrument.query("SYST:ERR:ALL?;:MODE?") == '0,"No error";"holding"'
    position, uncertainty, trusted = instrument.query_ascii_values("POS?")
    assert abs(position - 12.5) < 0.02 and trusted == 1.0
    assert 0.0 < uncertainty < 0.5 * 200.0 / 2800.0  # by laser: better than half a count
    instrument.write("FORM REAL,64")
    place = instrument.query_binary_values(
        "WAV:DATA? position,0.2", datatype="d", is_big_endian=True
    )
    assert len(place) == 200 and abs(place[-1] - 12.5) < 0.02
    number = int(instrument.query("REC OFF;:REC?").split(",")[1])
    assert len(Recording.load(folder / "visa.h5")["t"]) == number > 1000


def test_emergency_stop_on_the_connection_that_waits(instrument, running) -> None:
    """*OPC? answers, the error says how the motion ended, the position is not trusted."""
    homed(instrument)
    instrument.write("MOVE:ABS 150 MM;*OPC?")
    until(lambda: running[0].snapshot().mode == "moving-macro")
    instrument.write("ABOR")
    assert instrument.read() == "1"
    entry = instrument.query("SYST:ERR?")
    assert entry.startswith("-200,") and "ended as emergency" in entry
    assert instrument.query("MODE?;:POS?").startswith('"disabled";')
    assert instrument.query("POS?").endswith(",0")


@posix
@pytest.mark.parametrize("waiting", [0, 500])
def test_a_client_that_is_killed_in_the_middle_of_a_move(instrument, running, waiting) -> None:
    """Also behind more messages than the server reads ahead."""
    homed(instrument)
    instrument.write("SYST:LOCK:REL")
    station, server = running
    code = (
        "import socket, time\n"
        f"s = socket.create_connection({server.address!r})\n"
        f"s.sendall(b'SYST:LOCK:REQ?;:MOVE:ABS 150 MM;*OPC?\\n' + b'POS?\\n' * {waiting})\n"
        "time.sleep(100)\n"
    )
    process = subprocess.Popen([sys.executable, "-c", code])
    try:
        until(lambda: station.snapshot().mode == "moving-macro")
        motion = station.snapshot().motion
        if waiting:
            time.sleep(0.3)  # they are on their way
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        end = station.finished(motion, 60.0)
        assert end is not None and end.outcome == "lost"
        assert instrument.query(f"MOVE:OUTC? {motion}").startswith('"lost",')
        assert instrument.query("SYST:LOCK:REQ?") == "1"  # control is free
    finally:
        process.kill()
        process.wait()


def test_jog_stop_gains_and_programme(instrument, running) -> None:
    homed(instrument)
    instrument.write("JOG:MACR 10 MM/S")
    until(lambda: running[0].snapshot().motor_v != 0.0)
    assert instrument.query("STOP;*OPC?;:MOVE:NUMB?") == "1;0"  # at rest
    instrument.write('GAIN "sequence.wait",0.5')
    assert instrument.query('GAIN? "sequence.wait"') == "0.5"
    instrument.write('GAIN "sequence.wait",2')
    text = 'title = "Short"\n[[moves]]\nmicro = ["1 mm", "0.5 mm"]\nhold = "0.5 s"\n'
    instrument.write_binary_values("PROG:LOAD ", text.encode(), datatype="B")
    assert instrument.query("PROG:RUN;STAT?") == "RUN"
    assert instrument.query("*OPC?;:PROG:STAT?;:SYST:ERR:ALL?") == '1;STOP;0,"No error"'
