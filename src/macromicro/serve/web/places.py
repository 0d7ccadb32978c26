"""Places for viewers: those who may command are not kept out by those who may not."""

from __future__ import annotations

from typing import Protocol

# Who takes whose place: a higher rank that of the oldest one of the lowest.
STRANGER, NEIGHBOUR, ADMITTED, HOLDER = range(4)


class Guest(Protocol):
    """A connection, as the places need it."""

    @property
    def rank(self) -> int:
        """STRANGER; NEIGHBOUR, of this computer; ADMITTED, may command; HOLDER of control."""

    def dismiss(self) -> None:
        """Its place is another one's now."""


class Places:
    """At most `viewers` that have said hello, and `silent` ones that have not."""

    def __init__(self, viewers: int, silent: int) -> None:
        self._viewers, self._silent = viewers, silent
        self._arrived: list[Guest] = []
        self._seated: list[Guest] = []

    def arrive(self, guest: Guest) -> None:
        """One that has yet to say hello; where there are too many, the oldest goes."""
        if len(self._arrived) >= self._silent:
            self._arrived.pop(0).dismiss()
        self._arrived.append(guest)

    def claim(self, guest: Guest, instead: object = None) -> bool:
        """A place for one that has said hello, `instead` of its own old connection."""
        self._arrived = [each for each in self._arrived if each is not guest]
        seated = [each for each in self._seated if each is not instead]
        if len(seated) >= self._viewers:
            lowest = min(seated, key=lambda each: each.rank)  # the oldest of them
            if lowest.rank >= guest.rank:
                return False
            seated.remove(lowest)
            lowest.dismiss()
        self._seated = [*seated, guest]
        return True

    def leave(self, guest: Guest) -> None:
        """It is gone."""
        self._arrived = [each for each in self._arrived if each is not guest]
        self._seated = [each for each in self._seated if each is not guest]
