"""A programme on a machine of two axes, into a folder: checked first, then run and measured."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from macromicro import programme as programmes
from macromicro.drawing import files
from macromicro.errors import InputError
from macromicro.machines.job import Request
from macromicro.machines.joint import course, on_rig, planning, results, runs, two_rigs
from macromicro.machines.joint.course import Course
from macromicro.machines.joint.machine import Joint, load
from macromicro.machines.joint.planning import JointPlan
from macromicro.machines.joint.results import JointMove
from macromicro.machines.joint.two_rigs import Two
from macromicro.programme.moves import MAX_MOVES
from macromicro.recording import Recorder, Recording, needed_bytes
from macromicro.rig.faults import Fault
from macromicro.runs import folder
from macromicro.runs.job import Stop
from macromicro.schema import keys

FIGURES = ("path", "axes")
FILES = (folder.RECORDING, folder.SUMMARY, folder.PAGE, *files.names(FIGURES))


class Job(NamedTuple):
    """A request that was found good.

    Attributes
    ----------
    request : Request
        As it was.
    machine : Joint
        The machine.
    settings : Any
        Its settings.
    programme : Course
        One cycle.
    plan : JointPlan
        All cycles, with profiles.
    overrides : dict[str, str]
        Dotted path to text with unit.
    out : Path
        Folder of the results.
    expected : float
        Simulated time, roughly, s.
    source : tuple[Fixture, Fixture] | None
        The rigs that it runs on; None: the simulated machine.
    """

    request: Request
    machine: Joint
    settings: Any
    programme: Course
    plan: JointPlan
    overrides: dict[str, str]
    out: Path
    expected: float
    source: Two | None = None


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
        Of the axis that met it.
    simulated : float
        Time on the machine, s.
    wall : float
        Time that it took, s.
    moves : list[JointMove]
        How each went.
    """

    job: Job
    recording: Recording
    finished: bool
    interrupted: bool
    fault: Fault | None
    simulated: float
    wall: float
    moves: list[JointMove]


def chosen(settings: Any, programme: str | None) -> Course:
    """The programme that a user names.

    Parameters
    ----------
    settings : Any
        Of the machine.
    programme : str | None
        A file; None for the machine's usual moves.

    Returns
    -------
    Course
        Not yet looked at by the machine's limits.

    Raises
    ------
    InputError
        It cannot be read.
    """
    if programme is None:
        return course.usual(settings)
    return course.load(programmes.find(programme))


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
    if request.law is not None:
        accepted = "nothing: each axis has its own, x.law and y.law of the settings"
        raise InputError("--law", request.law, accepted)
    machine, settings = load(request.config)
    programme = chosen(settings, request.programme)
    keys.seed(request.seed, "--seed")
    source = two_rigs.found(request.rig, settings, request.seed)
    keys.whole(request.cycles, 1, MAX_MOVES // len(programme.legs), "--cycles")
    plan = planning.plan(programme, settings, request.cycles)
    name = Path(request.programme or request.config).stem
    out = request.out if request.out is not None else Path("results") / name
    expected = runs.expected(settings, plan)
    needed = needed_bytes(runs.columns(machine), _capacity(settings, expected))
    folder.check(out, needed, overwrite=request.overwrite, names=FILES)
    overrides = runs.overridden(machine, settings)
    return Job(request, machine, settings, programme, plan, overrides, out, expected, source)


def _capacity(settings: Any, expected: float) -> int:
    """Rows to reserve; a longer run makes the file grow."""
    return round((1.05 * expected + 5.0) / float(settings.x.timing.period))


def execute(job: Job, progress: Callable[[float, int], None] | None = None) -> Ended:
    """Run a job into its folder's recording and measure what it shows.

    Parameters
    ----------
    job : Job
        Of `check`.
    progress : Callable[[float, int], None] | None, optional
        Called now and then with the simulated time (s) and the index of the move; it ends the run
        early by raising `Stop`.

    Returns
    -------
    Ended
        Recording and measures.

    Raises
    ------
    OSError
        The disk refuses.
    MacromicroError
        On rigs: an axis did not come to where the programme begins.
    """
    request, settings = job.request, job.settings
    folder.make(job.out)
    attributes = runs.about(
        job.machine, settings, job.programme.title, seed=request.seed, cycles=request.cycles
    )
    place, outcome, began = job.out / folder.RECORDING, None, time.perf_counter()
    dt, rows = settings.x.timing.period, runs.columns(job.machine)
    if job.source is not None:
        attributes["rig"] = request.rig
        pair = two_rigs.opened(job.source, request.seed)
        rows = on_rig.columns(job.machine, pair.halves)
    capacity = _capacity(settings, job.expected)
    with Recorder(place, rows, capacity, dt, attributes) as recorder, contextlib.suppress(Stop):
        what = (job.machine, settings, job.plan, recorder)
        if job.source is None:
            outcome = runs.perform(*what, seed=request.seed, progress=progress)
        else:
            first, second = job.source
            outcome = two_rigs.perform(*what, pair, (first.rest, second.rest), progress)
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
        moves=results.moves(recording, job.plan, settings),
    )
