"""`macromicro serve` of the simulated board at its pseudo-terminal, and a client at a socket.

The board's time is not the computer's: no period is missed on a slow computer.
"""

from __future__ import annotations

import contextlib
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.firmware.built import ROOT, needs_avr
from tests.firmware.test_process import DEADLINE, simulated
from tests.serve.scpi.client import Client
from tests.systems import posix
from tests.waiting import until

pytestmark = [posix, needs_avr, pytest.mark.slow]
PATIENT = '[serve]\nloop_timeout = "10 s"\nparent_timeout = "10 s"\n'


@contextlib.contextmanager
def served(folder: Path, port: Path, config: str) -> Iterator[Client]:
    """A client of the server of the board."""
    path = folder / "own.toml"
    path.write_text(config + PATIENT, encoding="utf-8")
    command = [sys.executable, "-m", "macromicro", "serve", "--rig", "board"]
    command += ["--port", str(port), "--scpi", "0", "--web", "-1", "--config", str(path)]
    command += ["--state", str(folder / "position.json")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            lines = iter(process.stdout)
            said = next(found for line in lines if (found := re.search(r"SCPI.*port (\d+)", line)))
            client = Client(("127.0.0.1", int(said[1])))
            client.socket.settimeout(DEADLINE)
            yield client
            client.close()
        finally:
            process.send_signal(signal.SIGTERM)
            assert process.wait(DEADLINE) == 128 + signal.SIGTERM


def homed(client: Client) -> None:
    """In control, enabled and homed."""
    assert client.ask("SYST:LOCK:REQ?") == "1"
    client.send("ENAB")
    assert client.ask("HOME;*OPC?") == "1"
    assert client.ask("POS:TRUS?") == '1,"homed"'


def moved(client: Client) -> None:
    """It goes where it is sent."""
    assert client.ask("MOVE:ABS 5 MM;*OPC?") == "1"
    place, half, trusted = client.ask("POS?").split(",")
    assert float(place) == pytest.approx(5.0, abs=2.0 * float(half))
    assert trusted == "1"
    assert client.ask("SYST:ERR:ALL?") == '0,"No error"'


def test_it_homes_on_a_switch_and_moves(tmp_path: Path) -> None:
    with simulated(tmp_path, "--switches") as port, served(tmp_path, port, "") as client:
        homed(client)
        moved(client)


PRINTER = (ROOT / "examples" / "machines" / "printer.toml").read_text("utf-8")


def test_an_axis_homes_moves_and_comes_back_when_its_board_was_unplugged(tmp_path: Path) -> None:
    """The same carriage as a machine of one stage, whose law runs on the host. Behind the replug
    nothing moves and nothing is trusted until it is homed again."""
    with contextlib.ExitStack() as cable:
        port = cable.enter_context(simulated(tmp_path, "--switches"))
        with served(tmp_path, port, PRINTER) as client:
            homed(client)
            moved(client)
            cable.close()
            until(lambda: "The rig could not be read" in client.ask("FAUL?"), DEADLINE)
            assert client.ask("POS:TRUS?").startswith("0,")
            (tmp_path / "end").unlink()
            cable.enter_context(simulated(tmp_path, "--switches"))
            until(lambda: "disabled" in client.ask("MODE?").lower(), DEADLINE)
            assert client.ask("POS:TRUS?").startswith("0,")
            client.ask("SYST:ERR:ALL?")
            homed(client)
            moved(client)
