"""Messages between serving process and loop process, whole and in order."""

from __future__ import annotations

import contextlib
import pickle
import socket
import struct
from collections import deque
from typing import Any

LARGEST = 150_000  # bytes; what a socket's buffer takes at once

_LENGTH = struct.Struct("<I")  # before each message
_PIECE = 1 << 16


def pair() -> tuple[socket.socket, socket.socket]:
    """Both ends of a stream; its end means that the other process has ended."""
    ours, theirs = socket.socketpair()
    for end in (ours, theirs):
        end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4 * LARGEST)
    return ours, theirs


def pack(message: Any) -> bytes:
    data = pickle.dumps(message, pickle.HIGHEST_PROTOCOL)
    return _LENGTH.pack(len(data)) + data


def receive(end: socket.socket) -> Any:
    """Wait for a message; EOFError when the other process has ended."""
    (length,) = _LENGTH.unpack(_exactly(end, _LENGTH.size))
    return pickle.loads(_exactly(end, length))


def _exactly(end: socket.socket, size: int) -> bytes:
    found = b""
    while len(found) < size:
        found += _piece(end, size - len(found))
    return found


def _piece(end: socket.socket, most: int) -> bytes:
    try:
        data = end.recv(most)
    except ConnectionError:
        data = b""
    if not data:
        raise EOFError
    return data


class Outbox:
    """An end that never blocks."""

    def __init__(self, end: socket.socket) -> None:
        end.setblocking(False)
        self._end = end
        self._waiting: deque[bytes] = deque()
        self._arrived = b""
        self.ended = False  # has the other process ended?

    @property
    def busy(self) -> bool:
        """Whether the other process has left too much unread to take more."""
        return bool(self._waiting)

    def send(self, message: Any) -> None:
        self.put(pack(message))

    def put(self, data: bytes) -> None:
        """Send a packed message."""
        self._waiting.append(data)
        self.flush()

    def flush(self) -> None:
        """Send as much as the socket takes."""
        while self._waiting:
            try:
                sent = self._end.send(self._waiting[0])
            except BlockingIOError:
                return
            except OSError:  # nobody listens any more: the heartbeat will notice
                self._waiting.clear()
                return
            if sent < len(self._waiting[0]):
                self._waiting[0] = self._waiting[0][sent:]
            else:
                self._waiting.popleft()

    def end(self) -> None:
        """Receive no more: unread messages at exit would reset the link, losing the last ones."""
        with contextlib.suppress(OSError):
            self._end.shutdown(socket.SHUT_RD)
        with contextlib.suppress(BlockingIOError, EOFError):
            while True:
                _piece(self._end, _PIECE)

    def receive(self) -> Any:
        """A message that is there already, or None."""
        while (message := self._whole()) is None:
            try:
                self._arrived += _piece(self._end, _PIECE)
            except BlockingIOError:
                return None
            except EOFError:
                self.ended = True
                return None
        return pickle.loads(message)

    def _whole(self) -> bytes | None:
        """The first message, if all of it has arrived."""
        if len(self._arrived) < _LENGTH.size:
            return None
        end = _LENGTH.size + _LENGTH.unpack_from(self._arrived)[0]
        if len(self._arrived) < end:
            return None
        message, self._arrived = self._arrived[_LENGTH.size : end], self._arrived[end:]
        return message
