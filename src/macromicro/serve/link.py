"""Messages between the serving process and the loop process: whole ones, in order."""

from __future__ import annotations

import contextlib
import pickle
import socket
from collections import deque
from typing import Any

LARGEST = 150_000  # bytes; what a socket's buffer takes at once

DONT_WAIT = socket.MSG_DONTWAIT


def pair() -> tuple[socket.socket, socket.socket]:
    """The two ends. A packet is a message; the end of one process is read as an empty one."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    for end in (ours, theirs):
        end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4 * LARGEST)
    return ours, theirs


def packed(message: Any) -> bytes:
    """A message as bytes."""
    return pickle.dumps(message, pickle.HIGHEST_PROTOCOL)


def receive(end: socket.socket) -> Any:
    """Wait for a message; EOFError when the other process has ended."""
    try:
        data = end.recv(4 * LARGEST)
    except ConnectionResetError:
        data = b""
    if not data:
        raise EOFError
    return pickle.loads(data)


class Outbox:
    """The loop's side: never waits. What the socket does not take now is sent later."""

    def __init__(self, end: socket.socket) -> None:
        end.setblocking(False)
        self._end = end
        self._waiting: deque[bytes] = deque()

    def send(self, message: Any) -> None:
        """Send, behind what waits already."""
        self._waiting.append(packed(message))
        self.flush()

    def flush(self) -> None:
        """Send what waits, as far as the socket takes it."""
        while self._waiting:
            try:
                self._end.send(self._waiting[0])
            except BlockingIOError:
                return
            except OSError:  # nobody listens any more: the heartbeat will tell
                self._waiting.clear()
                return
            self._waiting.popleft()

    def end(self) -> None:
        """Receive no more. Messages left unread as this process ends would reset the link: the
        other one would hear of that before what was sent last, and that would be lost."""
        with contextlib.suppress(OSError):
            self._end.shutdown(socket.SHUT_RD)
        while self.receive() is not None:
            pass

    def receive(self) -> Any:
        """A message that is there already; None if there is none, or nobody sends any more."""
        try:
            return receive(self._end)
        except (BlockingIOError, EOFError):
            return None
