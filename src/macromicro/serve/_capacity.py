"""Places for clients, with priority for those who may command."""

from __future__ import annotations

from typing import Protocol

from macromicro.serve.hosts import is_loopback

# Who takes whose place: a higher rank that of the oldest one of the lowest.
REMOTE, LOCAL, ADMITTED, HOLDER = range(4)


class Member(Protocol):
    """A connection, as its capacity needs it."""

    @property
    def rank(self) -> int:
        """REMOTE, LOCAL (this computer), ADMITTED (may command) or HOLDER (of control)."""

    @property
    def heard(self) -> float:
        """When it was last heard, monotonic."""

    def dismiss(self) -> None:
        """Disconnect: another client takes its place."""


class Capacity:
    """Places for `most` active and `silent` silent connections; `yielding` ones make room."""

    def __init__(self, most: int, silent: int, *, yielding: bool = False) -> None:
        self._most, self._silent, self._yielding = most, silent, yielding
        self._arrived: list[Member] = []
        self._members: list[Member] = []

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


def unadmitted(address: str) -> int:
    return LOCAL if is_loopback(address) else REMOTE
