"""A machine in a process of its own, as real ones are: it goes on when the program is killed.

A rig of it for ``--rig far_machine:held`` (a card that holds its last voltage) and
``far_machine:watched`` (an amplifier with a watchdog). The machine's memory is the file that the
environment variable FAR_MACHINE names: volts, counts, the program's last sign of life.
"""

from __future__ import annotations

import math
import mmap
import os
import struct
import sys
import time

from macromicro.rig.cards.clock import Deadlines
from macromicro.types import SAFE, Sample

_CELLS = struct.Struct("ddd")
WATCHDOG_S = 0.03


def memory(path: str) -> mmap.mmap:
    with open(path, "r+b") as file:
        return mmap.mmap(file.fileno(), _CELLS.size)


def machine(path: str, watchdog: float) -> None:
    """1000 counts/s for each volt beyond 1 V, until its parent is gone or the file says nan."""
    cells, parent = memory(path), os.getppid()
    place, then = 500.0, time.monotonic()
    while os.getppid() == parent:
        volts, _, alive = _CELLS.unpack(cells[:])
        if math.isnan(volts):
            return
        now = time.monotonic()
        if now - alive > watchdog:
            volts = 0.0
        place += math.copysign(max(abs(volts) - 1.0, 0.0), volts) * 1000.0 * (now - then)
        then = now
        cells[8:16] = struct.pack("d", math.floor(place))
        time.sleep(5e-4)


class Rig:
    channels = ("encoder",)
    counted = True

    def __init__(self, sign: float = 1.0) -> None:
        self.clock, self.cells = Deadlines(), memory(os.environ["FAR_MACHINE"])
        self.sign = sign

    def read(self) -> Sample:
        counts = struct.unpack("d", self.cells[8:16])[0]
        return Sample(self.clock.now(), counts, *[math.nan] * 4)

    def write(self, outputs: tuple[float, ...]) -> None:
        self.cells[16:24] = struct.pack("d", time.monotonic())
        self.cells[0:8] = struct.pack("d", self.sign * outputs[0])

    def stop(self) -> None:
        self.write(SAFE)

    def __enter__(self) -> Rig:
        self.stop()
        self.clock.start()
        return self

    def __exit__(self, *what: object) -> None:
        self.stop()


def bench(seed: int) -> Rig:
    return Rig()


def turned(seed: int) -> Rig:
    return Rig(-1.0)


if __name__ == "__main__":
    machine(sys.argv[1], float(sys.argv[2]))
