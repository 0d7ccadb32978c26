"""The machines that are broken: one or two of each kind."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import faulty
from macromicro.rig.opening import named
from macromicro.serve._launching import LIVE, Spec
from macromicro.serve._machine import Opened
from macromicro.serve.loop_process import open_machine
from macromicro.serve.settings import StageSettings, load

_EXAMPLES = Path(__file__).parents[2] / "examples" / "machines"
_SWITCHED = '\n[switches]\nlimits = "both"\nhome = "below"\n\n[homing]\non = "home"\n'
_STAGE = "faulty.stage:stage"
_AXES = "faulty.stage:x+faulty.stage:y"


class Subject(NamedTuple):
    """A machine: its file among the examples, more settings, and the rig that serves it."""

    file: str = ""
    more: str = ""
    rig: str = _STAGE

    def text(self) -> str:
        """The settings file."""
        if not self.file:
            return self.more
        # A vertical stage without a brake falls wherever it is off: no fault of a sensor.
        return (_EXAMPLES / self.file).read_text().replace('"90 deg"', '"0 deg"') + self.more


SUBJECTS: dict[str, Subject] = {
    "slide": Subject("printer.toml"),
    "slide-switches": Subject("screw.toml", _SWITCHED),
    "turn": Subject("disc.toml"),
    "piezo": Subject("piezo-100um.toml"),
    "wire": Subject("wire-150um.toml"),
    "two-axes": Subject("xy-plotter.toml", "", _AXES),
    # Homing at its normal pace would take half of the time.
    "two-stage": Subject("", '[live.homing]\nspeed = "600 count/s"\n', "faulty.bench:twin"),
}


class Made(NamedTuple):
    """A subject whose settings have been read. `board`: file of the board."""

    name: str
    settings: Any
    rig: str
    file: Path
    board: Path

    @property
    def environment(self) -> dict[str, str]:
        """What the rig's factory reads."""
        from faulty.stage import MACHINE

        return {faulty.BOARD: str(self.board), MACHINE: str(self.file)}

    @property
    def led(self) -> bool:
        """Whether a law holds it when it is ready, as all but the two-stage machine."""
        return isinstance(self.settings, StageSettings)

    def faults(self) -> tuple[str, ...]:
        """The faults that its rig can have."""
        with self._named():
            return faulty.possible(named(self.rig.partition("+")[0])(0))

    def open(self, seed: int = 0) -> Opened:
        """A new machine as the server's loop opens it, on a new rig."""
        spec = Spec(self.rig, seed, self.settings, "no position was saved", LIVE, 0)
        with self._named():
            return open_machine(spec)

    @contextlib.contextmanager
    def _named(self) -> Iterator[None]:
        """Its files in the environment, for as long as a factory reads them."""
        before = dict(os.environ)
        os.environ.update(self.environment)
        try:
            yield
        finally:
            os.environ.clear()
            os.environ.update(before)


def made(name: str, folder: Path) -> Made:
    """A subject with its file in a folder of its own."""
    subject = SUBJECTS[name]
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / "machine.toml"
    file.write_text(subject.text())
    return Made(name, load(file), subject.rig, file, folder / "board")
