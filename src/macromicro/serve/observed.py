"""What anybody may see of the machine, and what it has reported."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from macromicro.control.live.messages import MODES, Event, Finished
from macromicro.serve import watching
from macromicro.serve.choosing import AnySettings
from macromicro.serve.holders import Holders
from macromicro.serve.loop_connection import LoopConnection
from macromicro.serve.recording import Recordings
from macromicro.serve.shared import BINS, shown
from macromicro.serve.snapshot import Snapshot


class Observed:
    """The half of a `Station` that moves nothing; thread-safe."""

    def __init__(
        self, rig: str, seed: int, settings: AnySettings, state: Path | None, machine: str
    ) -> None:
        self.settings, self.rig = settings, rig
        serve = settings.serve
        self._holders = Holders(serve.client_timeout)
        self._connection = LoopConnection(rig, seed, settings, state, machine)
        attributes: dict[str, str | int | float] = {"rig": rig, "seed": seed}
        attributes["modes"] = ", ".join(MODES)
        self._names = tuple(c.name for c in shown(settings.live.place, settings.law_columns)[0])
        self._recordings = Recordings(self._connection, settings, attributes)

    @property
    def holder(self) -> str:
        """The client that holds control, or ""."""
        return self._holders.holder

    @property
    def stages(self) -> tuple[str, ...]:
        """The stages that the rig has, of `messages.STAGES`."""
        return self._connection.stages

    @property
    def channels(self) -> tuple[str, ...]:
        """What the rig measures."""
        return self._connection.channels

    def snapshot(self) -> Snapshot:
        """The machine now."""
        connection = self._connection
        return watching.snapshot(
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
        """Rows of telemetry behind row number `since`: (number of the last one, block, names).

        The block is float64[columns, rows], one row a period, at most those of the last minute,
        or longer of a loop slower than 1 ms;
        pass the returned number as the next `since`. The names are those of
        `serve.shared.COLUMNS`, which has units and meaning too, and those of the law.
        """
        shared, names = self._connection.shared, self._names
        if shared is None:
            return -1, np.empty((len(names), 0)), names
        _, count, block = shared.since(since + 1)
        return count - 1, block, names

    def timing(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Periods since the start by how late they began, and by how long they took to
        compute: two histograms, int64[bins], bins of 1 us, the last one for all from 5 ms on."""
        shared = self._connection.shared
        counts = np.zeros((2, BINS), np.int64) if shared is None else shared.histograms.copy()
        return counts[0], counts[1]

    def events(self, since: int = -1) -> tuple[int, list[Event]]:
        """Events behind event number `since`: (number of the last one, events)."""
        return self._connection.ledger.events(since)

    def finished(self, motion: int, timeout: float | None = None) -> Finished | None:
        """How an accepted motion ended; waits for it up to `timeout` [s] (None: for ever).

        None where it is still under way, or no motion of that number was accepted.
        """
        return self._connection.ledger.finished(motion, timeout)
