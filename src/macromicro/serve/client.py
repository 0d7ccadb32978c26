"""A client of any protocol: admission, orders in turn, priority stops, loss of the client."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Awaitable, Callable
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Refused, Reply
from macromicro.serve._background import in_thread
from macromicro.serve._instrument import Instrument
from macromicro.serve._sending import Stops
from macromicro.serve.hosts import is_loopback
from macromicro.serve.requests import OVERTAKEN

# Who takes whose place: a higher rank that of the oldest one of the lowest.
REMOTE, LOCAL, ADMITTED, HOLDER = range(4)
OTHERS = 2  # threads for all clients that may not command
GONE = Refused("the client is gone", "connect again")
T = TypeVar("T")


class Ranked(Protocol):
    @property
    def rank(self) -> int:
        """REMOTE, LOCAL (this computer), ADMITTED (may command) or HOLDER (of control)."""


class Member(Ranked, Protocol):
    """A connection, as its capacity needs it."""

    @property
    def heard(self) -> float:
        """When it was last heard, monotonic."""

    def dismiss(self) -> None:
        """Disconnect: another client takes its place."""


class Capacity:
    """Places for `most` active and `silent` silent connections; `yielding` ones make room.

    Beyond `crowd` of them, clients that may not command pay more, and share a few threads.
    """

    def __init__(self, most: int, silent: int, crowd: int = 1, *, yielding: bool = False) -> None:
        self._most, self._silent, self._yielding = most, silent, yielding
        self._crowd = crowd
        self._arrived: list[Member] = []
        self._members: list[Member] = []
        self._others = asyncio.Semaphore(OTHERS)

    @property
    def crowd(self) -> int:
        """Number of members that may not command."""
        return len(self._arrived) + sum(each.rank < ADMITTED for each in self._members)

    def arrive(self, member: Member) -> None:
        """Add a connection that has yet to speak; if there are too many, the oldest leaves."""
        if len(self._arrived) >= self._silent:
            self._arrived.pop(0).dismiss()
        self._arrived.append(member)

    def claim(self, member: Member, instead: object = None) -> bool:
        """Take a place for a connection that has spoken, `instead` of its old one."""
        self._arrived = [each for each in self._arrived if each is not member]
        members = [each for each in self._members if each is not instead]
        if len(members) >= self._most:
            lowest = min(members, key=self._order)
            yields = self._yielding and lowest.rank < ADMITTED
            if lowest.rank > member.rank or (lowest.rank == member.rank and not yields):
                return False
            members.remove(lowest)
            lowest.dismiss()
        self._members = [*members, member]
        return True

    def leave(self, member: Member) -> None:
        self._arrived = [each for each in self._arrived if each is not member]
        self._members = [each for each in self._members if each is not member]

    def _order(self, member: Member) -> tuple[int, float]:
        """Within a rank, by arrival or by the last sign of life."""
        return member.rank, member.heard if self._yielding else 0.0

    def price(self, client: Ranked) -> float:
        """Cost factor of a client: higher in a crowd, if it may not command."""
        if client.rank >= ADMITTED:
            return 1.0
        return max(1.0, self.crowd / self._crowd)

    async def in_thread(self, client: Ranked, act: Callable[..., T], *given: object) -> T:
        """Run what may block on a thread."""
        if client.rank >= ADMITTED:
            return await in_thread(act, *given)
        async with self._others:
            return await in_thread(act, *given)


def without_address(address: str) -> int:
    return LOCAL if is_loopback(address) else REMOTE


class Client:
    """One client of the station; `stop` and `emergency` overtake its orders."""

    def __init__(
        self,
        instrument: Instrument,
        name: str,
        address: str = "127.0.0.1",
        capacity: Capacity | None = None,
    ) -> None:
        self.instrument, self.station = instrument, instrument.station
        self.name, self.address = name, address
        self.capacity = capacity or Capacity(1, 1)
        self.authenticated = instrument.token.open
        self.failures = 0  # wrong tokens
        self.watchdog = 0.0
        self.stops = 0  # its own, so far
        self.gone = False

    # Who it is

    @property
    def rank(self) -> int:
        if self.station.holder == self.name:
            return HOLDER
        if self.authenticated and not self.instrument.token.open:
            return ADMITTED
        return without_address(self.address)

    @property
    def price(self) -> float:
        """Cost factor of what it sends."""
        return self.capacity.price(self)

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
        if not self.gone:
            self.gone = True
            self.station.disconnect(self.name)

    def beat(self, silence: float) -> bool:
        """Report a sign of life after `silence` seconds; False once the watchdog has expired."""
        if self.gone:
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

    # What it orders

    def take(self) -> Reply:
        """Ask for control."""
        return GONE if self.gone else self.station.acquire(self.name)

    async def request(self, request: m.Request, entry: Entry[Any] | None = None) -> Reply:
        """Pass a request on, unless a stop has come since `entry`."""
        if entry is not None and entry.stops != self.stops:
            return OVERTAKEN
        since = None if entry is None else entry.since
        return await self.station.order(self.name, request._replace(client=self.name), since)

    async def command(self, request: m.Request, entry: Entry[Any] | None = None) -> Reply:
        """Pass a request on, taking control if it is free."""
        reply: Reply = m.Accepted() if self.station.holder == self.name else self.take()
        return reply if isinstance(reply, Refused) else await self.request(request, entry)

    async def in_thread(self, act: Callable[..., T], *given: object) -> T:
        """Run for it what may block."""
        return await self.capacity.in_thread(self, act, *given)

    async def stop(self) -> Reply:
        """Decelerate at once; an order that is on its way comes before it or is refused."""
        self.stops += 1
        return await self.station.order(self.name, m.Stop(self.name))

    async def emergency(self) -> float:
        """Emergency stop at once: seconds until the outputs were safe, NaN without an answer."""
        self.stops += 1
        return await self.station.emergency_stop(self.name)


class Entry(NamedTuple, Generic[T]):
    """A waiting order: the stops counted when it came, and its size."""

    order: T
    stops: int
    since: Stops
    size: int


class Waiting(Generic[T]):
    """Pending orders of one client: at most `most`, of `largest` bytes."""

    def __init__(self, client: Client, most: int, largest: float = math.inf) -> None:
        self._client, self._largest = client, largest
        self._queue: asyncio.Queue[Entry[T] | None] = asyncio.Queue(most)
        self._size = 0
        self._less = asyncio.Event()
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
            self._less.clear()
            await self._less.wait()
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
        self._take(sum(entry.size for entry in dropped))
        return [entry.order for entry in dropped]

    def _take(self, size: int) -> None:
        self._size -= size
        self._less.set()

    async def work(self, do: Callable[[Entry[T]], Awaitable[bool]]) -> None:
        """Do the orders in turn until `do` returns False or the `end`."""
        while True:
            if self._working and self._queue.empty():
                self._working, self.rested = False, time.monotonic()
            entry = await self._queue.get()
            if entry is None:
                return
            self._working = True
            self._take(entry.size)
            if not await do(entry):
                return
