"""The server itself: killed and started again, its port taken, its disk full, its time short."""

from __future__ import annotations

import contextlib
import errno
import math
import multiprocessing
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from fault_parts import RIG, Scene, note, trusted

import faulty
from macromicro import recorder
from macromicro.control.live import messages as m
from macromicro.recording import Recording
from macromicro.serve import faults, persist, ticking
from tests.systems import linux
from tests.waiting import until

PITCH = 0.2 / 2800.0


class Command:
    """`macromicro serve` as a person starts it."""

    def __init__(self, folder: Path, *options: str) -> None:
        state = folder / "position.json"
        command = [sys.executable, "-m", "macromicro", "serve", "--rig", RIG, "--web", "-1"]
        self.process = subprocess.Popen(
            [*command, "--state", str(state), *options],
            stdout=subprocess.PIPE,
            stderr=(folder / "stderr").open("w"),
            text=True,
            start_new_session=True,
        )

    def port(self) -> int:
        """Where it listens, once it does."""
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if found := re.match(r"SCPI: \S+ port (\d+)", line):
                return int(found[1])
        raise AssertionError("it ended without listening")

    def ask(self, port: int, *lines: str) -> list[str]:
        """Answers to the lines with a question mark, over one connection."""
        with socket.create_connection(("127.0.0.1", port), 30.0) as end:
            file = end.makefile("rb")
            answers = []
            for line in lines:
                end.sendall(line.encode() + b"\n")
                if line.endswith("?"):
                    answers.append(file.readline().decode().strip())
            return answers


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., Command]]:
    monkeypatch.setenv(faulty.BOARD, str(tmp_path / "board"))
    made: list[Command] = []

    def make(*options: str) -> Command:
        made.append(Command(tmp_path, *options))
        return made[-1]

    yield make
    for each in made:
        with contextlib.suppress(ProcessLookupError):
            each.process.kill()
        each.process.wait()


def gone(number: int) -> bool:
    """Has the process ended? (One that nobody has waited for yet has, too.)"""
    try:
        state = Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return True
    return state == "Z"


@linux
@pytest.mark.slow
def test_a_server_killed_on_the_way_and_started_again(
    command: Callable[..., Command], tmp_path: Path
) -> None:
    trusted(tmp_path / "position.json")
    cells = faulty.board(tmp_path / "board")
    served = command("--scpi", "0", "--record", str(tmp_path / "runs"))
    port = served.port()
    with socket.create_connection(("127.0.0.1", port), 30.0) as end:
        end.sendall(b"SYST:LOCK:REQ?\n")
        file = end.makefile("rb")
        assert file.readline() == b"1\n"

        def rows() -> bool:
            end.sendall(b"REC?\n")
            return int(file.readline().split(b",")[1]) > 300

        until(rows)
        end.sendall(b"ENAB;:MOVE:MACR 2500\n")
        until(lambda: cells[faulty.CARRIAGE] / PITCH > 100.0)
        assert cells[faulty.MOTOR] != 0.0
        killed, at = time.monotonic_ns(), float(cells[faulty.TIME])
        served.process.kill()
        until(lambda: cells[faulty.SAFE_AT] >= 0.0)
        took = (cells[faulty.SAFE_NS] - killed) * 1e-6
    words = (tmp_path / "position.json.lock").read_text()
    loop = int(words.rpartition(" ")[2])
    until(lambda: gone(loop))
    assert all(cells[[faulty.MOTOR, faulty.CTRL, faulty.FAN]] == 0.0)
    kept = persist.load(tmp_path / "position.json")
    assert isinstance(kept, persist.Kept) and kept.moving
    run = Recording.load(next((tmp_path / "runs").glob("*.h5")))
    assert np.array_equal(np.diff(np.round(run["t"] * 1e3)), np.ones(run.rows - 1))
    assert run.rows > 300
    assert run["t"][-1] >= at - 0.35  # what the recorder had not fetched yet is lost with it

    again = command("--scpi", "0")
    port = again.port()
    trust, lock, error, mode = again.ask(
        port, "POS:TRUS?", "SYST:LOCK:REQ?", "ENAB", "MOVE 20 mm", "SYST:ERR?", "MODE?"
    )
    assert trust.startswith("0,") and "interrupted" in trust
    assert lock == "1" and "home" in error and mode == '"ready"'
    assert (cells[faulty.MOTOR], cells[faulty.CTRL]) == (0.0, 0.0)
    again.process.send_signal(signal.SIGTERM)
    assert again.process.wait(30.0) == 128 + signal.SIGTERM
    note("server killed", took, "0 V, the loop process ends", "at the next start: home first")


@linux
@pytest.mark.slow
def test_a_port_in_use(command: Callable[..., Command], tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        served = command("--scpi", str(port))
        assert served.process.wait(120.0) not in (0, -signal.SIGKILL)
    said = (tmp_path / "stderr").read_text()
    assert f"port {port}" in said and "in use" in said and "free port" in said
    assert "Traceback" not in said
    loop = int((tmp_path / "position.json.lock").read_text().rpartition(" ")[2])
    until(lambda: gone(loop))
    persist.Lock(tmp_path / "position.json").take()  # nothing holds the machine any more
    cells = faulty.board(tmp_path / "board")
    assert all(cells[[faulty.MOTOR, faulty.CTRL, faulty.FAN]] == 0.0)
    note("port in use", 0, "never anything but 0 V", "port in use; a free port, or 0 for any")


def test_a_full_disk_while_recording(
    scene: Callable[..., Scene], monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = scene()
    motion = bench.ask(m.MoveMacro(300))
    until(lambda: bench.station.snapshot().recording.rows > 100)

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(recorder, "write_all", full)
    told = until(lambda: [e for e in bench.station.events()[1] if e.cause == "failed"])
    monkeypatch.undo()
    assert "No space left" in told[0].evidence["reason"]
    assert bench.end(motion).outcome == "done"
    assert bench.station.snapshot().fault is None
    state = bench.station.end_recording()
    run = Recording.load(bench.file)
    assert run.rows == state.rows > 100
    assert np.array_equal(np.diff(np.round(run["t"] * 1e3)), np.ones(run.rows - 1))
    note("disk full", math.nan, "goes on (or stops, as configured)", "event: recording failed")


def _busy() -> None:
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    while True:
        pass


@linux
@pytest.mark.slow
def test_two_busy_processes_beside_the_loop(scene: Callable[..., Scene]) -> None:
    """On its own core, as favoured as it is: it keeps up, or stops with the fault that says so."""
    core = min(os.sched_getaffinity(0))
    bench = scene(core=core, realtime="off", miss_share=0.05, miss_window=0.5)
    context = multiprocessing.get_context("spawn")
    busy = [context.Process(target=_busy, daemon=True) for _ in range(2)]
    for each in busy:
        each.start()
    try:
        motion = bench.ask(m.MoveMacro(1500))
        end = bench.end(motion)
    finally:
        for each in busy:
            each.kill()
            each.join()
    now = bench.station.snapshot()
    run = bench.run()
    assert np.array_equal(np.diff(np.round(run["t"] * 1e3)), np.ones(run.rows - 1))
    lost = now.pace.missed
    assert end.outcome == ("done" if now.fault is None else "fault")
    if now.fault is not None:
        assert now.fault.code == faults.LATE and "priority" in now.fault.remedy
        first = int(np.flatnonzero(run["fault"] == faults.LATE)[0])
        assert np.all(run["motor"][first:] == 0.0)
        assert lost >= 0.05 * 500
    late = float(run["late"].max()) * 1e-3
    note("loop starved", late, f"{end.outcome}; {lost} periods missed", "fault where too many")


@pytest.mark.slow
def test_the_computers_clock_may_be_set(
    scene: Callable[..., Scene], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing that serves is timed by it, and the loop never asks for it."""
    bench = scene(client_timeout=5.0)
    motion = bench.ask(m.MoveMacro(600))
    now = time.time
    for leap in (3600.0, -3600.0):
        monkeypatch.setattr(time, "time", lambda leap=leap: now() + leap)
        time.sleep(0.2)
        assert bench.station.snapshot().holder
    assert bench.end(motion).outcome == "done"
    assert bench.station.snapshot().fault is None
    for name in (
        "ticking",
        "_pacing",
        "loop_process",
        "shared",
        "_holders",
        "_loop_connection",
        "client",
    ):
        source = Path(ticking.__file__).with_name(f"{name}.py").read_text()
        assert "time.time(" not in source
    note("computer's clock set", math.nan, "goes on", "nothing")
