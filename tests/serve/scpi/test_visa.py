"""PyVISA, as a laboratory's script uses it, on a raw socket."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from macromicro.control.live import messages as m
from macromicro.serve.scpi import Server
from macromicro.serve.shared import NAMES

pyvisa = pytest.importorskip("pyvisa")


@pytest.fixture
def instrument(station, tmp_path) -> Iterator[Any]:
    manager = pyvisa.ResourceManager("@py")
    with Server(station, port=0, folder=tmp_path) as server:
        host, port = server.address
        resource = manager.open_resource(
            f"TCPIP::{host}::{port}::SOCKET",
            read_termination="\n",
            write_termination="\n",
            timeout=10_000,
        )
        yield resource
        resource.close()
    manager.close()


def test_queries(instrument) -> None:
    assert instrument.query("*IDN?").startswith("macromicro,")
    assert instrument.query_ascii_values("POS?") == [42.1234, 0.0357, 1.0]
    instrument.write("*CLS")
    assert instrument.query("SYST:ERR?") == '0,"No error"'


def test_binary_waveform(instrument, station) -> None:
    """The default of PyVISA is little-endian; NORMal of SCPI is big-endian."""
    expected = station.rows[NAMES.index("hall_position"), -2000:]
    for order, big in (("NORM", True), ("SWAP", False)):
        for length, code in ((32, "f"), (64, "d")):
            instrument.write(f"FORM REAL,{length};:FORM:BORD {order}")
            found = instrument.query_binary_values(
                "WAV:DATA? hall_position,2 S", datatype=code, is_big_endian=big, container=np.array
            )
            assert found == pytest.approx(expected)
    assert instrument.query("*OPC?") == "1"  # nothing of the block is left over


def test_programme_as_a_block(instrument, station) -> None:
    text = 'title = "One"\n[[moves]]\nmicro = "1 mm"\nhold = "1 s"\n'
    instrument.write_binary_values("PROG:LOAD ", text.encode(), datatype="B")
    assert instrument.query("PROG:NAME?") == '"One"'
    assert instrument.query("SYST:LOCK:REQ?") == "1"
    instrument.write("PROG:RUN")
    assert instrument.query("PROG:STAT?") == "RUN"
    assert station.requests[0].plan.target.tolist() == [0.001]  # m


def test_a_move_and_its_end(instrument, station) -> None:
    assert instrument.query("SYST:LOCK:REQ?") == "1"
    ends = threading.Timer(0.3, lambda: station.end("done"))
    instrument.write("MOVE:ABS 10 MM")
    assert instrument.query("MOVE:NUMB?") == "1"
    ends.start()
    assert instrument.query("*OPC?") == "1"
    assert station.ended[1].outcome == "done"
    assert instrument.query("SYST:ERR:COUN?") == "0"
    assert station.requests == [m.MoveTo(0.01, station.holder)]


def test_closing_the_session_gives_control_up(instrument, station) -> None:
    instrument.query("SYST:LOCK:REQ?")
    instrument.close()
    deadline = time.monotonic() + 10.0
    while station.holder and time.monotonic() < deadline:
        time.sleep(0.01)
    assert station.holder == ""
