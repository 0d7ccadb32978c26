"""The server under trial: the command as a person starts it, and what the system tells of it."""

from __future__ import annotations

import contextlib
import os
import re
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import faulty
from faultmatrix.subjects import made
from macromicro.errors import MacromicroError


class Load(NamedTuple):
    """Memory of their own [bytes] and open descriptors of the serving process and of the loop's.

    What both share, the ring of telemetry, counts for neither: it shows up as it is read.
    """

    memory: int
    files: int
    loop_memory: int
    loop_files: int


class Victim:
    """`macromicro serve` on a faulty rig of a kind, in a folder of its own; with a `page`, or
    without."""

    def __init__(
        self, folder: Path, seed: int, *, page: bool = False, kind: str = "two-stage"
    ) -> None:
        self.folder, self.state = folder, folder / "position.json"
        self.subject = made(kind, folder)
        self.recordings = folder / "recordings"
        self.cells = faulty.board(self.subject.board)
        self.port, self.page = 0, 0
        self._web = "0" if page else "-1"
        self._seed = seed
        self._process: subprocess.Popen[str] | None = None

    @property
    def pid(self) -> int:
        """The serving process."""
        assert self._process is not None
        return self._process.pid

    @property
    def loop(self) -> int:
        """The loop process, as the lock file names it."""
        words = self.state.with_name(f"{self.state.name}.lock").read_text(encoding="utf-8")
        return int(words.rpartition(" ")[2])

    def command(self, port: int) -> list[str]:
        """The command line."""
        options = [
            "--rig",
            self.subject.rig,
            "--web",
            self._web,
            "--scpi",
            str(port),
            "--seed",
            str(self._seed),
        ]
        files = ["--state", str(self.state), "--config", str(self.subject.file)]
        folder = ["--record", str(self.recordings)]
        return [sys.executable, "-m", "macromicro", "serve", *options, *files, *folder]

    def start(self) -> None:
        """Start it; returns when it listens. Raises MacromicroError with its last words."""
        with (self.folder / "stderr").open("a") as errors:
            self._process = subprocess.Popen(
                self.command(0),
                stdout=subprocess.PIPE,
                stderr=errors,
                text=True,
                env={**os.environ, **self.subject.environment},
                start_new_session=True,
            )
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if found := re.match(r"SCPI: \S+ port (\d+)", line):
                self.port = int(found[1])
            elif found := re.match(r"page: http://\S+:(\d+)/", line):
                self.page = int(found[1])
            elif line.startswith("Ctrl-C"):
                return
        raise MacromicroError(f"the server did not start: {self.said()}")

    def said(self) -> str:
        """The end of its error output."""
        return (self.folder / "stderr").read_text(encoding="utf-8")[-2000:]

    def kill(self) -> float:
        """SIGKILL; the seconds until the outputs were safe. Waits for the loop process' end."""
        process, loop, began = self._process, self.loop, time.monotonic_ns()
        assert process is not None
        process.kill()
        process.wait()
        until(lambda: self.cells[faulty.SAFE_AT] >= 0.0)
        until(lambda: _gone(loop))
        return max(float(self.cells[faulty.SAFE_NS] - began) * 1e-9, 0.0)

    def end(self) -> int:
        """Ctrl-C; its exit status."""
        process = self._process
        if process is None:
            return 0
        with contextlib.suppress(ProcessLookupError):
            process.terminate()
        return process.wait(30.0)

    def load(self) -> Load:
        """What both processes use now."""
        return Load(*_use(self.pid), *_use(self.loop))


def safe_after(victim: Victim, since: float = 0.0) -> float:
    """Seconds from a time [ns], or the fault's first sample, to outputs that stay safe."""
    began = since or float(victim.cells[faulty.ONSET_NS])
    return max(float(victim.cells[faulty.SAFE_NS] - began) * 1e-9, 0.0)


def until(true: Callable[[], Any], patience: float = 30.0) -> Any:
    """What `true` gives once that is true; MacromicroError where it does not come."""
    deadline = time.monotonic() + patience
    while time.monotonic() < deadline:
        if found := true():
            return found
        time.sleep(0.005)
    raise MacromicroError(f"waited {patience:g} s in vain")


def _gone(number: int) -> bool:
    try:
        state = (
            Path(f"/proc/{number}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0]
        )
    except OSError:
        return True
    return state == "Z"


def _use(number: int) -> tuple[int, int]:
    status = Path(f"/proc/{number}/status").read_text(encoding="utf-8")
    found = re.search(r"RssAnon:\s+(\d+) kB", status)
    assert found is not None
    return 1024 * int(found[1]), len(os.listdir(f"/proc/{number}/fd"))


class Client:
    """A plain SCPI connection."""

    def __init__(self, port: int) -> None:
        self.socket = socket.create_connection(("127.0.0.1", port), 30.0)
        self._file = self.socket.makefile("rb")

    def send(self, text: str) -> None:
        """A line without an answer."""
        self.socket.sendall(text.encode() + b"\n")

    def ask(self, text: str) -> str:
        """A line and its answer."""
        self.send(text)
        answer = self._file.readline()
        if not answer:
            raise ConnectionError("the server closed the connection")
        return answer.decode().removesuffix("\n")

    def close(self) -> None:
        """Go in peace."""
        self._file.close()
        self.socket.close()
