"""A run of any machine into a folder: checked first, then run and measured."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from macromicro.drawing import files
from macromicro.machines import setups
from macromicro.recording import Recording, needed_bytes
from macromicro.rig.faults import Fault
from macromicro.rig.opening import TWIN
from macromicro.runs import folder
from macromicro.runs.setup import Progress, overridden
from macromicro.schema import keys


class Request(NamedTuple):
    # A file or an example's name; None for the usual one or a replayed recording's own moves
    programme: str | None = None
    out: Path | None = None  # folder of the results
    config: Path | None = None  # file of settings
    cycles: int = 1  # how often in a row
    fan: bool = False  # whether the fan cools the wires
    seed: int = 0  # seed of the sensor noise
    overwrite: bool = False  # whether files may be replaced
    rig: str = TWIN  # the twin, MODULE:FACTORY of a rig, or replay:FILE for its sensors
    figures: tuple[str, ...] = files.DEFAULT  # formats of the figures
    law: str | None = None  # instead of the one that the settings name


class Job(NamedTuple):
    """A checked request."""

    request: Request
    setup: Any  # `Setup`, with all cycles
    out: Path  # folder of the results
    overrides: dict[str, str]  # dotted path to text with unit
    source: Any = None  # what it runs on; None for the simulated machine

    @property
    def settings(self) -> Any:
        return self.setup.settings

    @property
    def programme(self) -> Any:
        return self.setup.programme

    @property
    def waits(self) -> bool:
        """Whether the run needs the compiled machine; on a rig its period runs interpreted."""
        return self.source is None and not self.setup.runs_interpreted()


class Ended(NamedTuple):
    job: Job  # what was run
    recording: Recording  # in the folder
    finished: bool  # whether the programme came to its end
    fault: Fault | None  # of the guard
    simulated: float  # time on the machine, s
    wall: float  # time that it took, s
    moves: list[Any]  # none of a stage that follows a trajectory
    # Of the two-stage machine.
    tracking: Sequence[Any] = ()  # how stages followed a trajectory
    vibration: Sequence[Any] = ()  # after the first cycle's macro moves
    cycles: Sequence[Any] = ()  # returns to zero and bias
    begun: int = 0  # number of moves begun, trajectories too
    profiles: Sequence[Any] = ()  # how each motion profile went


class Stop(Exception):
    """Raised by a progress callback to end a run early; its recording is kept."""


def check(request: Request) -> Job:
    """Check everything before anything is written or computed."""
    keys.seed(request.seed, "--seed")
    setup, source, name = setups.of_request(request)
    out = folder.choose_folder(request.out, Path("results") / name, overwrite=request.overwrite)
    needed = needed_bytes(setup.columns(), setup.capacity)
    folder.check(out, needed, overwrite=request.overwrite, names=setup.files)
    return Job(request, setup, out, overridden(setup.settings, setup.default), source)


def execute(job: Job, progress: Progress | None = None) -> Ended:
    """Run a job into its folder's recording and measure it."""
    request, setup, began = job.request, job.setup, time.perf_counter()
    folder.make(job.out)
    attributes = setup.about(request.seed)
    if job.source is not None:
        attributes["rig"] = request.rig
    on, file = setup.open(job.source, request.seed), job.out / folder.RECORDING
    rows, dt = setup.columns(on), setup.period
    with folder.recorder(file, rows, setup.capacity, dt, attributes) as recorder:
        outcome = setup.perform(recorder, on=on, seed=request.seed, progress=progress)
        folder.conclude(recorder, outcome.finished, outcome.fault)
    wall = time.perf_counter() - began
    recording = setup.padded(Recording.load(file))
    return Ended(
        job=job,
        recording=recording,
        finished=outcome.finished,
        fault=outcome.fault,
        simulated=round(len(recording) * recording.dt, 9),
        wall=wall,
        **setup.results(recording),
    )
