"""What every client needs, whatever it speaks: admission, orders in turn, stops that overtake,
and what becomes of the machine when it is gone. A protocol adds its framing and its words."""

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
from macromicro.serve import capacity
from macromicro.serve.capacity import Capacity
from macromicro.serve.instrument import Instrument
from macromicro.serve.requests import OVERTAKEN
from macromicro.serve.sending import Stops

POLL_S = 0.02
OTHERS = 2  # threads for all clients that may not command
SPARE = 8  # threads for clients that come and go
T = TypeVar("T")


class Client:
    """One client, known to the station as `name`, from `address`.

    What it orders may come from any thread, one order after the other; `stop` and `emergency`
    may come at the same time. `watchdog` [s]: silence after which it loses control though it
    is connected, 0 for never.
    """

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
        """Who makes room for whom."""
        if self.station.holder == self.name:
            return capacity.HOLDER
        if self.authenticated and not self.instrument.token.open:
            return capacity.ADMITTED
        return capacity.unadmitted(self.address)

    def authenticate(self, given: object) -> str:
        """Look at a token; why the client is not admitted, or "". One that gave the right one
        before is not kept out by others at its address."""
        problem = self.instrument.admission(
            given, self.name, self.address, known=self.authenticated
        )
        self.authenticated = not problem
        self.failures += bool(problem)
        return problem

    def connect(self) -> None:
        """The station lists it from now on."""
        self.station.connect(self.name)

    def close(self) -> None:
        """The client is gone. The station does to the machine what a lost client does."""
        if not self.gone.is_set():
            self.gone.set()
            self.station.disconnect(self.name)

    def beat(self, silence: float) -> bool:
        """Tell the station that this client lives, which was silent for so long [s]; False
        where its watchdog has run out, by which it loses control."""
        if self.gone.is_set():
            return True
        if not self.watchdog or silence <= self.watchdog:
            self.station.heartbeat(self.name)
        elif self.station.holder == self.name:
            self.lose()
            return False
        return True

    def lose(self) -> None:
        """It counts as lost, and watches from now on."""
        self.station.disconnect(self.name)
        self.station.connect(self.name)
        if self.gone.is_set():  # it went meanwhile
            self.station.disconnect(self.name)

    # What it orders

    def request(self, request: m.Request, entry: Entry[Any] | None = None) -> Reply:
        """Pass a request on. `entry`: as it waited; behind a stop that came since it is not
        done."""
        if entry is not None and entry.stops != self.stops:
            return OVERTAKEN
        since = None if entry is None else entry.since
        return self.station.request(self.name, request._replace(client=self.name), since)

    def stop(self) -> Reply:
        """Decelerate; waits for nothing. An order of this client that is on its way comes
        before it, or is refused because of it."""
        self.stops += 1
        return self.station.request(self.name, m.Stop(self.name))

    def emergency(self) -> float:
        """Emergency stop; waits for nothing. Seconds until the outputs were safe; NaN where no
        loop answers."""
        self.stops += 1
        return self.station.emergency(self.name)


class Entry(NamedTuple, Generic[T]):
    """An order that waits: the client's and the station's stops when it came, and its size."""

    order: T
    stops: int
    since: Stops
    size: int


class Waiting(Generic[T]):
    """What one client has ordered and is not done yet: at most `most` orders, of `largest`
    bytes altogether. Belongs to an event loop."""

    def __init__(self, client: Client, most: int, largest: float = math.inf) -> None:
        self._client, self._largest = client, largest
        self._queue: asyncio.Queue[Entry[T] | None] = asyncio.Queue(most)
        self._size = 0
        self._working = False
        self.rested = time.monotonic()  # until when the client waited for us

    @property
    def busy(self) -> bool:
        """Is something of this client's still to be done?"""
        return self._working or not self._queue.empty()

    def _entry(self, order: T, size: int) -> Entry[T]:
        return Entry(order, self._client.stops, self._client.station.stops, size)

    async def put(self, order: T, size: int = 0) -> None:
        """Let an order wait, once there is room for it."""
        while self._size and self._size + size > self._largest:
            await asyncio.sleep(POLL_S)
        self._size += size
        await self._queue.put(self._entry(order, size))

    def offer(self, order: T) -> bool:
        """Let an order wait; False where there is no room."""
        if self._queue.full():
            return False
        self._queue.put_nowait(self._entry(order, 0))
        return True

    async def end(self) -> None:
        """Nothing more comes: `work` returns once all is done."""
        await self._queue.put(None)

    def drop(self) -> list[T]:
        """Take out all that waits, but not the `end`."""
        found = [self._queue.get_nowait() for _ in range(self._queue.qsize())]
        dropped = [entry for entry in found if entry is not None]
        if len(dropped) < len(found):
            self._queue.put_nowait(None)
        self._size -= sum(entry.size for entry in dropped)
        return [entry.order for entry in dropped]

    async def work(self, do: Callable[[Entry[T]], Awaitable[bool]]) -> None:
        """One order after the other, until `do` returns False or the `end`."""
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
    """A connection, as the dispatcher needs it."""

    def beat(self) -> None:
        """Tell the station that its client lives, or not."""


class Dispatcher:
    """Where the calls of one server's clients run, so that none of them keeps a stop waiting,
    and who of them gets a place.

    `clients`: at a time, beside `silent` ones that have not spoken yet; `crowd`: of those that
    may not command, from which on they share what so many may use; `yielding`: see `Capacity`.
    """

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
        """Something that may take its time. Those who may not command have few threads, and
        leave the others their share of a processor."""
        pool = self._orders if client.rank >= capacity.ADMITTED else self._others
        return await _in(pool, client, act, given)

    async def overtake(self, client: Client, act: Callable[..., T], *given: object) -> T:
        """A stop: it finds a thread whatever else is being done."""
        return await _in(self._urgent, client, act, given)

    async def beat(self, connections: Iterable[Beating]) -> None:
        """Tell the station who lives; to be called now and then."""
        loop = asyncio.get_running_loop()
        await loop.run_in_executor(self._beats, _beat, tuple(connections))

    def price(self, client: Client) -> float:
        """What everything costs a client: more in a crowd, where it may not command."""
        if client.rank >= capacity.ADMITTED:
            return 1.0
        return max(1.0, self.capacity.crowd / self._crowd)

    def close(self) -> None:
        """Nothing more is begun."""
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
