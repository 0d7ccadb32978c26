"""A motion programme on the virtual bench: checked first, then run and measured."""

from __future__ import annotations

import contextlib
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
from macromicro.programme import MACRO, Programme
from macromicro.programme.travel import limits
from macromicro.recorded import COLUMNS
from macromicro.recording import Recorder, Recording, needed_bytes
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
# What a macro move usually takes until its arrival is declared [s]; only a progress bar
# relies on it.
_USUAL_MOVE = 0.9


class Request(NamedTuple):
    """What the user asked for.

    Attributes
    ----------
    programme : str | None
        A file or an example's name; None for the usual one or a replayed recording's own moves.
    out : Path | None
        Folder of the results.
    config : Path | None
        File of settings.
    cycles : int
        How often in a row.
    fan : bool
        Whether the fan cools the wires.
    seed : int
        Seed of the sensor noise.
    overwrite : bool
        Whether files may be replaced.
    rig : str
        The twin, MODULE:FACTORY of a rig, or replay:FILE for its sensors.
    figures : tuple[str, ...]
        Formats of the figures.
    law : str | None
        The macro-stage's; None for that of the settings.
    """

    programme: str | None = None
    out: Path | None = None
    config: Path | None = None
    cycles: int = 1
    fan: bool = False
    seed: int = 0
    overwrite: bool = False
    rig: str = TWIN
    figures: tuple[str, ...] = files.DEFAULT
    law: str | None = None


class Job(NamedTuple):
    """A request that was found good.

    Attributes
    ----------
    request : Request
        As it was.
    settings : Settings
        Settings with the user's overrides.
    programme : Programme
        All cycles.
    per_cycle : int
        Moves of a cycle.
    overrides : dict[str, str]
        Dotted path to text with unit.
    out : Path
        Folder of the results.
    expected : float
        Simulated time, roughly, s.
    recalibrate : bool
        Whether the Hall sensor is not the one that was calibrated.
    source : Place
        What it runs on: None for the twin, a rig, or a recording that is replayed.
    """

    request: Request
    settings: Settings
    programme: Programme
    per_cycle: int
    overrides: dict[str, str]
    out: Path
    expected: float
    recalibrate: bool
    source: Place = None


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
        Fault of the guard.
    simulated : float
        Time on the bench, s.
    wall : float
        Time that it took, s.
    moves : list[MoveResult]
        None of a stage that follows a trajectory.
    tracking : list[Tracking]
        How those stages followed.
    vibration : list[Vibration]
        After the first cycle's macro moves.
    cycles : list[Cycle]
        Returns to zero and bias.
    begun : int
        Number of moves begun, trajectories too.
    profiles : tuple[ProfileResult, ...], optional
        How each motion profile went.
    """

    job: Job
    recording: Recording
    finished: bool
    interrupted: bool
    fault: Fault | None
    simulated: float
    wall: float
    moves: list[MoveResult]
    tracking: list[Tracking]
    vibration: list[Vibration]
    cycles: list[Cycle]
    begun: int
    profiles: tuple[ProfileResult, ...] = ()


class Stop(Exception):
    """Raised by a progress callback to end a run early; what was recorded is kept."""


def load(path: Path, settings: Settings) -> Programme:
    """The programme in a file, within the travel of the settings' bench.

    Parameters
    ----------
    path : Path
        .toml or .csv.
    settings : Settings
        Travel and encoder count.

    Returns
    -------
    Programme
        Targets in counts and m.

    Raises
    ------
    InputError
        Names the file and the place of what is not accepted.
    """
    return programmes.load(path, limits(settings.travel, settings.sensors.encoder.pitch))


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
    settings = chosen(Settings(), request.config, request.law)
    source = place(request.rig, request.seed)
    if isinstance(source, Recording) and request.programme is None:
        single, name = timetable(source), Path(request.rig.removeprefix(SCHEME)).stem
    else:
        path = programmes.find(request.programme or DEFAULT)
        single, name = load(path, settings), path.stem
    keys.seed(request.seed, "--seed")
    try:
        programme = single.repeated(request.cycles)
    except InputError as error:
        raise InputError("--cycles", error.value, error.accepted) from None
    if isinstance(source, Fixture):
        programmed.check(source, programme)
    name = f"{name}-replay" if isinstance(source, Recording) else name
    out = request.out if request.out is not None else Path("results") / name
    needed = needed_bytes(COLUMNS, _capacity(settings, programme))
    folder.check(out, needed, overwrite=request.overwrite)
    return Job(
        request=request,
        settings=settings,
        programme=programme,
        per_cycle=len(single.target),
        overrides=programmed.overridden(settings),
        out=out,
        expected=_expected(settings, programme),
        recalibrate=not isinstance(source, Fixture) and hall_table.needed(settings),
        source=source,
    )


def place(rig: str, seed: int) -> Place:
    """What ``--rig`` names, for a programme.

    Parameters
    ----------
    rig : str
        "twin", "MODULE:FACTORY", "FILE.toml" or "replay:FILE".
    seed : int
        Given to the factory.

    Returns
    -------
    Place
        None for the twin, a rig, or a recording with sensors.

    Raises
    ------
    InputError
        It is not to be had.
    """
    if rig == TWIN:
        return None
    if not rig.startswith(SCHEME):
        return open_rig(rig, seed)
    source = opened(rig)
    Replay(source, rig.removeprefix(SCHEME))  # has it sensors?
    return source


def _capacity(settings: Settings, programme: Programme) -> int:
    """Rows to reserve: the usual course and some; a longer one makes the file grow."""
    longest = simulate.longest(settings, programme)
    return round(min(longest, 1.05 * _expected(settings, programme) + 5.0) / PERIOD)


def _expected(settings: Settings, programme: Programme) -> float:
    if programme.scheduled:
        return programme.end
    each = _USUAL_MOVE + settings.controller.sequence.wait
    return float(programme.hold.sum()) + each * int(
        (programme.waiting & (programme.stage == MACRO)).sum()
    )


def execute(job: Job, progress: Callable[[float, int], None] | None = None) -> Ended:
    """Run a job into its folder's recording and measure what it shows.

    Parameters
    ----------
    job : Job
        From `check`.
    progress : Callable[[float, int], None] | None, optional
        Called with the simulated time (s) and the index of the present move; it ends the run early
        by raising `Stop`.

    Returns
    -------
    Ended
        Recording and measures.

    Raises
    ------
    OSError
        The disk refuses.
    RecordingError
        The disk refuses, while the recording is written.
    """
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
    outcome = None
    began = time.perf_counter()
    rows = programmed.columns(job.source, job.settings)
    with (
        Recorder(
            file, rows, _capacity(job.settings, job.programme), PERIOD, attributes
        ) as recorder,
        contextlib.suppress(Stop),
    ):
        outcome = programmed.perform(
            job.programme,
            job.settings,
            recorder,
            on=job.source,
            seed=request.seed,
            fan=request.fan,
            progress=progress,
        )
    wall = time.perf_counter() - began
    recording = Recording.load(file)
    if isinstance(job.source, Fixture):
        recording = _unmeasured(recording)
    return measure(job, recording, outcome, wall)


def _unmeasured(recording: Recording) -> Recording:
    """A rig's recording with NaN where the rig measures nothing: measures and figures leave that
    out."""
    shown = tuple(c for c in COLUMNS if c.name in recording or not c.name.startswith("true_"))
    nothing = np.full(len(recording), np.nan)
    rows = np.array([recording[c.name] if c.name in recording else nothing for c in shown])  # noqa: SIM401
    return Recording.from_arrays(shown, whole(rows, shown), recording.dt, recording.attributes)


def measure(job: Job, recording: Recording, outcome: simulate.Outcome | None, wall: float) -> Ended:
    """What a recording shows.

    Parameters
    ----------
    job : Job
        What was run.
    recording : Recording
        Recording of that run.
    outcome : simulate.Outcome | None
        How it ended; None for a run that was stopped early.
    wall : float
        Time that it took, s.

    Returns
    -------
    Ended
        The measures.
    """
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
        finished=outcome is not None and outcome.finished,
        interrupted=outcome is None,
        fault=None if outcome is None else faults.describe(outcome.watch),
        simulated=round(len(recording) * recording.dt, 9),
        wall=wall,
        moves=done,
        tracking=tracking(recording, job.programme, pitch=pitch),
        vibration=shaken,
        cycles=per_cycle(done, extension(recording), job.per_cycle),
        begun=int(recording["move"][-1]) + 1 if len(recording) else 0,
        profiles=tuple(profiles(recording, job.programme, pitch=pitch, macro_band=band)),
    )
