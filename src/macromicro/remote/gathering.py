"""Moves of two axes of one machine that are asked for together: one motion of both."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import NamedTuple
from weakref import WeakKeyDictionary

from macromicro.control.live.messages import AXES
from macromicro.errors import MacromicroError
from macromicro.remote.machine import Machine, Motion

GATHER_S = 0.05  # in which a scan that sets both at once has asked for both
POLL_S = 0.02


class _Part(NamedTuple):
    """What is asked of one axis: where to, m, and what raises the reason where it is wanted no
    more.
    """

    goal: float
    check: Callable[[], None]


class _Batch:
    """Moves that are gathered, and the motion that they became."""

    def __init__(self) -> None:
        self.parts: dict[str, _Part] = {}
        self.done = threading.Event()
        self.motion: Motion | None = None
        self.failures: dict[str, BaseException] = {}


class Gathering:
    """Moves of the axes of a machine of two, from any threads.

    Parameters
    ----------
    machine : Machine
        What they are sent to.
    """

    def __init__(self, machine: Machine) -> None:
        self.lock = threading.Lock()  # behind a stop that holds it nothing begins
        self._machine = machine
        self._batch: _Batch | None = None

    def begin(self, axis: str, goal: float, check: Callable[[], None]) -> Motion:
        """Begin a move once nothing else moves; with one of the other axis that is asked for
        meanwhile or within `GATHER_S`, both go at once, on a straight line.

        Parameters
        ----------
        axis : str
            "x" or "y".
        goal : float
            m.
        check : Callable[[], None]
            Raises the reason where the move is not wanted any more.

        Returns
        -------
        Motion
            Of this axis, or of both.

        Raises
        ------
        BaseException
            What `check` raises, and the client where the machine refuses.
        """
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
        """Begin what was gathered, unless something moves; True once that has an outcome."""
        with self.lock:
            parts = dict(batch.parts)
            try:
                moving = self._machine.state.motion  # before the checks, as the answer takes time
                for axis, part in parts.items():
                    try:
                        part.check()
                    except MacromicroError as error:
                        batch.failures[axis] = error
                wanted = {a: p.goal for a, p in parts.items() if a not in batch.failures}
                if wanted and moving:
                    return False
                if len(wanted) == len(AXES):
                    goals = (wanted[axis] for axis in AXES)
                    batch.motion = self._machine.move_point(*goals, wait=False)
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
    """What gathers the moves of a machine.

    Parameters
    ----------
    machine : Machine
        The machine.

    Returns
    -------
    Gathering
        The same one for all who share the machine.
    """
    with _MAKING:
        found = _OF.get(machine)
        if found is None:
            found = _OF[machine] = Gathering(machine)
        return found
