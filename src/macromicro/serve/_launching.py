"""Starts the loop process and waits until it is ready."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from typing import Any, NamedTuple

from macromicro.errors import InputError, MacromicroError, ProblemError
from macromicro.portable import READ_WRITE
from macromicro.serve import link
from macromicro.serve.persist import Kept
from macromicro.serve.settings import AnySettings
from macromicro.serve.shared import Shared

LIVE = "macromicro.serve.live:make"


class Spec(NamedTuple):
    """What the loop process runs."""

    rig: str
    seed: int
    settings: AnySettings
    kept: Kept | str  # the saved position, or why there is none
    machine: str  # MODULE:FUNCTION
    parent: int  # process id of the server


START_S = 120.0  # twice the compilation time of the bench on a slow machine
_CODE = "from macromicro.serve.loop_process import main; main()"


class Child(NamedTuple):
    """A running loop process."""

    process: subprocess.Popen[bytes]
    end: socket.socket
    realtime: str  # what the system has granted it
    channels: tuple[str, ...]


def fresh_python(code: str, *words: str) -> dict[str, Any]:
    """How to run code in another process, which finds the same modules."""
    paths = os.pathsep.join(path or os.getcwd() for path in sys.path)
    return {
        "args": [sys.executable, "-P", "-c", code, *words],
        "env": {**os.environ, "PYTHONPATH": paths},
        "stdin": subprocess.DEVNULL,
    }


def launch(spec: Spec, shared: Shared, lock_fd: int) -> Child:
    """Start the loop process, which inherits the lock; returns shortly before its first period."""
    ours, theirs = link.pair()
    try:
        if os.name == "nt":
            process = _start_on_windows(theirs, shared)
        else:
            fds = (theirs.fileno(), shared.fd, lock_fd)
            process = subprocess.Popen(
                **fresh_python(_CODE, *map(str, fds)), pass_fds=fds, start_new_session=True
            )
    finally:
        theirs.close()
    try:
        ours.send(link.pack(spec))
        return Child(process, ours, *_greeting(process, ours))
    except BaseException:
        process.kill()
        process.wait()
        ours.close()
        raise


def _start_on_windows(theirs: socket.socket, shared: Shared) -> subprocess.Popen[bytes]:
    """Start it on Windows, which passes sockets by a text made for that process."""
    group = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)  # Ctrl-C does not reach it
    started = fresh_python(_CODE, shared.path) | {"stdin": subprocess.PIPE}
    process = subprocess.Popen(**started, creationflags=group)
    assert process.stdin is not None
    process.stdin.write(theirs.share(process.pid))  # type: ignore[attr-defined]
    process.stdin.close()
    return process


def take_over(arguments: list[str]) -> tuple[socket.socket, Spec, Shared]:
    """The loop's end of the link, what it runs and the memory, in the started process."""
    if len(arguments) == 1:
        text = sys.stdin.buffer.read()
        end: socket.socket = socket.fromshare(text)  # type: ignore[attr-defined]
        memory = os.open(arguments[0], READ_WRITE)
    else:
        ends, memory, _lock = map(int, arguments)
        end = socket.socket(fileno=ends)
    spec: Spec = link.receive(end)
    return end, spec, Shared(memory, form=spec.settings.telemetry)


def _greeting(process: subprocess.Popen[bytes], ours: socket.socket) -> tuple[Any, Any]:
    ours.settimeout(START_S)
    began = time.monotonic()
    try:
        kind, *said = link.receive(ours)
    except TimeoutError:
        waited = time.monotonic() - began
        raise MacromicroError(f"the loop process was not ready after {waited:.0f} s") from None
    except (EOFError, OSError):
        status = process.wait()
        raise MacromicroError(
            f"the loop process ended at its start (status {status}); its messages are above"
        ) from None
    if kind == "refused":
        raise InputError(*said)
    if kind == "problem":
        raise ProblemError(*said)
    if kind != "ready":
        raise MacromicroError(f"the machine cannot be opened: {said[0]}")
    ours.settimeout(None)
    return said[0], said[1]
