"""Captures of signals around an event, made by the server at the loop's rate."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from macromicro.arrays import Array
from macromicro.columns import Column
from macromicro.errors import InputError
from macromicro.recording import Recording
from macromicro.serve.capturing import Captured, Trigger, csv

if TYPE_CHECKING:
    from macromicro.remote.asynchronous import AsyncMachine
    from macromicro.remote.machine import Machine

LOOK_S = 0.05  # s between looks at the server's capture
FORMATS = (".csv", ".h5")


@dataclass(frozen=True)
class Curves:
    """Captured signals. `time` is that from the trigger on.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.remote.capturing import Curves
    >>> curves = Curves(("position",), ("mm",), np.array([0.0, 1e-3]), np.array([[1.0, 1.5]]), 7.5)
    >>> curves["position"].tolist(), curves.units
    ([1.0, 1.5], ('mm',))
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    time: Array  # s, 0 at the trigger; shape (n,)
    values: Array  # shape (names, n)
    triggered: float  # when, by the machine's clock, s

    def __getitem__(self, name: str) -> Array:
        """The values of a signal, shape (n,); one of `names`."""
        if name not in self.names:
            raise InputError("curves", name, f"one of {', '.join(self.names)}")
        values: Array = self.values[self.names.index(name)]
        return values

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the curves to a file.

        Parameters
        ----------
        path : str | os.PathLike[str]
            A table (.csv), or a recording (.h5) that `Recording.load` reads; an existing file is
            replaced.

        Raises
        ------
        InputError
            Its name ends otherwise.
        """
        place = Path(path)
        if place.suffix not in FORMATS:
            raise InputError("path", str(path), f"a name that ends in {' or '.join(FORMATS)}")
        rows = np.vstack([self.time, self.values])
        names, units = ("t", *self.names), ("s", *self.units)
        if place.suffix == ".csv":
            place.write_text(csv(Captured(1, names, units, self.triggered, rows)), "utf-8")
            return
        columns = [Column(n, unit, "captured") for n, unit in zip(names, units, strict=True)]
        period = float(np.median(np.diff(self.time))) if len(self.time) > 1 else 1.0
        facts = {"triggered_s": self.triggered}
        Recording.from_arrays(columns, rows, period, facts).save(place, overwrite=True)


class AsyncCapture:
    """A capture that the server makes; `wait` gives its curves."""

    def __init__(self, machine: AsyncMachine) -> None:
        self._machine = machine
        self._seen = 0

    async def state(self) -> str:
        """Whether it waits for its trigger.

        Returns
        -------
        str
            "waiting", "triggered" or "complete".
        """
        found = await self._machine.link.order("captured", seen=2**31)
        return str(found["phase"])

    async def wait(self) -> Curves:
        """Wait for the next curves; of a repeated capture again and again.

        Returns
        -------
        Curves
            The captured signals.

        Raises
        ------
        RequestRefused
            Another capture of this client has taken its place and has ended.
        ConnectionLost
            The server no longer answers.
        """
        while True:
            found, data, _ = await self._machine.link.pieced("captured", seen=self._seen)
            if data:
                break
            await asyncio.sleep(LOOK_S)
        self._seen = found["captured"]
        names, units = tuple(found["names"]), tuple(found["units"])
        rows = np.frombuffer(data, "<f8").reshape(len(names), -1).astype(float)
        return Curves(names[1:], units[1:], rows[0], rows[1:], float(found["time_s"]))

    async def end(self) -> None:
        """Wait no longer, and drop what was captured."""
        await self._machine.link.order("end capture")


class Capture:
    """A capture that the server makes; `wait` gives its curves."""

    def __init__(self, machine: Machine, inner: AsyncCapture) -> None:
        self._machine, self._inner = machine, inner

    @property
    def state(self) -> str:
        """Whether it waits for its trigger: "waiting", "triggered" or "complete"."""
        return self._machine.run(self._inner.state())

    def wait(self, timeout: float | None = None) -> Curves:
        """Wait for the next curves; of a repeated capture again and again.

        Parameters
        ----------
        timeout : float | None, optional
            Longest wait, s; the capture goes on after it.

        Returns
        -------
        Curves
            The captured signals.

        Raises
        ------
        RequestRefused
            Another capture of this client has taken its place and has ended.
        ConnectionLost
            The server no longer answers.
        TimeoutError
            It is not complete.
        """
        return self._machine.run(asyncio.wait_for(self._inner.wait(), timeout))

    def end(self) -> None:
        """Wait no longer, and drop what was captured."""
        self._machine.run(self._inner.end())


def order(
    signals: str | Sequence[str], trigger: str | Trigger, before: float, after: float, repeat: bool
) -> dict[str, Any]:
    """The fields of an order that begins a capture."""
    names = [signals] if isinstance(signals, str) else list(signals)
    given = Trigger(trigger) if isinstance(trigger, str) else trigger
    words = {key: value for key, value in given._asdict().items() if value != ""}
    return {"signals": names, "trigger": words, "before": before, "after": after, "repeat": repeat}
