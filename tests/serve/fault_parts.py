"""The real station on the twin with faults: what is injected, what came of it, in how long."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import faulty
from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Refused
from macromicro.control.settings import Control
from macromicro.recording import Recording
from macromicro.serve import persist
from macromicro.serve.persist import Kept
from macromicro.serve.settings import LiveSettings
from macromicro.serve.snapshot import Trouble
from macromicro.serve.station import Station
from tests.waiting import until

RIG = "faulty.bench:twin"
CLIENT = "test"
TABLE = "MACROMICRO_FAULT_TABLE"  # names a file that takes a line of JSON for each fault
OUTPUTS = ("motor", "ctrl", "fan")


def trusted(path: Path) -> None:
    """A position file of a machine that was homed and left at count 0."""
    persist.save(path, Kept(LiveSettings().kept_as(RIG), 0.0, 0.0, True, "homed", False, 0.0))


def note(name: str, milliseconds: float, did: str, told: str) -> None:
    """A line for the table of docs/validation/reliability.md, where one is wanted."""
    if path := os.environ.get(TABLE):
        with open(path, "a", encoding="utf-8") as file:
            line = {"fault": name, "ms": milliseconds, "did": did, "told": told}
            file.write(json.dumps(line) + "\n")


class Safety(NamedTuple):
    """`milliseconds` (control periods) from the fault's first sample to the first period from
    which on all outputs were safe; `rows` recorded before that sample; `travel` [mm] of the
    carriage after it until now, bench truth."""

    milliseconds: int
    rows: int
    travel: float


class Scene:
    """A station on the faulty twin: homed, enabled, recorded."""

    def __init__(
        self,
        folder: Path,
        live: dict[str, Any] | None = None,
        controller: Control | None = None,
        **serve: Any,
    ) -> None:
        self.folder = folder
        self.cells = faulty.board(os.environ[faulty.BOARD])
        settings = LiveSettings()
        # Machines that run tests are busy: nothing stops for lateness unless a test says so.
        quiet = {"miss_share": 1.0, "parent_timeout": 5.0, "loop_timeout": 5.0}
        serve = {**quiet, "client_timeout": 60.0, **serve}
        settings = settings._replace(
            serve=settings.serve._replace(**serve),
            live=settings.live._replace(**(live or {})),
            controller=controller or settings.controller,
        )
        self.station = Station(RIG, settings=settings, state=folder / "position.json")
        self.file = folder / "run.h5"

    def start(self) -> None:
        trusted(self.folder / "position.json")
        self.station.start()
        self.station.record(self.file)
        self.station.acquire(CLIENT)
        self.ask(m.Enable())

    def ask(self, request: m.Request) -> int:
        reply = self.station.request(CLIENT, request)
        assert isinstance(reply, Accepted), reply
        return reply.id

    def end(self, motion: int, patience: float = 60.0) -> m.Finished:
        finished = self.station.finished(motion, patience)
        assert finished is not None
        return finished

    def inject(self, name: str) -> None:
        faulty.inject(self.cells, name)
        if name != faulty.NONE:
            until(lambda: math.isfinite(self.cells[faulty.ONSET]))

    def fault(self) -> Trouble:
        found = until(lambda: self.station.snapshot().fault)
        assert isinstance(found, Trouble)
        return found

    def run(self) -> Recording:
        """The recording up to now, complete: one row a period, none lost."""
        state = self.station.end_recording()
        assert (state.error, state.lost) == ("", 0)
        return Recording.load(self.file)

    def safety(self, run: Recording) -> Safety:
        """When the outputs were safe, by the recording; and that it holds all before."""
        onset = float(self.cells[faulty.ONSET])
        before = round((onset - run["t"][0]) * 1e3)
        assert 0 < before < run.rows
        periods = np.round(run["t"][:before] * 1e3)
        assert np.array_equal(np.diff(periods), np.ones(before - 1))
        on = np.flatnonzero(np.any([run[name] != 0.0 for name in OUTPUTS], axis=0))
        last = int(on[-1]) if len(on) else -1
        travel = 1e3 * abs(float(self.cells[faulty.CARRIAGE] - self.cells[faulty.FROM]))
        return Safety(max(last + 1 - before, 0), before, travel)

    def latched(self) -> None:
        """The fault stays although its cause is gone, and is cleared on demand only."""
        self.inject(faulty.NONE)
        refused = self.station.request(CLIENT, m.MoveTo(0.02))
        assert isinstance(refused, Refused)
        assert "fault" in refused.reason
        assert (self.cells[faulty.MOTOR], self.cells[faulty.CTRL]) == (0.0, 0.0)
        self.ask(m.ClearFault())
        until(lambda: self.station.snapshot().fault is None)
        self.ask(m.Enable())
