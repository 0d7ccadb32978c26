"""A host in a process of its own, at the simulated board's pseudo-terminal."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from macromicro.rig.board.protocol import SPEC
from tests.firmware.built import ROOT, elf, needs_avr
from tests.systems import posix

pytestmark = needs_avr
DEADLINE = 120.0  # s; a busy machine is slow
HOST = """
import sys
from macromicro.control import calibration
from macromicro.rig.board.rig import BoardRig
from macromicro.types import Outputs
with BoardRig(sys.argv[1], "host", calibration.default_calibration()) as rig:
    for k in range(100000):
        rig.read()
        rig.write(Outputs(4.0 if k // 150 % 2 == 0 else -4.0, 1.0, 0.0, 0.0))
        rig.wait(1e-3)
        if k == 100:
            print("moving", flush=True)
"""


def _environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": f"{ROOT / 'tools'}:{ROOT / 'src'}"}


@contextmanager
def simulated(folder: Path, *options: str, program: Path | None = None) -> Iterator[Path]:
    """The port of a board with this program, or the firmware; its trace is in the folder after."""
    port, end, trace = folder / "board", folder / "end", folder / "trace.npy"
    command = [
        sys.executable,
        "-m",
        "boardsim",
        "--elf",
        str(program or elf()),
        "--link",
        str(port),
    ]
    command += ["--until", str(end), "--trace", str(trace)]
    command += ["--alone", str(folder / "alone"), *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, env=_environment())
    try:
        assert process.stdout is not None
        process.stdout.readline()
        yield port
        end.touch()
        process.wait(DEADLINE)
    finally:
        process.kill()
        process.wait()


@posix
def test_a_host_killed_in_motion_leaves_a_board_that_stops(tmp_path: Path) -> None:
    with simulated(tmp_path) as port:
        host = subprocess.Popen(
            [sys.executable, "-c", HOST, str(port)], stdout=subprocess.PIPE, env=_environment()
        )
        try:
            assert host.stdout is not None
            assert host.stdout.readline() == b"moving\n"
            host.send_signal(signal.SIGKILL)
        finally:
            host.kill()
            host.wait(DEADLINE)
        began = time.monotonic()
        while not (tmp_path / "alone").exists():  # the two seconds without a host have passed
            assert time.monotonic() - began < DEADLINE
            time.sleep(0.05)
    motor, ctrl, enabled = np.load(tmp_path / "trace.npy").T
    last = np.flatnonzero(enabled)[-1]
    assert abs(motor[: last + 1]).max() > 3.9
    assert len(enabled) - last > 1000  # off, and it stays off
    assert not np.any(ctrl[last + 1 :])
    silent = np.flatnonzero(ctrl)[-1]  # the wire is off at once, the motor within its time
    assert last - silent == pytest.approx(SPEC["decelerate"], abs=5)
