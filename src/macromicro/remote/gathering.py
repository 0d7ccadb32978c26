"""Joins simultaneous moves of several stages into one motion."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

from macromicro.errors import MacromicroError
from macromicro.remote.machine import Machine, Motion

GATHER_S = 0.05  # s within which a scan that moves several stages has set them
POLL_S = 0.02


class _Part(NamedTuple):
    """A pending move of one axis; `check` raises the reason once it is void."""

    goal: float
    check: Callable[[], None]
    begun: Future[Motion]


class Gathering:
    """Moves of the stages of a machine of several, from any threads."""

    def __init__(self, machine: Machine) -> None:
        self.lock = threading.Lock()  # behind a stop that holds it nothing begins
        self._machine = machine
        self._parts: dict[str, _Part] = {}  # by axis, of the moves that are being gathered

    def begin(self, axis: str, goal: float, check: Callable[[], None]) -> Motion:
        """Begin a move once all rest, together with those of others within `GATHER_S`."""
        part = _Part(goal, check, Future())
        with self.lock:
            first = not self._parts or axis in self._parts
            if first:
                self._parts = {}
            parts = self._parts
            parts[axis] = part
        if first:
            time.sleep(GATHER_S)
            while not self._begun(parts):
                time.sleep(POLL_S)
        return part.begun.result()

    def _begun(self, parts: dict[str, _Part]) -> bool:
        """Begin the gathered moves unless something moves; True once there is an outcome."""
        with self.lock:
            try:
                moving = self._machine.state.motion  # before the checks, as the answer takes time
                for axis, part in list(parts.items()):
                    try:
                        part.check()
                    except MacromicroError as error:
                        parts.pop(axis).begun.set_exception(error)
                if parts and moving:
                    return False
                goals: dict[str, Any] = {axis: part.goal for axis, part in parts.items()}
                if len(goals) > 1:
                    motion = self._machine.move_point(**goals, wait=False)
                elif goals:
                    motion = self._machine.move_axis(*goals.popitem(), wait=False)
                for part in parts.values():
                    part.begun.set_result(motion)
            except BaseException as error:
                for part in parts.values():
                    part.begun.set_exception(error)
            if self._parts is parts:
                self._parts = {}
            return True


_OF: WeakKeyDictionary[Machine, Gathering] = WeakKeyDictionary()
_MAKING = threading.Lock()


def of(machine: Machine) -> Gathering:
    with _MAKING:
        found = _OF.get(machine)
        if found is None:
            found = _OF[machine] = Gathering(machine)
        return found
