"""Reopens a failed rig once it answers again, for example after a cable was replugged."""

from __future__ import annotations

import threading
import time

from macromicro.serve._loop_connection import LoopConnection

FIRST_S, LONGEST_S = 1.0, 5.0  # between two tries
LASTED_S = 30.0  # a rig that ran for so long failed by something new


class Returning:
    """Background thread that reopens the rig; the loop then begins disabled and not homed."""

    def __init__(self, connection: LoopConnection) -> None:
        self._connection = connection
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        self._ended.clear()
        self._thread = threading.Thread(target=self._run, name="returning", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        self._ended.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def _run(self) -> None:
        pause, opened = FIRST_S, time.monotonic()
        while not self._ended.wait(pause):
            if self._connection.rig_failed:
                lasted = time.monotonic() - opened > LASTED_S
                pause = FIRST_S if lasted else min(2.0 * pause, LONGEST_S)
                self._connection.reopen()
                opened = time.monotonic()
