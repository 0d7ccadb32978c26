"""`macromicro serve` of the simulated board at its pseudo-terminal, and a client at a socket.

The board's time is not the computer's: no period is missed on a slow computer.
"""

from __future__ import annotations

import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.firmware.built import needs_avr
from tests.firmware.test_process import DEADLINE, simulated
from tests.serve.scpi.client import Client

pytestmark = [needs_avr, pytest.mark.slow]
PATIENT = '[serve]\nloop_timeout = "10 s"\nparent_timeout = "10 s"\n'


def test_it_homes_on_a_switch_and_moves(tmp_path: Path) -> None:
    config = tmp_path / "own.toml"
    config.write_text(PATIENT, encoding="utf-8")
    with simulated(tmp_path, "--switches") as port:
        command = [sys.executable, "-m", "macromicro", "serve", "--rig", "board"]
        command += ["--port", str(port), "--scpi", "0", "--web", "-1", "--config", str(config)]
        command += ["--state", str(tmp_path / "position.json")]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            try:
                assert process.stdout is not None
                lines = iter(process.stdout)
                said = next(
                    found for line in lines if (found := re.search(r"SCPI.*port (\d+)", line))
                )
                client = Client(("127.0.0.1", int(said[1])))
                client.socket.settimeout(DEADLINE)
                assert client.ask("SYST:LOCK:REQ?") == "1"
                client.send("ENAB")
                assert client.ask("HOME;*OPC?") == "1"
                assert client.ask("POS:TRUS?") == '1,"homed"'
                assert client.ask("MOVE:ABS 5 MM;*OPC?") == "1"
                place, half, trusted = client.ask("POS?").split(",")
                assert float(place) == pytest.approx(5.0, abs=2.0 * float(half))
                assert trusted == "1"
                assert client.ask("SYST:ERR:ALL?") == '0,"No error"'
                client.close()
            finally:
                process.send_signal(signal.SIGTERM)
                assert process.wait(DEADLINE) == 128 + signal.SIGTERM
