"""A client's socket: what arrived, when, and whether the peer is still there."""

from __future__ import annotations

import asyncio
import select
import socket
import time
from typing import Any

HERE, CLOSED, RESET = range(3)
_LIMIT = 64 * 1024
_PEER_CLOSED = getattr(select, "POLLRDHUP", 0)  # known to Linux: also behind unread data
_BROKEN = getattr(select, "POLLERR", 0) | getattr(select, "POLLHUP", 0)


class SocketMonitor(asyncio.StreamReader):
    """A stream that knows, before reading, when bytes arrived and whether the peer closed."""

    def __init__(self) -> None:
        super().__init__(_LIMIT)
        self.heard = time.monotonic()
        self.stalled_since: float | None = None
        self.ended = asyncio.Event()
        self.reset = False
        self._held = 0

    def feed_data(self, data: Any) -> None:
        self.heard = time.monotonic()
        self._held += len(data)
        if self._held <= 2 * _LIMIT:  # beyond this the stream reads no more
            self.stalled_since = None
        elif self.stalled_since is None:
            self.stalled_since = self.heard
        super().feed_data(data)

    def feed_eof(self) -> None:
        self.ended.set()
        super().feed_eof()

    def set_exception(self, exc: Exception) -> None:
        self.reset = True
        self.ended.set()
        super().set_exception(exc)

    async def take(self, most: int) -> bytes:
        """At most `most` bytes; none at the end. Raises OSError on a lost connection."""
        data = await self.read(most)
        self._held -= len(data)
        return data

    def look(self, connection: socket.socket) -> None:
        """Ask the system about the peer; to be called periodically."""
        # Below its limit the stream has resumed reading, and has taken what there was.
        if self._held <= _LIMIT // 2:
            self.stalled_since = None
        state = peer(connection)
        self.reset = self.reset or state == RESET
        if state != HERE:
            self.ended.set()


def peer(connection: socket.socket) -> int:
    """State of the peer, without reading data."""
    number = connection.fileno()
    if number < 0:
        return RESET
    if not hasattr(select, "poll"):
        return HERE
    asked = select.poll()
    asked.register(number, _PEER_CLOSED)
    found = sum(event for _, event in asked.poll(0))
    return RESET if found & _BROKEN else CLOSED if found & _PEER_CLOSED else HERE


def prepare(connection: socket.socket) -> None:
    """Set TCP_NODELAY, and keep-alive that detects a dead peer within about 11 s."""
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for option, value in (
        ("TCP_KEEPIDLE", 5),
        ("TCP_KEEPINTVL", 2),
        ("TCP_KEEPCNT", 3),
        ("TCP_USER_TIMEOUT", 11_000),
    ):
        if hasattr(socket, option):
            connection.setsockopt(socket.IPPROTO_TCP, getattr(socket, option), value)
