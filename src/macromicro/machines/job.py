"""Runs a programme on a single-stage machine into a folder."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from macromicro import programme as programmes
from macromicro.drawing import files
from macromicro.errors import InputError
from macromicro.machines import on_rig, planning, results, runs
from macromicro.machines.machine import Machine, load
from macromicro.machines.results import MoveResult
from macromicro.machines.sequence import Plan
from macromicro.programme import Programme
from macromicro.recording import Recording, needed_bytes
from macromicro.rig.faults import Fault
from macromicro.rig.opening import TWIN
from macromicro.rig.session import Fixture
from macromicro.runs import folder
from macromicro.schema import keys

FIGURES = ("response", "moves")
FILES = (folder.RECORDING, folder.SUMMARY, folder.PAGE, *files.names(FIGURES))


class Request(NamedTuple):
    config: Path  # file of settings, which names the machine
    programme: str | None = None  # A file or an example's name; None for the machine's usual moves
    out: Path | None = None
    cycles: int = 1
    seed: int = 0  # seed of the sensor's noise
    overwrite: bool = False  # whether files may be replaced
    figures: tuple[str, ...] = files.DEFAULT
    law: str | None = None  # instead of the one that the file names
    rig: str = TWIN  # the simulated machine, or the name of a rig


class Job(NamedTuple):
    """A checked request."""

    request: Request
    machine: Machine
    settings: Any
    programme: Programme
    plan: Plan
    overrides: dict[str, str]  # dotted path to text with unit
    out: Path
    expected: float  # simulated time, roughly, s
    source: Fixture | None = None  # the rig that it runs on; None: the simulated machine


class Ended(NamedTuple):
    job: Job
    recording: Recording
    finished: bool  # whether the programme came to its end
    fault: Fault | None
    simulated: float  # time on the machine, s
    wall: float
    moves: list[MoveResult]


def check(request: Request) -> Job:
    """Check everything before anything is written or computed."""
    machine, settings = load(request.config, request.law)
    if request.programme is None:
        single, name = planning.usual(settings), request.config.stem
    else:
        path = programmes.find(request.programme)
        single, name = planning.load(path, settings), path.stem
    keys.seed(request.seed, "--seed")
    source = on_rig.found(request.rig, settings, request.seed)
    try:
        programme = single.repeated(request.cycles)
    except InputError as error:
        raise error.at("--cycles") from None
    plan = planning.plan(programme, settings)
    out = folder.chosen(request.out, Path("results") / name, overwrite=request.overwrite)
    expected = runs.expected(settings, plan)
    folder.check(
        out,
        needed_bytes(runs.columns(machine), _capacity(settings, expected)),
        overwrite=request.overwrite,
        names=FILES,
    )
    overrides = runs.overridden(machine, settings)
    return Job(request, machine, settings, programme, plan, overrides, out, expected, source)


def _capacity(settings: Any, expected: float) -> int:
    """Rows to reserve; the file grows if needed."""
    return round((1.05 * expected + 5.0) / float(settings.timing.period))


def execute(job: Job, progress: Callable[[float, int], None] | None = None) -> Ended:
    """Run a job into its folder's recording and measure it."""
    request, settings = job.request, job.settings
    folder.make(job.out)
    attributes = runs.about(
        job.machine, settings, job.programme.title, seed=request.seed, cycles=request.cycles
    )
    place, began = job.out / folder.RECORDING, time.perf_counter()
    capacity = _capacity(settings, job.expected)
    rig = None if job.source is None else job.source.open(request.seed)
    if rig is not None:
        attributes["rig"] = request.rig
    rows, dt = runs.columns(job.machine, rig), settings.timing.period
    with folder.recorder(place, rows, capacity, dt, attributes) as recorder:
        what = (job.machine, settings, job.plan, recorder)
        if rig is None or job.source is None:
            outcome = runs.perform(*what, seed=request.seed, progress=progress)
        else:
            outcome = on_rig.perform(*what, rig, job.source.rest, progress)
        folder.conclude(recorder, outcome.finished, outcome.fault)
    wall = time.perf_counter() - began
    recording = Recording.load(place)
    return Ended(
        job=job,
        recording=recording,
        finished=outcome.finished,
        fault=outcome.fault,
        simulated=round(len(recording) * recording.dt, 9),
        wall=wall,
        moves=results.moves(recording, job.plan, settings.arrival, job.machine.kind.place),
    )
