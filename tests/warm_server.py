"""Forks processes on request; see `tests.warm`."""

from __future__ import annotations

import atexit
import contextlib
import fcntl
import gc
import importlib
import json
import os
import signal
import socket
import sys
import threading
import time
import traceback
from typing import Any

from macromicro import threads

_SIZE = 2**20  # of a request, which contains an environment
_ABOVE = 500  # no process asks for a descriptor with so high a number


def main(preloaded: str, end: str) -> None:
    """Import a module, then fork until the other end is closed."""
    signal.pthread_sigmask(signal.SIG_SETMASK, ())  # the first who asks may block some
    threads.one_for_blas()  # before numpy is imported
    importlib.import_module(preloaded)
    _serve(socket.socket(fileno=int(end)))


def _serve(end: socket.socket) -> None:
    """Never returns; the processes that it forks run `_program`."""
    gc.collect()
    gc.freeze()  # the collectors of forked processes leave these pages alone
    while True:
        message, descriptors, _, _ = socket.recv_fds(end, _SIZE, 64)
        if not message:
            os._exit(0)
        end.send(_forked(json.loads(message), descriptors, end))
        for descriptor in descriptors:
            os.close(descriptor)


def _forked(request: dict[str, Any], descriptors: list[int], end: socket.socket) -> bytes:
    """The id of the new process. Its parent has ended: it belongs to whoever takes orphans."""
    reading, writing = os.pipe()
    parent = os.fork()
    if parent == 0:
        parent = os.getpid()
        child = os.fork()
        if child:
            os.write(writing, str(child).encode())
            os._exit(0)
        for used in (end.detach(), reading, writing):
            os.close(used)
        while os.getppid() == parent:
            time.sleep(0.0005)
        _program(request, descriptors)
    os.waitpid(parent, 0)
    number = os.read(reading, 64)
    os.close(reading)
    os.close(writing)
    return number


def _program(request: dict[str, Any], descriptors: list[int]) -> None:
    """Run what `python WORDS` would run, and end as it would."""
    words = request["words"]
    signal.pthread_sigmask(signal.SIG_SETMASK, request["blocked"])
    if "-m" in words:
        _server_of_its_own(descriptors)
    if request["session"]:
        os.setsid()
    above = [fcntl.fcntl(number, fcntl.F_DUPFD_CLOEXEC, _ABOVE) for number in descriptors]
    for number in descriptors:
        os.close(number)
    for number, wanted in zip(above, request["descriptors"], strict=True):
        os.dup2(number, wanted)
        os.close(number)
    unbuffered = "PYTHONUNBUFFERED" in request["environment"]
    sys.stdin = open(0, encoding="utf-8", closefd=False)  # noqa: SIM115
    sys.stdout = open(1, "w", 1 if unbuffered else -1, encoding="utf-8", closefd=False)  # noqa: SIM115
    sys.stderr = open(2, "w", 1, encoding="utf-8", closefd=False)  # noqa: SIM115
    os.chdir(request["folder"])
    os.environ.clear()
    os.environ.update(request["environment"])
    own = request["environment"].get("PYTHONPATH", "")
    sys.path[:0] = [path for path in own.split(os.pathsep) if path and path not in sys.path]
    status = 0
    try:
        _run(words)
    except SystemExit as ended:
        status = _status(ended.code)
    except KeyboardInterrupt:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        os.kill(os.getpid(), signal.SIGINT)
    except BaseException:
        traceback.print_exc()
        status = 1
    threading._shutdown()  # type: ignore[attr-defined]
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):
            stream.flush()
    os._exit(status)


def _run(words: list[str]) -> None:
    if "-m" in words:
        sys.path.insert(0, os.getcwd())
        sys.argv = words[words.index("-m") + 1 :]
        from macromicro.__main__ import main as command

        sys.exit(command())
    if "-P" not in words:
        sys.path.insert(0, "")
    code = words.index("-c") + 1
    sys.argv = ["-c", *words[code + 1 :]]
    exec(words[code], {"__name__": "__main__"})


def _status(code: object) -> int:
    if code is None or isinstance(code, int):
        return code or 0
    print(code, file=sys.stderr)
    return 1


def _server_of_its_own(descriptors: list[int]) -> None:
    """Loops and workers of a command are forked from a copy of this process, as warm as it is."""
    from tests import warm

    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    if os.fork() == 0:
        ours.close()
        for number in descriptors:
            os.close(number)
        _serve(theirs)
    theirs.close()
    warm.LOOPS = warm.Loop.server = warm.COMMANDS
    warm.COMMANDS.adopt(ours)
    warm.loops_are_forked()
    warm.workers_are_forked()
