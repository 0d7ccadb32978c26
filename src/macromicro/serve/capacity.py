"""Room for clients: those who may command are not kept out by those who may not."""

from __future__ import annotations

from typing import Protocol

from macromicro.serve.hosts import is_loopback

# Who takes whose place: a higher rank that of the oldest one of the lowest.
REMOTE, LOCAL, ADMITTED, HOLDER = range(4)


class Member(Protocol):
    """A connection, as its capacity needs it."""

    @property
    def rank(self) -> int:
        """REMOTE; LOCAL, of this computer; ADMITTED, may command; HOLDER of control."""

    @property
    def heard(self) -> float:
        """When it was heard of last [s, monotonic]."""

    def dismiss(self) -> None:
        """Its place is another one's now."""


class Capacity:
    """At most `most` that have spoken, and `silent` ones that have not.

    `yielding`: where all are taken, one that is not ADMITTED makes room for a newcomer of its
    own rank, too: the one that has been silent for the longest time.
    """

    def __init__(self, most: int, silent: int, *, yielding: bool = False) -> None:
        self._most, self._silent, self._yielding = most, silent, yielding
        self._arrived: list[Member] = []
        self._members: list[Member] = []

    @property
    def crowd(self) -> int:
        """How many there are that may not command."""
        return len(self._arrived) + sum(each.rank < ADMITTED for each in self._members)

    def arrive(self, member: Member) -> None:
        """One that has yet to speak; where there are too many, the oldest goes."""
        if len(self._arrived) >= self._silent:
            self._arrived.pop(0).dismiss()
        self._arrived.append(member)

    def claim(self, member: Member, instead: object = None) -> bool:
        """A place for one that has spoken, `instead` of its own old connection."""
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
        """It is gone."""
        self._arrived = [each for each in self._arrived if each is not member]
        self._members = [each for each in self._members if each is not member]

    def _order(self, member: Member) -> tuple[int, float]:
        """Of those of one rank the first is the one that came first, or was heard longest ago."""
        return member.rank, member.heard if self._yielding else 0.0


def unadmitted(address: str) -> int:
    """The rank of one that may not command."""
    return LOCAL if is_loopback(address) else REMOTE
