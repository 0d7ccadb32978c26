"""The interface to a card's library."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from macromicro.errors import MacromicroError
from macromicro.rig.cards._wiring import Terminal


class CardError(MacromicroError):
    """The card, its driver or its library failed."""


class Port(Protocol):
    """An opened card; values in the order of the connected terminals."""

    def open(self, device: str) -> None: ...

    def connect(self, inputs: Sequence[Terminal], outputs: Sequence[Terminal]) -> None:
        """Take the terminals and check them."""

    def counts(self, terminal: Terminal) -> int:
        """Range of a counter."""

    def read(self) -> Sequence[float]: ...

    def write(self, values: Sequence[float]) -> None: ...

    def close(self) -> None:
        """Close the device, if it is open."""
