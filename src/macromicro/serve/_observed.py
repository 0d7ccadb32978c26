"""Read-only access to the machine."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from macromicro.control.live.messages import MODES, Event, Finished
from macromicro.serve import _watching
from macromicro.serve._captures import Captures
from macromicro.serve._holders import Holders
from macromicro.serve._in_force import InForce
from macromicro.serve._loop_connection import LoopConnection
from macromicro.serve._recording import Recordings
from macromicro.serve.choosing import AnySettings
from macromicro.serve.shared import BINS
from macromicro.serve.snapshot import Snapshot


class Observed:
    """The read-only half of a `Station`; thread-safe."""

    def __init__(
        self, rig: str, seed: int, settings: AnySettings, state: Path | None, machine: str
    ) -> None:
        self.settings, self.rig = settings, rig
        serve = settings.serve
        self._holders = Holders(serve.client_timeout)
        self._connection = LoopConnection(rig, seed, settings, state, machine)
        attributes: dict[str, str | int | float] = {"rig": rig, "seed": seed}
        attributes["modes"] = ", ".join(MODES)
        self._names = settings.telemetry.names
        self._recordings = Recordings(self._connection, settings, attributes)
        self.captures = Captures(self._connection, settings)

    @property
    def holder(self) -> str:
        return self._holders.holder

    @property
    def stages(self) -> tuple[str, ...]:
        return self._connection.stages

    @property
    def channels(self) -> tuple[str, ...]:
        return self._connection.channels

    @property
    def in_force(self) -> InForce:
        """Gains and speed limits in force."""
        return self._connection.ledger.in_force

    def snapshot(self) -> Snapshot:
        connection = self._connection
        return _watching.snapshot(
            connection.shared,
            connection.running,
            connection.trust,
            connection.switched_off,
            connection.trouble,
            self.settings,
            self._recordings.state,
            self._holders.holder,
            self._holders.clients,
        )

    def telemetry(self, since: int = -1) -> tuple[int, NDArray[np.float64], Sequence[str]]:
        """Telemetry after row `since`: (number of the last row, float64[columns, rows], names)."""
        shared, names = self._connection.shared, self._names
        if shared is None:
            return -1, np.empty((len(names), 0)), names
        _, count, block = shared.since(since + 1)
        return count - 1, block, names

    def timing(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Histograms of lateness and computing time: int64[bins] of 1 us, the last one open."""
        shared = self._connection.shared
        counts = np.zeros((2, BINS), np.int64) if shared is None else shared.histograms.copy()
        return counts[0], counts[1]

    def events(self, since: int = -1) -> tuple[int, list[Event]]:
        """Events after number `since`: (number of the last one, events)."""
        return self._connection.ledger.events(since)

    def finished(self, motion: int, timeout: float | None = None) -> Finished | None:
        """How a motion ended, waiting up to `timeout`; None while it is under way or unknown.

        Within the event loop only with a timeout of 0.
        """
        ledger = self._connection.ledger
        return ledger.finished(motion) if timeout == 0.0 else ledger.awaited(motion, timeout)

    async def news(self) -> None:
        """Wait for the next event, end of a motion or client that leaves."""
        await self._connection.ledger.news()
