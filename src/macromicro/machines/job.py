"""Runs a programme on a machine into a folder."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from macromicro.drawing import files
from macromicro.errors import ProblemError
from macromicro.machines import (
    composite,
    compositions,
    on_rig,
    planning,
    programmes,
    results,
    runs,
)
from macromicro.machines.composite import AnyMachine, Composite
from macromicro.recording import Recording, needed_bytes
from macromicro.rig.faults import Fault
from macromicro.rig.session import Fixture
from macromicro.runs import folder
from macromicro.runs import job as two_stage
from macromicro.runs.job import Request
from macromicro.schema import keys

FIGURES = ("response", "moves")  # of a machine of one stage
PATH_FIGURES = ("path", "axes")  # of one of several


class Job(NamedTuple):
    """A checked request."""

    request: Request
    machine: Any  # `AnyMachine`
    settings: Any
    programme: Any
    plan: Any  # `Planned`; all cycles, with profiles
    overrides: dict[str, str]  # dotted path to text with unit
    out: Path
    expected: float  # simulated time, roughly, s
    source: tuple[Fixture, ...] | None = None  # a rig a stage; None: the simulated machine

    @property
    def planned(self) -> int:
        """Number of moves."""
        return len(planning.each(self.plan)[0].target)

    @property
    def names(self) -> tuple[str, ...]:
        """Files that it may write."""
        return file_names(self.machine)

    @property
    def waits(self) -> bool:
        """Whether the run needs the compiled machine; on a rig its period runs interpreted."""
        return self.source is None and not runs.runs_interpreted(*self._simulated)

    @property
    def _simulated(self) -> tuple[Any, Any, Any]:
        return self.machine, self.settings, self.plan

    def is_compiled(self) -> bool:
        return runs.is_compiled()

    def compile(self) -> None:
        runs.compile_machine(*self._simulated)

    def execute(self, progress: Callable[[float, int], None] | None = None) -> Ended:
        return execute(self, progress)

    def intent(self) -> list[str]:
        """What will move on the user's rig, how far and how hard."""
        if self.source is None:
            return []
        return on_rig.said(*self._simulated, self.programme.title, self.source, self.expected)

    def notices(self) -> list[str]:
        """Remarks before the run."""
        return []

    def move(self, k: int) -> str:
        return f"move {k + 1}"


class Ended(NamedTuple):
    job: Job
    recording: Recording
    finished: bool  # whether the programme came to its end
    fault: Fault | None
    simulated: float  # time on the machine, s
    wall: float
    moves: list[Any]


def file_names(machine: AnyMachine) -> tuple[str, ...]:
    drawn = PATH_FIGURES if isinstance(machine, Composite) else FIGURES
    return (folder.RECORDING, folder.SUMMARY, folder.PAGE, *files.names(drawn))


def of_any(request: Request) -> Any:
    """The checked run of the machine that a settings file, or none, is for."""
    if compositions.is_two_stage(request.config):
        return two_stage.check(request)
    return check(request)


def check(request: Request) -> Job:
    """Check everything before anything is written or computed."""
    assert request.config is not None  # which names the machine
    if request.fan:
        raise ProblemError("--fan", "this machine has no fan")
    machine, settings = compositions.load(request.config, request.law)
    programme = programmes.chosen(machine, settings, request.programme)
    name = Path(request.programme or request.config).stem
    keys.seed(request.seed, "--seed")
    source = on_rig.found(request.rig, machine, settings, request.seed)
    programme = programmes.repeated(machine, programme, request.cycles)
    plan = programmes.plan(machine, settings, programme)
    out = folder.chosen(request.out, Path("results") / name, overwrite=request.overwrite)
    expected = runs.expected(machine, settings, plan)
    overrides = runs.overridden(machine, settings)
    job = Job(request, machine, settings, programme, plan, overrides, out, expected, source)
    needed = needed_bytes(runs.columns(machine), _capacity(job))
    folder.check(out, needed, overwrite=request.overwrite, names=job.names)
    return job


def _capacity(job: Job) -> int:
    """Rows to reserve; the file grows if needed."""
    return round((1.05 * job.expected + 5.0) / composite.period(job.machine, job.settings))


def execute(job: Job, progress: Callable[[float, int], None] | None = None) -> Ended:
    """Run a job into its folder's recording and measure it."""
    request, settings, machine = job.request, job.settings, job.machine
    folder.make(job.out)
    attributes = runs.about(
        machine, settings, job.programme.title, seed=request.seed, cycles=request.cycles
    )
    place, began = job.out / folder.RECORDING, time.perf_counter()
    opened = None if job.source is None else on_rig.opened(job.source, request.seed)
    if opened is not None:
        attributes["rig"] = request.rig
    rows = runs.columns(machine, None if opened is None else opened.members)
    dt, capacity = composite.period(machine, settings), _capacity(job)
    with folder.recorder(place, rows, capacity, dt, attributes) as recorder:
        what = (machine, settings, job.plan, recorder)
        if opened is None or job.source is None:
            outcome = runs.perform(*what, seed=request.seed, progress=progress)
        else:
            rests = [fixture.rest for fixture in job.source]
            outcome = on_rig.perform(*what, opened, rests, progress)
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
        moves=results.of(machine, recording, job.plan, settings),
    )
