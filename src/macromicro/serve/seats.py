"""Places for clients: those who may command are not kept out by those who may not."""

from __future__ import annotations

from typing import Protocol

from macromicro.serve.hosts import is_loopback

# Who takes whose place: a higher rank that of the oldest one of the lowest.
STRANGER, NEIGHBOUR, ADMITTED, HOLDER = range(4)


class Guest(Protocol):
    """A connection, as the places need it."""

    @property
    def rank(self) -> int:
        """STRANGER; NEIGHBOUR, of this computer; ADMITTED, may command; HOLDER of control."""

    @property
    def heard(self) -> float:
        """When it was heard of last [s, monotonic]."""

    def dismiss(self) -> None:
        """Its place is another one's now."""


class Places:
    """At most `seats` that have spoken, and `silent` ones that have not.

    `yielding`: where all are taken, one that is not ADMITTED makes room for a newcomer of its
    own rank, too: the one that has been silent for the longest time.
    """

    def __init__(self, seats: int, silent: int, *, yielding: bool = False) -> None:
        self._seats, self._silent, self._yielding = seats, silent, yielding
        self._arrived: list[Guest] = []
        self._seated: list[Guest] = []

    @property
    def crowd(self) -> int:
        """How many there are that may not command."""
        return len(self._arrived) + sum(each.rank < ADMITTED for each in self._seated)

    def arrive(self, guest: Guest) -> None:
        """One that has yet to speak; where there are too many, the oldest goes."""
        if len(self._arrived) >= self._silent:
            self._arrived.pop(0).dismiss()
        self._arrived.append(guest)

    def claim(self, guest: Guest, instead: object = None) -> bool:
        """A place for one that has spoken, `instead` of its own old connection."""
        self._arrived = [each for each in self._arrived if each is not guest]
        seated = [each for each in self._seated if each is not instead]
        if len(seated) >= self._seats:
            lowest = min(seated, key=self._order)
            yields = self._yielding and lowest.rank < ADMITTED
            if lowest.rank > guest.rank or (lowest.rank == guest.rank and not yields):
                return False
            seated.remove(lowest)
            lowest.dismiss()
        self._seated = [*seated, guest]
        return True

    def leave(self, guest: Guest) -> None:
        """It is gone."""
        self._arrived = [each for each in self._arrived if each is not guest]
        self._seated = [each for each in self._seated if each is not guest]

    def _order(self, guest: Guest) -> tuple[int, float]:
        """Of those of one rank the first is the one that came first, or was heard longest ago."""
        return guest.rank, guest.heard if self._yielding else 0.0


def stranger(address: str) -> int:
    """The rank of one that may not command."""
    return NEIGHBOUR if is_loopback(address) else STRANGER
