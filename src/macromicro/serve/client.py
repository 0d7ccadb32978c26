"""A client of any protocol: admission, orders in turn, priority stops, loss of the client."""

from __future__ import annotations

import asyncio
import contextlib
import math
import threading
import time
from collections.abc import Awaitable, Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Reply
from macromicro.serve import _capacity
from macromicro.serve._capacity import Capacity
from macromicro.serve._instrument import Instrument
from macromicro.serve._sending import Stops
from macromicro.serve.requests import OVERTAKEN

POLL_S = 0.02
OTHERS = 2  # threads for all clients that may not command
SPARE = 8  # threads for clients that come and go
T = TypeVar("T")


class Client:
    """One client of the station; `stop` and `emergency` may overtake its orders from any thread."""

    def __init__(self, instrument: Instrument, name: str, address: str = "127.0.0.1") -> None:
        self.instrument, self.station = instrument, instrument.station
        self.name, self.address = name, address
        self.authenticated = instrument.token.open
        self.failures = 0  # wrong tokens
        self.watchdog = 0.0
        self.stops = 0  # its own, so far
        self.gone = threading.Event()
        self.calls: set[Future[Any]] = set()  # those under way in other threads

    # Who it is

    @property
    def rank(self) -> int:
        if self.station.holder == self.name:
            return _capacity.HOLDER
        if self.authenticated and not self.instrument.token.open:
            return _capacity.ADMITTED
        return _capacity.unadmitted(self.address)

    def authenticate(self, given: object) -> str:
        """Check a token: the reason for a refusal, or ""."""
        problem = self.instrument.admission(
            given, self.name, self.address, known=self.authenticated
        )
        self.authenticated = not problem
        self.failures += bool(problem)
        return problem

    def connect(self) -> None:
        """Have the station list the client."""
        self.station.connect(self.name)

    def close(self) -> None:
        """Disconnect; the station treats a holder of control as lost."""
        if not self.gone.is_set():
            self.gone.set()
            self.station.disconnect(self.name)

    def beat(self, silence: float) -> bool:
        """Report a sign of life after `silent` seconds; False once the watchdog has expired."""
        if self.gone.is_set():
            return True
        if not self.watchdog or silence <= self.watchdog:
            self.station.heartbeat(self.name)
        elif self.station.holder == self.name:
            self.lose()
            return False
        return True

    def lose(self) -> None:
        """Count the client as lost; it may still watch."""
        self.station.disconnect(self.name)
        self.station.connect(self.name)
        if self.gone.is_set():  # it went meanwhile
            self.station.disconnect(self.name)

    # What it orders

    def request(self, request: m.Request, entry: Entry[Any] | None = None) -> Reply:
        """Pass a request on, unless a stop has come since `entry`."""
        if entry is not None and entry.stops != self.stops:
            return OVERTAKEN
        since = None if entry is None else entry.since
        return self.station.request(self.name, request._replace(client=self.name), since)

    def stop(self) -> Reply:
        """Decelerate at once; an order that is on its way comes before it or is refused."""
        self.stops += 1
        return self.station.request(self.name, m.Stop(self.name))

    def emergency(self) -> float:
        """Emergency stop at once: seconds until the outputs were safe, NaN without an answer."""
        self.stops += 1
        return self.station.emergency(self.name)


class Entry(NamedTuple, Generic[T]):
    """A waiting order: the stops counted when it came, and its size."""

    order: T
    stops: int
    since: Stops
    size: int


class Waiting(Generic[T]):
    """Pending orders of one client: at most `most`, of `largest` bytes; for one event loop."""

    def __init__(self, client: Client, most: int, largest: float = math.inf) -> None:
        self._client, self._largest = client, largest
        self._queue: asyncio.Queue[Entry[T] | None] = asyncio.Queue(most)
        self._size = 0
        self._working = False
        self.rested = time.monotonic()  # until when the client waited for us

    @property
    def busy(self) -> bool:
        return self._working or not self._queue.empty()

    def _entry(self, order: T, size: int) -> Entry[T]:
        return Entry(order, self._client.stops, self._client.station.stops, size)

    async def put(self, order: T, size: int = 0) -> None:
        """Queue an order once there is room."""
        while self._size and self._size + size > self._largest:
            await asyncio.sleep(POLL_S)
        self._size += size
        await self._queue.put(self._entry(order, size))

    def offer(self, order: T) -> bool:
        """Queue an order; False if there is no room."""
        if self._queue.full():
            return False
        self._queue.put_nowait(self._entry(order, 0))
        return True

    async def end(self) -> None:
        """Accept nothing more: `work` returns once all is done."""
        await self._queue.put(None)

    def drop(self) -> list[T]:
        """Remove all waiting orders."""
        found = [self._queue.get_nowait() for _ in range(self._queue.qsize())]
        dropped = [entry for entry in found if entry is not None]
        if len(dropped) < len(found):
            self._queue.put_nowait(None)
        self._size -= sum(entry.size for entry in dropped)
        return [entry.order for entry in dropped]

    async def work(self, do: Callable[[Entry[T]], Awaitable[bool]]) -> None:
        """Do the orders in turn until `do` returns False or the `end`."""
        while True:
            if self._working and self._queue.empty():
                self._working, self.rested = False, time.monotonic()
            entry = await self._queue.get()
            if entry is None:
                return
            self._working = True
            self._size -= entry.size
            if not await do(entry):
                return


class Beating(Protocol):
    """A connection with a heartbeat."""

    def beat(self) -> None: ...


class Dispatcher:
    """Runs the calls of a server's clients on threads, so that none delays a stop."""

    def __init__(
        self, name: str, clients: int, silent: int, crowd: int = 1, *, yielding: bool = False
    ) -> None:
        self.capacity = Capacity(clients, silent, yielding=yielding)
        self._crowd = crowd
        self._orders = ThreadPoolExecutor(clients + SPARE, f"{name}-orders")
        self._urgent = ThreadPoolExecutor(clients + SPARE, f"{name}-stops")
        self._others = ThreadPoolExecutor(OTHERS, f"{name}-others")
        self._beats = ThreadPoolExecutor(1, f"{name}-beats")

    async def run(self, client: Client, act: Callable[..., T], *given: object) -> T:
        """Run a call that may block; clients without permission to command share a few threads."""
        pool = self._orders if client.rank >= _capacity.ADMITTED else self._others
        return await _in(pool, client, act, given)

    async def overtake(self, client: Client, act: Callable[..., T], *given: object) -> T:
        """Run a stop, for which a thread is always free."""
        return await _in(self._urgent, client, act, given)

    async def beat(self, connections: Iterable[Beating]) -> None:
        """Send the heartbeats; to be called periodically."""
        loop = asyncio.get_running_loop()
        await loop.run_in_executor(self._beats, _beat, tuple(connections))

    def price(self, client: Client) -> float:
        """Cost factor of a client: higher in a crowd, if it may not command."""
        if client.rank >= _capacity.ADMITTED:
            return 1.0
        return max(1.0, self.capacity.crowd / self._crowd)

    def close(self) -> None:
        for pool in (self._orders, self._urgent, self._others, self._beats):
            pool.shutdown(wait=False, cancel_futures=True)


async def _in(
    pool: ThreadPoolExecutor, client: Client, act: Callable[..., T], given: tuple[object, ...]
) -> T:
    future = pool.submit(act, *given)
    client.calls.add(future)
    future.add_done_callback(client.calls.discard)
    return await asyncio.wrap_future(future)


def _beat(connections: tuple[Beating, ...]) -> None:
    for connection in connections:
        with contextlib.suppress(Exception):  # one client's trouble is not the others'
            connection.beat()
