"""Joins simultaneous moves of several stages into one motion."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

from macromicro.errors import MacromicroError
from macromicro.remote.machine import Machine, Motion

GATHER_S = 0.05  # s within which a scan that moves several stages has set them
POLL_S = 0.02


class _Part(NamedTuple):
    """A pending move of one axis; `wanted` raises the reason once it is void."""

    goal: float
    check: Callable[[], None]


class _Batch:
    """Gathered moves and their motion."""

    def __init__(self) -> None:
        self.parts: dict[str, _Part] = {}
        self.done = threading.Event()
        self.motion: Motion | None = None
        self.failures: dict[str, BaseException] = {}


class Gathering:
    """Moves of the stages of a machine of several, from any threads."""

    def __init__(self, machine: Machine) -> None:
        self.lock = threading.Lock()  # behind a stop that holds it nothing begins
        self._machine = machine
        self._batch: _Batch | None = None

    def begin(self, axis: str, goal: float, check: Callable[[], None]) -> Motion:
        """Begin a move once all rest, together with those of others within `GATHER_S`."""
        with self.lock:
            batch = self._batch
            first = batch is None or axis in batch.parts
            if batch is None or first:
                batch = self._batch = _Batch()
            batch.parts[axis] = _Part(goal, check)
        if first:
            time.sleep(GATHER_S)
            while not self._begun(batch):
                time.sleep(POLL_S)
        batch.done.wait()
        if axis in batch.failures:
            raise batch.failures[axis]
        assert batch.motion is not None
        return batch.motion

    def _begun(self, batch: _Batch) -> bool:
        """Begin the gathered moves unless something moves; True once there is an outcome."""
        with self.lock:
            parts = dict(batch.parts)
            try:
                moving = self._machine.state.motion  # before the checks, as the answer takes time
                for axis, part in parts.items():
                    try:
                        part.check()
                    except MacromicroError as error:
                        batch.failures[axis] = error
                well = {a: p for a, p in parts.items() if a not in batch.failures}
                wanted: dict[str, Any] = {a: p.goal for a, p in well.items()}
                if wanted and moving:
                    return False
                if len(wanted) > 1:
                    batch.motion = self._machine.move_point(**wanted, wait=False)
                for axis, goal in wanted.items() if len(wanted) == 1 else ():
                    batch.motion = self._machine.move_axis(axis, goal, wait=False)
            except BaseException as error:
                batch.failures |= dict.fromkeys(set(parts) - set(batch.failures), error)
            if self._batch is batch:
                self._batch = None
            batch.done.set()
            return True


_OF: WeakKeyDictionary[Machine, Gathering] = WeakKeyDictionary()
_MAKING = threading.Lock()


def of(machine: Machine) -> Gathering:
    with _MAKING:
        found = _OF.get(machine)
        if found is None:
            found = _OF[machine] = Gathering(machine)
        return found
