"""A programme on a machine of one stage, into a folder: checked first, then run and measured."""

from __future__ import annotations

import contextlib
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
from macromicro.recording import Recorder, Recording, needed_bytes
from macromicro.rig.faults import Fault
from macromicro.rig.opening import TWIN
from macromicro.rig.session import Fixture
from macromicro.runs import folder
from macromicro.runs.job import Stop
from macromicro.schema import keys

FIGURES = ("response", "moves")
FILES = (folder.RECORDING, folder.SUMMARY, folder.PAGE, *files.names(FIGURES))


class Request(NamedTuple):
    """What the user asked for.

    Attributes
    ----------
    config : Path
        File of settings, which names the machine.
    programme : str | None
        A file or an example's name; None for the machine's usual moves.
    out : Path | None
        Folder of the results.
    cycles : int
        How often in a row.
    seed : int
        Seed of the sensor's noise.
    overwrite : bool
        Whether files may be replaced.
    figures : tuple[str, ...]
        Formats of the figures.
    law : str | None
        Instead of the one that the file names.
    rig : str
        The simulated machine, or the name of a rig.
    """

    config: Path
    programme: str | None = None
    out: Path | None = None
    cycles: int = 1
    seed: int = 0
    overwrite: bool = False
    figures: tuple[str, ...] = files.DEFAULT
    law: str | None = None
    rig: str = TWIN


class Job(NamedTuple):
    """A request that was found good.

    Attributes
    ----------
    request : Request
        As it was.
    machine : Machine
        The machine.
    settings : Any
        Its settings.
    programme : Programme
        All cycles.
    plan : Plan
        The same with profiles.
    overrides : dict[str, str]
        Dotted path to text with unit.
    out : Path
        Folder of the results.
    expected : float
        Simulated time, roughly, s.
    source : Fixture | None
        The rig that it runs on; None: the simulated machine.
    """

    request: Request
    machine: Machine
    settings: Any
    programme: Programme
    plan: Plan
    overrides: dict[str, str]
    out: Path
    expected: float
    source: Fixture | None = None


class Ended(NamedTuple):
    """What a run gave.

    Attributes
    ----------
    job : Job
        What was run.
    recording : Recording
        In the folder.
    finished : bool
        Whether the programme came to its end.
    interrupted : bool
        Whether it was stopped from outside.
    fault : Fault | None
        Of the guard.
    simulated : float
        Time on the machine, s.
    wall : float
        Time that it took, s.
    moves : list[MoveResult]
        How each went.
    """

    job: Job
    recording: Recording
    finished: bool
    interrupted: bool
    fault: Fault | None
    simulated: float
    wall: float
    moves: list[MoveResult]


def check(request: Request) -> Job:
    """Everything that can be wrong is said here, before anything is written or computed.

    Parameters
    ----------
    request : Request
        What the user asked for.

    Returns
    -------
    Job
        Ready for `execute`.

    Raises
    ------
    InputError
        Something in it is not accepted.
    """
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
        raise InputError("--cycles", error.value, error.accepted) from None
    plan = planning.plan(programme, settings)
    out = request.out if request.out is not None else Path("results") / name
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
    """Rows to reserve; a longer run makes the file grow."""
    return round((1.05 * expected + 5.0) / float(settings.timing.period))


def execute(job: Job, progress: Callable[[float, int], None] | None = None) -> Ended:
    """Run a job into its folder's recording and measure what it shows.

    Parameters
    ----------
    job : Job
        From `check`.
    progress : Callable[[float, int], None] | None, optional
        Called with the simulated time (s) and the index of the move; it ends the run early by
        raising `Stop`.

    Returns
    -------
    Ended
        Recording and measures.

    Raises
    ------
    OSError
        The disk refuses.
    MacromicroError
        A rig did not come to where the programme begins.
    """
    request, settings = job.request, job.settings
    folder.make(job.out)
    attributes = runs.about(
        job.machine, settings, job.programme.title, seed=request.seed, cycles=request.cycles
    )
    place, outcome, began = job.out / folder.RECORDING, None, time.perf_counter()
    capacity = _capacity(settings, job.expected)
    rig = None if job.source is None else job.source.open(request.seed)
    if rig is not None:
        attributes["rig"] = request.rig
    rows, dt = runs.columns(job.machine, rig), settings.timing.period
    with Recorder(place, rows, capacity, dt, attributes) as recorder, contextlib.suppress(Stop):
        what = (job.machine, settings, job.plan, recorder)
        if rig is None or job.source is None:
            outcome = runs.perform(*what, seed=request.seed, progress=progress)
        else:
            outcome = on_rig.perform(*what, rig, job.source.rest, progress)
    wall = time.perf_counter() - began
    recording = Recording.load(place)
    return Ended(
        job=job,
        recording=recording,
        finished=outcome is not None and outcome.finished,
        interrupted=outcome is None,
        fault=None if outcome is None else outcome.fault,
        simulated=round(len(recording) * recording.dt, 9),
        wall=wall,
        moves=results.moves(recording, job.plan, settings.arrival, job.machine.kind.place),
    )
