"""One client's connection in any protocol, from its first line to its end."""

from __future__ import annotations

import asyncio
import contextlib
import select
import socket
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, Generic, NamedTuple, TypeVar

from macromicro.serve._instrument import Instrument
from macromicro.serve.bucket import Bucket
from macromicro.serve.client import Capacity, Client, Entry, Waiting
from macromicro.serve.door._first_line import FirstLine, ForeignProtocol, Grammar
from macromicro.serve.hosts import TRIES, Token, require_token
from macromicro.serve.listening import Listener, check_port, listen_error

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


LINE_LIMIT = 64 * 1024
BLOCK_LIMIT = 1024 * 1024
STOP_COST = 5.0  # of a stop that is done at once, in simple commands


class Bounds(NamedTuple):
    """Limits for the clients of one server."""

    clients: int = 16  # connections at a time
    silent: int = 64  # connections that have not sent a line yet
    crowd: int = 4  # read-only clients, beyond which they share a fixed rate
    messages: int = 64  # pending messages
    waiting: int = 4 * BLOCK_LIMIT  # their bytes
    line: int = LINE_LIMIT  # bytes
    block: int = BLOCK_LIMIT  # bytes
    rate: float = 500.0  # simple commands per second, sustained
    burst: float = 500.0  # simple commands at once
    unread: float = 10.0  # s for which answers stay unread, or a block incomplete


PENALTY = 1.0  # s that a wrong token costs
GRACE = 2.0  # s for which queries of a client that has closed are still answered
_READ = 16 * 1024
T = TypeVar("T")


class Connection(ABC, Generic[T]):
    """Serves one client until it leaves; nothing runs before its first line is recognized."""

    def __init__(
        self,
        client: Client,
        grammar: Grammar,
        monitor: SocketMonitor,
        writer: asyncio.StreamWriter,
        bounds: Bounds,
    ) -> None:
        self.client = client
        self._grammar, self._monitor, self._writer = grammar, monitor, writer
        self._bounds = bounds
        self._bucket = Bucket(bounds.rate, bounds.burst)
        self._waiting: Waiting[T] = Waiting(client, bounds.messages, bounds.waiting)
        self._patience: float = client.instrument.settings.serve.client_timeout
        self._failures = 0  # wrong tokens that were paid for

    # What a protocol adds

    @abstractmethod
    async def _hear(self, data: bytes) -> bool:
        """Execute stops at once and queue the rest; False if nothing more can be read."""

    @abstractmethod
    async def _do(self, entry: Entry[T]) -> bool:
        """Execute a queued command; False if the connection must end."""

    @property
    def _unfinished(self) -> bool:
        """Whether more data must come before anything else is read, stops included."""
        return False

    def _silenced(self) -> None:
        """React to the client's expired watchdog."""

    # As the places see it

    @property
    def rank(self) -> int:
        return self.client.rank

    @property
    def heard(self) -> float:
        return self._monitor.heard

    def dismiss(self) -> None:
        self._monitor.reset = True
        self._monitor.ended.set()

    # From the first line to the end

    async def run(self) -> None:
        """Serve until the client has left and its commands are done."""
        prepare(self._writer.get_extra_info("socket"))
        worker = asyncio.create_task(self._waiting.work(self._do))
        reading = asyncio.create_task(self._read())
        ended = asyncio.create_task(self._monitor.ended.wait())
        tasks = worker, reading, ended
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            self.client.close()
            if not worker.done() and not self._monitor.reset:
                # What came before the end: stops are done and queries answered.
                with contextlib.suppress(TimeoutError, OSError):
                    async with asyncio.timeout(GRACE):
                        await self._finish(reading, worker)
        finally:
            self.client.close()
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            self._writer.transport.abort()

    def watch(self) -> None:
        """Disconnect a client that has closed, cannot be followed or left a block incomplete.

        Of any other one send the heartbeat, or lose it after its watchdog has expired.
        """
        monitor, now = self._monitor, time.monotonic()
        monitor.look(self._writer.get_extra_info("socket"))
        stalled = monitor.stalled_since is not None and now - monitor.stalled_since > self._patience
        stuck = self._unfinished and now - monitor.heard > self._bounds.unread
        if stalled or (stuck and not self._behind):
            self.dismiss()
        if not self._monitor.ended.is_set() and not self.client.beat(self._silence()):
            self._silenced()

    @property
    def _behind(self) -> bool:
        return self._waiting.busy or self._monitor.stalled_since is not None

    def _silence(self) -> float:
        """Seconds without data while none was awaited, less the server's own delay."""
        silent = time.monotonic() - max(self._monitor.heard, self._waiting.rested)
        return silent - (self._patience if self._behind else 0.0)

    async def _finish(self, reading: asyncio.Task[None], worker: asyncio.Task[None]) -> None:
        await reading
        await self._waiting.end()
        await worker
        await self._writer.drain()
        self._writer.close()
        await self._writer.wait_closed()

    async def _read(self) -> None:
        try:
            data = await self._first()
            while data and await self._hear(data):
                data = await self._monitor.take(_READ)
        except ForeignProtocol as error:
            client = self.client
            client.station.trail.client("foreign", client.name, f"sent {error}")
        except OSError:  # reset, or the peer no longer answers
            return

    async def _first(self) -> bytes:
        """Data up to the end of the first line, once the client has a place; else none."""
        line, found = FirstLine(self._grammar), b""
        while not found:
            data = await self._monitor.take(_READ)
            if not data:
                return b""
            found = line.take(data)
        if not self.client.capacity.claim(self):
            return b""
        self.client.connect()
        return found

    # For `_do`

    async def _send(self, data: bytes) -> bool:
        """Send an answer; False if the client does not read it."""
        self._writer.write(data)
        try:
            async with asyncio.timeout(self._bounds.unread):
                await self._writer.drain()
        except (TimeoutError, OSError):
            return False
        return True

    async def _admissible(self) -> bool:
        """Delay after a wrong token; False after too many."""
        if self.client.failures != self._failures:
            await asyncio.sleep(PENALTY)
            self._failures = self.client.failures
        return self._failures < TRIES


BEAT = 0.1
BACKLOG = 128


def token(host: str, given: str | Token | None) -> Token:
    """The token of a server that listens at `host`, checked."""
    if isinstance(given, Token):
        return given
    require_token(host, given)
    return Token(given)


class LineServer(Listener):
    """The server of a protocol of lines, at a TCP port.

    `session` makes a client, and `connection` what serves it.
    """

    def __init__(
        self,
        kind: str,
        host: str,
        port: int,
        session: Callable[..., Client],
        connection: Callable[..., Connection[Any]],
        instrument: Instrument,
        bounds: Bounds,
    ) -> None:
        super().__init__(kind, host, port)
        self._session, self._connection = session, connection
        self._instrument, self._bounds = instrument, bounds

    async def _serve(self) -> None:
        bounds = self._bounds
        connections: dict[Connection[Any], asyncio.Task[None]] = {}
        capacity = Capacity(bounds.clients, bounds.silent, bounds.crowd, yielding=True)

        async def run(connection: Connection[Any]) -> None:
            try:
                await connection.run()
            finally:
                capacity.leave(connection)
                del connections[connection]

        def accept(monitor: SocketMonitor, writer: asyncio.StreamWriter) -> None:
            most = 2 * (bounds.clients + bounds.silent)  # those that are on their way out counted
            peer = writer.get_extra_info("peername")
            if len(connections) >= most or peer is None:
                writer.transport.abort()
                return
            name = f"{self._kind.lower()} {peer[0]}:{peer[1]}"
            client = self._session(self._instrument, name, peer[0], capacity)
            connection = self._connection(client, monitor, writer, bounds)
            capacity.arrive(connection)
            connections[connection] = asyncio.create_task(run(connection))

        def protocol() -> asyncio.StreamReaderProtocol:
            monitor = SocketMonitor()
            return asyncio.StreamReaderProtocol(monitor, lambda _, writer: accept(monitor, writer))

        host, port = self._where
        check_port(port)
        try:
            loop = asyncio.get_running_loop()
            listening = await loop.create_server(protocol, host, port, backlog=BACKLOG)
        except OSError as error:
            raise listen_error(host, port, error) from None
        try:
            self._listening(*listening.sockets[0].getsockname()[:2])
            while True:
                await asyncio.sleep(BEAT)
                for connection in connections:
                    connection.watch()
        finally:
            listening.close()
            tasks = tuple(connections.values())
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
