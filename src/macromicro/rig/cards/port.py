"""What a card's library must do for a rig."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from macromicro.errors import MacromicroError
from macromicro.rig.cards.wiring import Terminal


class CardError(MacromicroError):
    """The card, its driver or its library failed; the message names the terminal."""


class Port(Protocol):
    """An opened card. Terminals are given once, values in their order from then on."""

    def open(self, device: str) -> None:
        """Open the device.

        Parameters
        ----------
        device : str
            Its name.

        Raises
        ------
        CardError
            Library or device is missing.
        """

    def connect(self, inputs: Sequence[Terminal], outputs: Sequence[Terminal]) -> None:
        """Take the terminals, and check that the device has them.

        Parameters
        ----------
        inputs, outputs : Sequence[Terminal]
            Of the wiring.

        Raises
        ------
        InputError
            The device has no such terminal.
        CardError
            The driver refused it.
        """

    def counts(self, terminal: Terminal) -> int:
        """How many readings a counter has before it begins again.

        Parameters
        ----------
        terminal : Terminal
            An input.

        Returns
        -------
        int
            2**24 for one of 24 bits.
        """

    def read(self) -> Sequence[float]:
        """All inputs now.

        Returns
        -------
        Sequence[float]
            V, NaN beyond the range; readings of counters; 0 or 1.

        Raises
        ------
        CardError
            The driver refused it.
        """

    def write(self, values: Sequence[float]) -> None:
        """Set all outputs.

        Parameters
        ----------
        values : Sequence[float]
            V, cut at the range; 0 or 1.

        Raises
        ------
        CardError
            The driver refused one; the others are set.
        """

    def close(self) -> None:
        """Close the device; nothing happens where it is not open."""
