"""A machine that outlives its program, as real ones do: it goes on when the program is killed.

A rig of it for ``--rig far_machine:bench``. The machine is a file that the environment variable
FAR_MACHINE names: the voltage last written, when, at which place, and how long its amplifier's
watchdog lets that hold. Its place follows from them and from the time, so it does not matter how
busy the computer is.
"""

from __future__ import annotations

import math
import mmap
import os
import struct
import time
from pathlib import Path
from typing import NamedTuple

from macromicro.rig.cards._rig import Deadlines
from macromicro.types import SAFE, Sample

_CELLS = struct.Struct("dddd")


class Held(NamedTuple):
    """What the machine holds: 1000 counts/s for each volt beyond 1 V, until the watchdog ends."""

    volts: float
    since: float
    place: float
    watchdog: float

    def at(self, now: float) -> float:
        speed = math.copysign(max(abs(self.volts) - 1.0, 0.0), self.volts) * 1000.0
        return self.place + speed * (min(now, self.since + self.watchdog) - self.since)


def begin(path: Path, watchdog: float) -> None:
    """At 500 counts, without a voltage."""
    path.write_bytes(_CELLS.pack(*Held(0.0, 0.0, 500.0, watchdog)))


class Rig:
    channels = ("encoder",)
    counted = True

    def __init__(self, sign: float = 1.0) -> None:
        with open(os.environ["FAR_MACHINE"], "r+b") as file:
            self.cells = mmap.mmap(file.fileno(), _CELLS.size)
        self.clock, self.sign, self.began = Deadlines(), sign, time.monotonic()

    @property
    def held(self) -> Held:
        return Held(*_CELLS.unpack(self.cells[:]))

    def read(self) -> Sample:
        now = time.monotonic()
        return Sample(now - self.began, math.floor(self.held.at(now)), *[math.nan] * 4)

    def write(self, outputs: tuple[float, ...]) -> None:
        now = time.monotonic()
        self.cells[:] = _CELLS.pack(
            self.sign * outputs[0], now, self.held.at(now), self.held.watchdog
        )

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
