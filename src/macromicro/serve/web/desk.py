"""Who is connected, and how their orders reach the station: stops overtake everything."""

from __future__ import annotations

import asyncio
import secrets
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Protocol, TypeVar

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Refused, Reply
from macromicro.serve.web.uploads import Upload

if TYPE_CHECKING:
    from macromicro.serve.sending import Stops
    from macromicro.serve.station import Station

T = TypeVar("T")
GRACE_S = 10.0  # longest time for which a page that is gone may come back


class Line(Protocol):
    """A connection, as the desk needs it."""

    def flush(self) -> None:
        """Drop the orders that have not begun."""

    def leave(self) -> None:
        """Another connection has taken this one's place."""


class Seat:
    """A viewer's page through reloads. `key`: its secret; `client`: its name for the station;
    `admitted`: it gave the token; `jog`: stage that it jogs, with the time until which it said
    so, or None; `upload`: its own programme."""

    def __init__(self, client: str) -> None:
        self.key = secrets.token_urlsafe(24)
        self.client = client
        self.line: Line | None = None
        self.gone = 0.0
        self.admitted = False
        self.listed = False  # by the station, as a client
        self.listing = asyncio.Lock()
        self.jog: tuple[str, float] | None = None
        self.upload = Upload()


class Desk:
    """Seats by key, and two pools of threads: a stop never waits for a place in one."""

    def __init__(self, station: Station, viewers: int) -> None:
        self._station = station
        self._orders = ThreadPoolExecutor(viewers + 2, "web-orders")
        self._urgent = ThreadPoolExecutor(viewers + 2, "web-stops")
        self._seats: dict[str, Seat] = {}
        self._grace = min(station.settings.serve.client_timeout, GRACE_S)
        self._number = 0

    def find(self, key: object) -> Seat | None:
        """The seat of a page that comes back with its key."""
        return self._seats.get(key) if isinstance(key, str) else None

    def holds(self, seat: Seat | None) -> bool:
        """Does it hold control?"""
        return seat is not None and self._station.snapshot().holder == seat.client

    async def sit(self, key: object, address: str, line: Line) -> Seat:
        """The seat of a page that comes back with its key, else a new one; from now on the
        station lists it."""
        seat = self.find(key)
        if seat is None:
            self._number += 1
            seat = Seat(f"web {address} #{self._number}")
            self._seats[seat.key] = seat
        elif seat.line is not None:
            seat.line.leave()
        seat.line = line
        async with seat.listing:
            if not seat.listed:
                seat.listed = True
                await self.do(lambda: self._station.connect(seat.client))
        return seat

    def rise(self, seat: Seat, line: Line) -> bool:
        """The connection has ended; True if no other one has its seat already."""
        if seat.line is not line:
            return False
        seat.line, seat.gone = None, time.monotonic()
        return True

    async def clear(self, seat: Seat) -> None:
        """A page that is gone and holds nothing is no client any more; it may come back."""
        async with seat.listing:
            if seat.line is None and not self.holds(seat):
                await self._unlist(seat)

    async def tidy(self) -> None:
        """Tell the station of the pages that did not come back."""
        now = time.monotonic()
        for seat in list(self._seats.values()):
            if seat.line is None and now - seat.gone > self._grace:
                del self._seats[seat.key]
                async with seat.listing:
                    await self._unlist(seat)

    async def _unlist(self, seat: Seat) -> None:
        if seat.listed:
            seat.listed = False
            await self.do(lambda: self._station.disconnect(seat.client))

    async def do(self, what: Callable[[], T]) -> T:
        """Something that may take its time."""
        return await asyncio.get_running_loop().run_in_executor(self._orders, what)

    async def order(self, client: str, request: m.Request, since: Stops | None = None) -> Reply:
        """A request in its turn; refused where a stop came `since` the viewer asked for it."""
        loop = asyncio.get_running_loop()
        ask = self._station.request
        return await loop.run_in_executor(self._orders, ask, client, request, since)

    async def stop(self, client: str) -> Reply:
        """Stop now; what was asked for before and has not begun is refused."""
        return await self._overtake(lambda: self._station.request(client, m.Stop()))

    async def emergency(self, client: str) -> tuple[Reply, float]:
        """Emergency stop likewise; the reply, and the seconds that the loop took."""
        took = await self._overtake(lambda: self._station.emergency(client))
        if took != took:  # noqa: PLR0124 - NaN
            return Refused("the loop did not answer", "switch the machine's supply off"), took
        return Accepted(), took

    async def _overtake(self, action: Callable[[], T]) -> T:
        for seat in self._seats.values():
            if seat.line is not None:
                seat.line.flush()
        return await asyncio.get_running_loop().run_in_executor(self._urgent, action)

    def close(self) -> None:
        """All pages are gone."""
        for seat in self._seats.values():
            if seat.listed:
                self._station.disconnect(seat.client)
        self._seats.clear()
        self._orders.shutdown(wait=False, cancel_futures=True)
        self._urgent.shutdown(wait=False, cancel_futures=True)
