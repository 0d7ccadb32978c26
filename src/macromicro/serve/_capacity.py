"""The clients of one server: places, prices and threads, with priority for who may command."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Protocol, TypeVar

from macromicro.serve._background import in_thread
from macromicro.serve.hosts import is_loopback

# Who takes whose place: a higher rank that of the oldest one of the lowest.
REMOTE, LOCAL, ADMITTED, HOLDER = range(4)
OTHERS = 2  # threads for all clients that may not command
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


def unadmitted(address: str) -> int:
    return LOCAL if is_loopback(address) else REMOTE
