"""What ``macromicro commission`` does: one stage, two axes on one clock, both of two stages."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import typer

from macromicro.commands.signals import Signals
from macromicro.commands.streams import say

if TYPE_CHECKING:
    from macromicro.commission.procedure import Options
    from macromicro.commission.running import Calibrate, Commissioned, Place

KIND = "two_stage"
_BOTH_BYTES = 400_000_000
_HINT = "to correct the positions by a reference, repeat it with --calibrate --resume"


class Steps(NamedTuple):
    """How a commissioning talks to the person who started it."""

    started: str
    ask: Callable[[str, str], None]  # before a step: its title, and what will move
    done: Callable[[str], None]  # after a step
    ended: Callable[[], bool]  # whether to stop


class Summary(NamedTuple):
    rows: list[tuple[str, ...]]  # quantity, value, interval or remark, unit
    doubts: list[str]
    verified: list[str]  # how many moves arrived
    why: str  # why it is not verified; "" if it is
    hint: str = ""  # what to do next


class Task(NamedTuple):
    """A commissioning: its folders with the files that it writes there, and its work."""

    folders: Mapping[Path, tuple[str, ...]]
    size: int  # bytes of a folder
    real: bool  # on a rig of the user
    perform: Callable[[Steps], Any]
    write: Callable[[Any, str], None]  # the result, with the time of the start
    summarize: Callable[[Any], Summary]
    ends_early: bool = True  # whether it looks at `Steps.ended`
    more: tuple[str, ...] = ()  # what else an earlier one has left, folders among it


def run(task: Task, out: Path, rig: str, *, overwrite: bool, resume: bool, yes: bool) -> None:
    """Commission, write the results, and say what was found."""
    from contextlib import ExitStack
    from datetime import datetime

    from macromicro.commands.asking import stepwise
    from macromicro.commission.report import MACHINE, PAGE
    from macromicro.runs import folder

    replace = overwrite or resume
    for place, names in task.folders.items():
        folder.check(place, task.size, overwrite=replace, names=names)
    with Signals() as signals, ExitStack() as stack:
        for place, names in task.folders.items():
            stack.enter_context(folder.locked(place, overwrite=replace, names=names))
            if overwrite:
                _clear(place, (*names, *task.more))
        started = datetime.now().astimezone().isoformat(sep=" ", timespec="seconds")
        if task.ends_early:
            signals.later("stopping after this period; --resume repeats this step")
        steps = Steps(
            started,
            stepwise(rig, yes=yes or not task.real),
            lambda title: print(f"{title}: done", file=sys.stderr),
            lambda: bool(signals.received),
        )
        try:
            found = task.perform(steps)
        except KeyboardInterrupt:
            say(f"interrupted; to continue: --resume --out {out}")
            raise typer.Exit(signals.status) from None
        signals.later()
        task.write(found, started)
    summary = task.summarize(found)
    show_rows(summary.rows)
    print(*(f"doubtful: {doubt}" for doubt in summary.doubts), *summary.verified, sep="\n")
    print(f"page: {out / PAGE}\nmachine: {out / MACHINE}")
    if summary.why:
        say(f"not verified: {summary.why}")
        raise typer.Exit(1)
    if summary.hint:
        print(summary.hint)


def _clear(place: Path, names: Sequence[str]) -> None:
    """Remove what an earlier commissioning left, and nothing else."""
    for name in names:
        if (place / name).is_dir():
            shutil.rmtree(place / name, ignore_errors=True)
        else:
            (place / name).unlink(missing_ok=True)


def show_rows(rows: Iterable[tuple[str, ...]]) -> None:
    """Print the results: quantity, value with its unit, and interval or remark."""
    found = list(rows)
    width = max((len(row[0]) for row in found), default=0)
    for name, value, remark, unit in found:
        print(f"{name:{width}} {value:>12} {unit:10} {remark}".rstrip())


def _calibration(steps: Steps, seed: int) -> Calibrate:
    """The step that calibrates."""
    from macromicro.commission.calibrating import calibrate

    return partial(calibrate, seed=seed, ask=steps.ask, done=steps.done)


def _write_calibration(found: Any, out: Path, kinds: Sequence[str]) -> Any:
    """A result whose calibration is written and whose machine's file includes it."""
    from macromicro.calibration import files
    from macromicro.commission import calibrating

    if found.calibration is None:
        return found
    files.write(out, found.calibration, kinds)
    return found._replace(toml=calibrating.include_corrections(found.toml))


def _calibration_lines(found: Any, out: Path, hint: str) -> tuple[list[str], str]:
    """What a summary says of a calibration: its result, or how to do it."""
    from macromicro.calibration import files

    if found.calibration is None:
        return [], hint
    return [files.text(found.calibration), f"calibration: {out / files.PAGE}"], ""


def one_stage(
    place: Place, options: Options, out: Path, seed: int, kinds: Sequence[str], *, calibrate: bool
) -> Task:
    from macromicro.calibration import files
    from macromicro.commission import report
    from macromicro.commission.running import commission

    def perform(steps: Steps) -> Commissioned:
        return commission(
            place, options, out, seed=seed, ask=steps.ask, done=steps.done, ended=steps.ended,
            calibrate=_calibration(steps, seed) if calibrate else None,
        )  # fmt: skip

    def summarize(found: Commissioned) -> Summary:
        words, hint = _calibration_lines(found, out, _HINT)
        return Summary(
            report.rows(found, place),
            report.doubts(found, place),
            [_arrivals("verification", found.verified.moves, found.verified.asked), *words],
            "" if found.verified.met else report.why(found),
            hint,
        )

    def write(found: Commissioned, started: str) -> None:
        report.write(out, _write_calibration(found, out, kinds), place, started, kinds)

    folders = {out: (*report.names(place.kind), *files.FILES)}
    return Task(folders, report.BYTES, place.real, perform, write, summarize)


def _arrivals(what: str, moves: Sequence[Any], asked: int) -> str:
    from macromicro.machines.results import count_arrived

    return f"{what}: {count_arrived(moves)} of {asked} moves arrived"


def two_axes(
    config: Path,
    rig: str,
    options: Callable[[Place], Options],
    out: Path,
    seed: int,
    kinds: Sequence[str],
    *,
    calibrate: bool,
) -> Task:
    """Each axis from its encoder, then both in coordinated moves."""
    from macromicro.calibration import files
    from macromicro.commission import plane, report
    from macromicro.machines.joint.settings import AXES
    from macromicro.report import plane as pages
    from macromicro.rig.opening import TWIN

    if rig == TWIN:
        pair, places = plane.virtual(config, seed, calibrate=calibrate)
    else:
        pair, places = plane.own_places(config, rig, seed, calibrate=calibrate)
    allowed = (options(places[0]), options(places[1]))

    def perform(steps: Steps) -> plane.Both:
        def found(name: str, one: Commissioned) -> None:
            report.write(out / name, one, places[AXES.index(name)], steps.started, kinds)

        return plane.commission(
            pair, places, allowed, out,
            ask=steps.ask, done=steps.done, ended=steps.ended, found=found,
            calibrate=_calibration(steps, seed) if calibrate else None,
        )  # fmt: skip

    def summarize(both: plane.Both) -> Summary:
        verified = [
            _arrivals(f"verification of {name}", one.verified.moves, one.verified.asked)
            for name, one in zip(AXES, both.axes, strict=True)
        ]
        verified.append(_arrivals("verification of both", both.moves, len(both.plan.legs)))
        why = "" if both.met else pages.why(both)
        words, hint = _calibration_lines(both, out, _HINT)
        found = (pages.rows(both, places), pages.doubts(both, places), [*verified, *words])
        return Summary(*found, why, hint)

    def write(both: plane.Both, started: str) -> None:
        pages.write(out, _write_calibration(both, out, kinds), places, started, kinds)

    each = {out / n: report.names(p.kind) for n, p in zip(AXES, places, strict=True)}
    folders = {out: (*pages.FILES, *files.FILES), **each}
    return Task(folders, report.BYTES, places[0].real, perform, write, summarize)


def two_stages(config: Path | None, rig: str, kiln: str, out: Path, seed: int) -> Task:
    """Both stages of the two-stage machine, one after the other."""
    from macromicro.errors import ProblemError
    from macromicro.rig.opening import TWIN, open_rig
    from macromicro.schema.config import load_overrides
    from macromicro.settings import Settings
    from macromicro.thesis import commissioning as both
    from macromicro.thesis import commissioning_page as pages
    from macromicro.thesis.procedure import Lab

    if rig == TWIN:
        if kiln:
            remedy = "The simulated machine has its own kiln."
            raise ProblemError("--kiln", "only with --rig", remedy)
        lab = Lab(Settings() if config is None else load_overrides(config, Settings()), seed)
    elif config is not None:
        raise ProblemError("--config", "not allowed with --rig")
    else:
        rigs = tuple(open_rig(name, seed) for name in (rig, kiln) if name)
        lab = Lab(Settings(), seed, rigs)
    called = " and ".join(r.name for r in lab.rigs) or "twin"

    def summarize(found: both.Commissioned) -> Summary:
        asked = len(found.ended.job.programme.target)
        verified = _arrivals("verification", found.ended.moves, asked)
        return Summary(pages.rows(found), found.doubts, [verified], found.why)

    return Task(
        {out: pages.FILES},
        _BOTH_BYTES,
        bool(lab.rigs),
        lambda steps: both.commission(lab, out, steps.ask, steps.done),
        lambda found, started: pages.write(found, called, started),
        summarize,
        ends_early=False,
        more=(both.MACHINE, both.ASKED, both.DIRECTIONS, both.STEPS, both.VERIFICATION),
    )
