"""Processes forked from a warm Python, which has imported and compiled what they need.

Only on Linux; elsewhere each is a Python of its own.

Tests of how a process begins, or of one that is killed, start a Python of their own.
"""

from __future__ import annotations

import ctypes
import json
import os
import signal
import socket
import subprocess
import sys
import threading
import types
from collections.abc import Mapping, Sequence
from multiprocessing import util
from typing import Any, ClassVar
from weakref import WeakSet

_CODE = "import sys; from tests.warm_server import main; main(*sys.argv[1:])"
_PR_SET_CHILD_SUBREAPER = 36
_FORKS = sys.platform == "linux"
_turn = threading.Lock()  # of all servers: while one forks, this process takes orphans


class Server:
    """The process that is forked. It starts with the first request and imports a module."""

    def __init__(self, preloaded: str) -> None:
        self._preloaded = preloaded
        self._owner = 0
        self._end: socket.socket | None = None

    @property
    def pid(self) -> int:
        """Of the server that this process has started."""
        return self._process.pid

    def adopt(self, end: socket.socket) -> None:
        """Use the server that waits at the other end."""
        self._end, self._owner = end, os.getpid()

    def forked(
        self, words: Sequence[Any], streams: Sequence[int], passed: Sequence[int],
        folder: Any = None, environment: Mapping[str, str] | None = None, session: bool = False,
    ) -> int:  # fmt: skip
        """The id of a new child of this process, which runs `python WORDS`."""
        request = {
            "words": [os.fsdecode(word) for word in words],
            "folder": os.fsdecode(folder or os.getcwd()),
            "environment": dict(os.environ if environment is None else environment),
            "descriptors": [0, 1, 2, *passed],
            "session": session,
            "blocked": sorted(signal.pthread_sigmask(signal.SIG_BLOCK, ())),  # as a child would
        }
        with _turn:
            if self._owner != os.getpid():  # a fork of its owner needs one of its own
                self._start()
            assert self._end is not None
            # A child of the server forks the process and ends; orphans are ours meanwhile.
            _adopt_orphans(True)
            try:
                socket.send_fds(self._end, [json.dumps(request).encode()], [*streams, *passed])
                return int(self._end.recv(64))
            finally:
                _adopt_orphans(False)

    def _start(self) -> None:
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        path = os.pathsep.join(p or os.getcwd() for p in sys.path)
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-c", _CODE, self._preloaded, str(theirs.fileno())],
                pass_fds=[theirs.fileno()],
                env={**os.environ, "PYTHONPATH": path},
                stdin=subprocess.DEVNULL,
                start_new_session=True,
            )
        self.adopt(ours)


def _adopt_orphans(on: bool) -> None:
    ctypes.CDLL(None).prctl(_PR_SET_CHILD_SUBREAPER, int(on), 0, 0, 0)


LOOPS = Server("tests.warm_loops")
COMMANDS = Server("tests.warm_commands")


class Command(subprocess.Popen[Any]):
    """`subprocess.Popen` of `[sys.executable, "-m", "macromicro", ...]`."""

    server = COMMANDS
    running: ClassVar[WeakSet[Command]] = WeakSet()

    if _FORKS:

        def _execute_child(  # type: ignore[override]
            self, args: Any, _: Any, __: Any, ___: Any, pass_fds: Any, cwd: Any, env: Any,
            *rest: Any,
        ) -> None:  # fmt: skip
            pipes, new_session = rest[3:9], rest[14]
            ends = (pipes[0], pipes[3], pipes[5])  # -1: that of this process
            streams = [own if end == -1 else end for own, end in enumerate(ends)]
            try:
                self.pid = self.server.forked(args[1:], streams, pass_fds, cwd, env, new_session)
                self._child_created = True
                if self.server is COMMANDS:  # loops belong to stations, which may outlive a file
                    self.running.add(self)
            finally:
                self._close_pipe_fds(*pipes)


def end() -> None:
    """Kill the commands that tests have left running."""
    for left in Command.running:
        if left.poll() is None:
            left.kill()
            left.wait()


class Loop(Command):
    """`subprocess.Popen` of a loop process."""

    server = LOOPS


_spawned = util.spawnv_passfds


def loops_are_forked() -> None:
    """Have stations of this process start their loops so."""
    if not _FORKS:
        return
    from macromicro.serve import _launching

    vars(_launching)["subprocess"] = types.SimpleNamespace(Popen=Loop, DEVNULL=subprocess.DEVNULL)


def workers_are_forked() -> None:
    """Have `multiprocessing` start its "spawn" processes so."""
    if not _FORKS:
        return

    def started(path: Any, words: Sequence[Any], passed: Sequence[int]) -> int:
        if "--multiprocessing-fork" not in words:
            return int(_spawned(path, words, passed))
        return COMMANDS.forked(words[1:], (0, 1, 2), passed)

    vars(util)["spawnv_passfds"] = started
