"""A motion programme on the virtual bench: checked first, then run and measured."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from macromicro import hall_table, simulate
from macromicro import programme as programmes
from macromicro.columns import whole
from macromicro.design.extension import Cycle, extension, per_cycle
from macromicro.design.profiles import ProfileResult, profiles
from macromicro.design.response import MoveResult, moves
from macromicro.design.served import timetable
from macromicro.design.tracking import Tracking, followed, tracking
from macromicro.design.vibration import Vibration, vibration
from macromicro.drawing import files
from macromicro.errors import InputError
from macromicro.loop import PERIOD
from macromicro.programme import MACRO, MICRO, Programme
from macromicro.programme.travel import limits
from macromicro.recorded import COLUMNS
from macromicro.recording import Recording, needed_bytes
from macromicro.rig import faults
from macromicro.rig.faults import Fault
from macromicro.rig.opening import TWIN, open_rig
from macromicro.rig.replay import SCHEME, Replay, opened
from macromicro.rig.session import Fixture
from macromicro.runs import folder, programmed
from macromicro.runs.programmed import Place
from macromicro.schema import keys
from macromicro.settings import Settings, chosen

DEFAULT = "thesis"


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
    request: Request  # as it was
    settings: Settings  # settings with the user's overrides
    programme: Programme  # all cycles
    per_cycle: int  # moves of a cycle
    overrides: dict[str, str]  # dotted path to text with unit
    out: Path  # folder of the results
    expected: float  # simulated time, roughly, s
    recalibrate: bool  # whether the Hall sensor is not the one that was calibrated
    # what it runs on: None for the twin, a rig, or a recording that is replayed
    source: Place = None

    @property
    def names(self) -> tuple[str, ...]:
        """Files that it may write."""
        return folder.FILES

    @property
    def waits(self) -> bool:
        """Whether the run needs the compiled bench."""
        return self.source is None and not simulate.runs_interpreted(*self._simulated)

    @property
    def _simulated(self) -> tuple[Settings, Programme, bool]:
        return self.settings, self.programme, self.request.fan

    def is_compiled(self) -> bool:
        return simulate.is_compiled()

    def compile(self) -> None:
        simulate.compile_bench(*self._simulated)

    def execute(self, progress: Callable[[float, int], None] | None = None) -> Ended:
        return execute(self, progress)

    def intent(self) -> list[str]:
        """What will move on the user's rig, how far and how hard."""
        if not isinstance(self.source, Fixture):
            return []
        control, pitch = self.settings.controller, self.settings.sensors.encoder.pitch
        stage, target = self.programme.stage, self.programme.target
        title = self.programme.title or "a programme"
        lines = [f"{self.source.name}, {title}, about {self.expected:.0f} s:"]
        if self.source.has("encoder"):
            limit = f"{control.motor_limit:g} V"
            lines.append(f"  first the macro-stage to 0 counts, at up to {limit}")
        for which, name, scale, limit in (
            (MACRO, "macro", 1e3 * pitch, f"motor up to {control.motor_limit:g} V"),
            (MICRO, "micro", 1e3, f"CTRL up to {control.ctrl_limit:g} V"),
        ):
            ways = target[stage == which] * scale
            if len(ways):
                reach = f"from {np.min(ways):.6g} to {np.max(ways):.6g} mm"
                lines.append(f"  {name}-stage: {len(ways)} set points {reach}, {limit}")
        return lines

    def notices(self) -> list[str]:
        """Remarks before the run."""
        recalibrating = "another Hall sensor: calibrating it on this bench first"
        return [recalibrating] if self.recalibrate else []

    def move(self, k: int) -> str:
        """A move in words, "move 3 of 40: micro to 3 mm"; only the position within a profile."""
        programme = self.programme
        if not 0 <= k < len(programme.target):
            return ""
        macro = programme.stage[k] == MACRO
        metres = programme.target[k] * (self.settings.sensors.encoder.pitch if macro else 1.0)
        name = "macro" if macro else "micro"
        if programme.profiles and not (programme.mixed and programme.moves[k]):
            return f"{name} at {metres * 1e3:.3f} mm"
        number, last = (int(programme.numbers[i]) for i in (k, -1))
        return f"move {number} of {last}: {name} to {metres * 1e3:g} mm"


class Ended(NamedTuple):
    job: Job  # what was run
    recording: Recording  # in the folder
    finished: bool  # whether the programme came to its end
    fault: Fault | None  # fault of the guard
    simulated: float  # time on the bench, s
    wall: float  # time that it took, s
    moves: list[MoveResult]  # None of a stage that follows a trajectory
    tracking: list[Tracking]  # how those stages followed
    vibration: list[Vibration]  # after the first cycle's macro moves
    cycles: list[Cycle]  # returns to zero and bias
    begun: int  # number of moves begun, trajectories too
    profiles: tuple[ProfileResult, ...] = ()  # how each motion profile went


class Stop(Exception):
    """Raised by a progress callback to end a run early; its recording is kept."""


def load(path: Path, settings: Settings) -> Programme:
    return programmes.load(path, limits(settings.travel, settings.sensors.encoder.pitch))


def check(request: Request) -> Job:
    settings = chosen(Settings(), request.config, request.law)
    source = place(request.rig, request.seed, settings)
    if isinstance(source, Recording) and request.programme is None:
        single, name = timetable(source), Path(request.rig.removeprefix(SCHEME)).stem
    else:
        path = programmes.find(request.programme or DEFAULT)
        single, name = load(path, settings), path.stem
    keys.seed(request.seed, "--seed")
    try:
        programme = single.repeated(request.cycles)
    except InputError as error:
        raise error.at("--cycles") from None
    if isinstance(source, Fixture):
        programmed.check(source, programme)
    name = f"{name}-replay" if isinstance(source, Recording) else name
    out = folder.chosen(request.out, Path("results") / name, overwrite=request.overwrite)
    needed = needed_bytes(COLUMNS, _capacity(settings, programme))
    folder.check(out, needed, overwrite=request.overwrite)
    return Job(
        request=request,
        settings=settings,
        programme=programme,
        per_cycle=len(single.target),
        overrides=programmed.overridden(settings),
        out=out,
        expected=simulate.expected(settings, programme),
        recalibrate=not isinstance(source, Fixture) and hall_table.needed(settings),
        source=source,
    )


def place(rig: str, seed: int, settings: Settings | None = None) -> Place:
    if rig == TWIN:
        return None
    if not rig.startswith(SCHEME):
        own = settings or Settings()
        return open_rig(rig, seed, limits=own.guard, gains=own.controller)
    source = opened(rig)
    Replay(source, rig.removeprefix(SCHEME))  # has it sensors?
    return source


def _capacity(settings: Settings, programme: Programme) -> int:
    """Rows to reserve: the usual duration and a margin; a longer run makes the file grow."""
    longest = simulate.longest(settings, programme)
    return round(min(longest, 1.05 * simulate.expected(settings, programme) + 5.0) / PERIOD)


def execute(job: Job, progress: Callable[[float, int], None] | None = None) -> Ended:
    """Run a job into its folder's recording and measure it."""
    request = job.request
    folder.make(job.out)
    attributes = programmed.about(
        job.programme.title,
        job.settings,
        seed=request.seed,
        fan=request.fan,
        cycles=request.cycles,
    )
    if job.source is not None:
        attributes["rig"] = request.rig
    file = job.out / folder.RECORDING
    began = time.perf_counter()
    rows = programmed.columns(job.source, job.settings)
    with folder.recorder(
        file, rows, _capacity(job.settings, job.programme), PERIOD, attributes
    ) as recorder:
        outcome = programmed.perform(
            job.programme,
            job.settings,
            recorder,
            on=job.source,
            seed=request.seed,
            fan=request.fan,
            progress=progress,
        )
        folder.conclude(recorder, outcome.finished, faults.describe(outcome.watch))
    wall = time.perf_counter() - began
    recording = Recording.load(file)
    if isinstance(job.source, Fixture):
        recording = _unmeasured(recording)
    return measure(job, recording, outcome, wall)


def _unmeasured(recording: Recording) -> Recording:
    """A rig's recording with NaN in channels that it lacks, which measures and figures skip."""
    shown = tuple(c for c in COLUMNS if c.name in recording or not c.name.startswith("true_"))
    nothing = np.full(len(recording), np.nan)
    rows = np.array([recording[c.name] if c.name in recording else nothing for c in shown])  # noqa: SIM401
    return Recording.from_arrays(shown, whole(rows, shown), recording.dt, recording.attributes)


def measure(job: Job, recording: Recording, outcome: simulate.Outcome, wall: float) -> Ended:
    pitch, band = job.settings.sensors.encoder.pitch, job.settings.controller.sequence.tolerance
    done = moves(
        recording,
        job.programme,
        pitch=pitch,
        macro_band=band,
        but=followed(recording, job.programme),
    )
    first = [m for m in done if m.stage == "macro" and m.move < job.per_cycle]
    shaken = [v for m in first if (v := vibration(recording, m)) is not None]
    return Ended(
        job=job,
        recording=recording,
        finished=outcome.finished,
        fault=faults.describe(outcome.watch),
        simulated=round(len(recording) * recording.dt, 9),
        wall=wall,
        moves=done,
        tracking=tracking(recording, job.programme, pitch=pitch),
        vibration=shaken,
        cycles=per_cycle(done, extension(recording), job.per_cycle),
        begun=int(recording["move"][-1]) + 1 if len(recording) else 0,
        profiles=tuple(profiles(recording, job.programme, pitch=pitch, macro_band=band)),
    )
