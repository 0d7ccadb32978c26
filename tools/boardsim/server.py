"""The simulated board at a pseudo-terminal, for a host in another process.

When the host closes the port, or is killed, time goes on without it for a while.
"""

from __future__ import annotations

import os
import select
import tty
from pathlib import Path

from boardsim.wire import Wire

ALONE = 2_000  # periods that pass when the host has gone
_LOOK = 0.02  # s between looks at the line


class Server:
    """A wire whose other end is a pseudo-terminal.

    Parameters
    ----------
    wire : Wire
        The line to the board.
    """

    def __init__(self, wire: Wire) -> None:
        self.wire = wire
        self._master, slave = os.openpty()
        tty.setraw(slave)
        self.name = os.ttyname(slave)
        os.close(slave)
        self.attached = False

    def serve(self, until: Path | None = None, alone: Path | None = None) -> None:
        """Go on until a file exists.

        Parameters
        ----------
        until : Path | None, optional
            It; None: forever.
        alone : Path | None, optional
            File to write when a host has gone and time has passed without it.
        """
        while until is None or not until.exists():
            if self._look() and alone is not None:
                alone.touch()

    def _look(self) -> bool:
        """Take what has come; whether the host has gone, and time has passed without it."""
        poll = select.poll()
        poll.register(self._master, select.POLLIN)
        events = poll.poll(1e3 * _LOOK)
        state = events[0][1] if events else 0
        gone = bool(state & select.POLLHUP)
        data = b""
        if state & select.POLLIN:
            try:
                data = os.read(self._master, 65536)
            except OSError:  # nobody has it open
                gone = True
        if data:
            self.attached = True
            self.wire.write(data)
            shown = self.wire.read(self.wire.in_waiting)
            if shown:
                os.write(self._master, shown)
        elif gone:
            left, self.attached = self.attached, False
            if left:
                self.wire.alone(ALONE)
                self.wire.read(self.wire.in_waiting)
                return True
            select.select([], [], [], _LOOK)
        return False
