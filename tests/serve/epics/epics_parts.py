"""A served machine with records, on ports of its own, for clients in this process."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from tests.serve.stage.test_served import PATIENT
from tests.systems import require_posix
from tests.warm import Command


def _free() -> str:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return str(probe.getsockname()[1])


# Before any client's library is loaded, which reads them once.
SERVER, REPEATER = _free(), _free()
ENVIRONMENT = {
    "EPICS_CA_ADDR_LIST": "127.0.0.1",
    "EPICS_CA_AUTO_ADDR_LIST": "NO",
    "EPICS_CA_SERVER_PORT": SERVER,
    "EPICS_CAS_SERVER_PORT": SERVER,
    "EPICS_CA_REPEATER_PORT": REPEATER,
    "EPICS_CAS_BEACON_PORT": REPEATER,
}
os.environ.update(ENVIRONMENT)
PREFIX = "T"


@contextlib.contextmanager
def serving(folder: Path, text: str = "", token: str = "") -> Iterator[None]:
    require_posix()
    (folder / "own.toml").write_text(text + PATIENT, encoding="utf-8")
    command = [sys.executable, "-m", "macromicro", "serve", "--config", "own.toml"]
    command += ["--scpi", "-1", "--web", "-1", "--epics", PREFIX, "--state", "position.json"]
    environment = os.environ | {"MACROMICRO_TOKEN": token}
    with Command(
        command, stdout=subprocess.PIPE, text=True, cwd=folder, env=environment
    ) as process:
        try:
            assert process.stdout is not None
            for line in process.stdout:
                if line.startswith("EPICS"):
                    assert line == f"EPICS: {PREFIX} at 127.0.0.1 port {SERVER}\n"
                    break
            yield
        finally:
            process.send_signal(signal.SIGTERM)
            assert process.wait(30) == 128 + signal.SIGTERM
