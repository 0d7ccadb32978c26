"""Messages between serving process and loop process, whole and in order."""

from __future__ import annotations

import contextlib
import pickle
import socket
from collections import deque
from typing import Any

LARGEST = 150_000  # bytes; what a socket's buffer takes at once

DONT_WAIT = socket.MSG_DONTWAIT


def pair() -> tuple[socket.socket, socket.socket]:
    """Both ends of a packet socket; an empty packet means that the other process has ended."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    for end in (ours, theirs):
        end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4 * LARGEST)
    return ours, theirs


def packed(message: Any) -> bytes:
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
    """The loop's end, which never blocks."""

    def __init__(self, end: socket.socket) -> None:
        end.setblocking(False)
        self._end = end
        self._waiting: deque[bytes] = deque()

    def send(self, message: Any) -> None:
        self._waiting.append(packed(message))
        self.flush()

    def flush(self) -> None:
        """Send as much as the socket takes."""
        while self._waiting:
            try:
                self._end.send(self._waiting[0])
            except BlockingIOError:
                return
            except OSError:  # nobody listens any more: the heartbeat will notice
                self._waiting.clear()
                return
            self._waiting.popleft()

    def end(self) -> None:
        """Receive no more: unread messages at exit would reset the link, losing the last ones."""
        with contextlib.suppress(OSError):
            self._end.shutdown(socket.SHUT_RD)
        while self.receive() is not None:
            pass

    def receive(self) -> Any:
        """A message that is there already, or None."""
        try:
            return receive(self._end)
        except (BlockingIOError, EOFError):
            return None
