"""The loop process when the serving process is killed, or halted."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from serve_parts import LEFT, MOTOR, PID, STEPS

from macromicro.errors import MacromicroError
from macromicro.serve import persist
from macromicro.serve.persist import Lock
from macromicro.serve.station import Station
from tests.systems import posix
from tests.waiting import until

pytestmark = posix

PARENT = """
import sys
sys.path.insert(0, sys.argv[1])
from serve_parts import serve_until_killed
serve_until_killed(sys.argv[2])
"""


@pytest.fixture
def parent(log: Any, tmp_path: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A serving process whose machine moves."""
    here = str(Path(__file__).parent)
    state = str(tmp_path / "position.json")
    process = subprocess.Popen([sys.executable, "-c", PARENT, here, state], stdout=subprocess.PIPE)
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == b"moving\n"
        until(lambda: log[MOTOR] == 1.0)
        yield process
    finally:
        process.kill()
        process.send_signal(signal.SIGCONT)
        process.wait()
        if log[PID]:
            until(lambda: not alive(int(log[PID])))


def alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_a_killed_parent_leaves_a_safe_machine_and_no_trust(
    parent: subprocess.Popen[bytes],
    log: Any,
    tmp_path: Path,
    station: Callable[..., Station],
) -> None:
    path = tmp_path / "position.json"
    parent.kill()
    steps = log[STEPS]
    until(lambda: log[LEFT])
    assert log[MOTOR] == 0.0
    # The death signal is told of at once: far fewer steps than the heartbeat would allow.
    assert log[STEPS] - steps < 500
    until(lambda: not alive(int(log[PID])))
    kept = persist.load(path)
    assert isinstance(kept, persist.Kept)
    assert kept.moving
    again = station()  # the lock is free again
    again.start()
    assert not again.snapshot().trusted
    until(lambda: "interrupted" in again.snapshot().trust)
    assert log[MOTOR] == 0.0


def test_a_halted_parent_is_as_good_as_dead(parent: subprocess.Popen[bytes], log: Any) -> None:
    parent.send_signal(signal.SIGSTOP)  # no death signal: only the heartbeat tells
    until(lambda: log[LEFT])
    assert log[MOTOR] == 0.0
    parent.send_signal(signal.SIGCONT)
    assert parent.stdout is not None
    told = parent.stdout.readline().decode()
    assert "the server was silent for " in told
    assert "serve.parent_timeout" in told
    assert "start it again" in told


def test_while_a_loop_lives_its_machine_is_locked(
    parent: subprocess.Popen[bytes], log: Any, tmp_path: Path, station: Callable[..., Station]
) -> None:
    text = rf"process {parent.pid}, its loop is process {int(log[PID])}.*end that one first"
    with pytest.raises(MacromicroError, match=text):
        station().start()
    parent.kill()
    until(lambda: not alive(int(log[PID])))
    lock = Lock(tmp_path / "position.json")
    lock.take()
    lock.drop()
