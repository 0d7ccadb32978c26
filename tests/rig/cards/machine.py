"""The virtual bench behind a card's terminals, for the shims of the cards' libraries."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from macromicro.plant import bench
from macromicro.rig.cards._rig import Deadlines
from macromicro.rig.twin import CompiledTwin
from macromicro.settings import Settings
from macromicro.types import SAFE, Outputs, Sample

HERE = Path(__file__).parent
CC = shutil.which("cc")

needs_c = pytest.mark.skipif(CC is None, reason="no C compiler here: make compiler")


def library(name: str, folder: Path) -> ctypes.CDLL:
    """A shim, compiled."""
    made = folder / f"{name}.so"
    flags = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC")
    subprocess.run([CC or "cc", *flags, HERE / f"{name}.c", "-o", made], check=True)
    return ctypes.CDLL(str(made))


class Machine:
    """The bench, with voltages and lines for terminals; the loop's clock moves it."""

    def __init__(self) -> None:
        settings = Settings()
        self.twin = CompiledTwin(bench.prepare(settings.bench, settings.sensors), 3)
        self.outputs: dict[str, float] = dict.fromkeys(Outputs._fields, 0.0)
        self.written = 0

    def sample(self) -> Sample:
        return self.twin.read()

    def put(self, name: str, value: float) -> None:
        self.outputs[name] = value
        self.written += 1
        self.twin.write(Outputs(**self.outputs))

    def clock(self) -> type[Deadlines]:
        """A clock for the rig, in the bench's own time."""
        twin = self.twin

        class Own(Deadlines):
            def start(self) -> None: ...

            def now(self) -> float:
                return float(twin.clock.now())

            def wait(self, dt: float) -> None:
                twin.clock.wait(dt)

        return Own

    @property
    def safe(self) -> bool:
        """Whether all outputs are as `SAFE`, as far as a converter's bits go."""
        return all(abs(self.outputs[n] - v) < 2e-3 for n, v in SAFE._asdict().items())


def moved(rig: Any, volts: float, periods: int) -> list[Any]:
    """Samples of a rig whose motor is driven."""
    found = []
    for _ in range(periods):
        found.append(rig.read())
        rig.write(SAFE._replace(motor=volts))
        rig.clock.wait(1e-3)
    return found
