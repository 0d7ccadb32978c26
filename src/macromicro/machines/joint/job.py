"""Runs a programme on a two-axis machine into a folder."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from macromicro import programme as programmes
from macromicro.drawing import files
from macromicro.errors import ProblemError
from macromicro.machines.job import Request
from macromicro.machines.joint import course, on_rig, planning, results, runs, two_rigs
from macromicro.machines.joint import machine as joint
from macromicro.machines.joint.course import Course
from macromicro.machines.joint.machine import Joint, load
from macromicro.machines.joint.planning import JointPlan
from macromicro.machines.joint.results import JointMove
from macromicro.machines.joint.two_rigs import Two
from macromicro.programme.moves import MAX_MOVES
from macromicro.recording import Recording, needed_bytes
from macromicro.rig.faults import Fault
from macromicro.runs import folder
from macromicro.schema import keys

FIGURES = ("path", "axes")
FILES = (folder.RECORDING, folder.SUMMARY, folder.PAGE, *files.names(FIGURES))


class Job(NamedTuple):
    """A checked request."""

    request: Request
    machine: Joint
    settings: Any
    programme: Course
    plan: JointPlan  # all cycles, with profiles
    overrides: dict[str, str]  # dotted path to text with unit
    out: Path
    expected: float  # simulated time, roughly, s
    source: Two | None = None  # the rigs that it runs on; None: the simulated machine


class Ended(NamedTuple):
    job: Job
    recording: Recording
    finished: bool  # whether the programme came to its end
    fault: Fault | None  # of the axis that met it
    simulated: float  # time on the machine, s
    wall: float
    moves: list[JointMove]


def chosen(settings: Any, programme: str | None) -> Course:
    if programme is None:
        return course.usual(settings)
    return course.load(programmes.find(programme))


def check(request: Request) -> Job:
    """Check everything before anything is written or computed."""
    if request.law is not None:
        raise ProblemError("--law", joint.LAWS, joint.SET_LAWS)
    machine, settings = load(request.config)
    programme = chosen(settings, request.programme)
    keys.seed(request.seed, "--seed")
    source = two_rigs.found(request.rig, settings, request.seed)
    keys.whole(request.cycles, 1, MAX_MOVES // len(programme.legs), "--cycles")
    plan = planning.plan(programme, settings, request.cycles)
    name = Path(request.programme or request.config).stem
    out = folder.chosen(request.out, Path("results") / name, overwrite=request.overwrite)
    expected = runs.expected(settings, plan)
    needed = needed_bytes(runs.columns(machine), _capacity(settings, expected))
    folder.check(out, needed, overwrite=request.overwrite, names=FILES)
    overrides = runs.overridden(machine, settings)
    return Job(request, machine, settings, programme, plan, overrides, out, expected, source)


def _capacity(settings: Any, expected: float) -> int:
    """Rows to reserve; the file grows if needed."""
    return round((1.05 * expected + 5.0) / float(settings.x.timing.period))


def execute(job: Job, progress: Callable[[float, int], None] | None = None) -> Ended:
    """Run a job into its folder's recording and measure it."""
    request, settings = job.request, job.settings
    folder.make(job.out)
    attributes = runs.about(
        job.machine, settings, job.programme.title, seed=request.seed, cycles=request.cycles
    )
    place, began = job.out / folder.RECORDING, time.perf_counter()
    dt, rows = settings.x.timing.period, runs.columns(job.machine)
    if job.source is not None:
        attributes["rig"] = request.rig
        pair = two_rigs.opened(job.source, request.seed)
        rows = on_rig.columns(job.machine, pair.halves)
    capacity = _capacity(settings, job.expected)
    with folder.recorder(place, rows, capacity, dt, attributes) as recorder:
        what = (job.machine, settings, job.plan, recorder)
        if job.source is None:
            outcome = runs.perform(*what, seed=request.seed, progress=progress)
        else:
            first, second = job.source
            outcome = two_rigs.perform(*what, pair, (first.rest, second.rest), progress)
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
        moves=results.moves(recording, job.plan, settings),
    )
